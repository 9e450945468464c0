"""Switching angles as unknowns: exact derivatives, three solvers, and only true solutions."""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

import symhbm as sh
from studies import fig03_single_blade, fig08_engine_orders
from symhbm.balance.switching_angles import SwitchingAngles, slip_angles
from symhbm.continuation.angles.system import AngleStatus, solve_angles
from symhbm.continuation.newton import ACCEPTED
from symhbm.continuation.start import solve_point
from tests.problems import rub
from tests.quick import quick_first

SOLVERS = ("newton", "rootfinder", "ipopt")
HARMONICS = [(1,), (1, 3), (1, 3, 5)]
TURN = 2 * np.pi


@cache
def study(module, harmonics):
    problem = module.problem(harmonics)
    return problem, SwitchingAngles(problem)


@cache
def structure(n_blades, harmonics):
    values = dict(mass=1, stiffness=1e4, damping=1, contact_stiffness=1e5)
    values |= dict(friction_coefficient=0.5, normal_load=1)
    if n_blades == 1:
        problem = sh.HarmonicBalance(sh.single_blade(**values), sh.forces.PointForce(), harmonics)
    else:
        disk = sh.bladed_disk(n_blades, **values)
        problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(1), harmonics)
    return problem, SwitchingAngles(problem)


def perturbed(angles, start, slip, size, rng):
    """A start some way off, within the range of rho."""
    coefficients, theta_0, rho = angles.split(start)
    noise = size * rng.uniform(-1, 1, (2, len(slip))) * slip
    return np.concatenate(
        [
            coefficients * (1 + size * rng.uniform(-1, 1, len(coefficients))),
            theta_0 + noise[0],
            np.minimum(rho * (1 + noise[1]), 0.999),
        ]
    )


def turned(first, second):
    """Distance of two angles on the circle."""
    return np.abs((first - second + np.pi) % TURN - np.pi)


def assert_angles(result, evaluation):
    """Angles of a result against the located ones, where those have two events."""
    located = evaluation.states.groups["friction"].details
    has = located.slip & ~np.isnan(located.theta_star)
    assert np.array_equal(np.isnan(result.theta_star), ~located.slip)
    assert np.array_equal(np.isnan(result.theta_0), ~located.slip)
    for name in ("theta_0", "theta_star"):
        # The accuracy asked for; both are solved to about 1e-12.
        assert np.all(turned(getattr(result, name), getattr(located, name))[has] <= 1e-9)


def reverses_while_slipping(problem, unknowns, contact=0):
    """By samples: whether y rises after it first fell by 2 g / k_d from its largest value."""
    tau = np.linspace(0, TURN, 20_000, endpoint=False)
    wave = problem.basis.values(tau) @ problem.layout.relative(unknowns)[contact]
    wave = np.roll(wave, -int(np.argmax(wave)))[: len(tau) // 2]
    model = problem.model
    limit = model.friction_coefficient[contact] * model.normal_load[contact]
    fallen = wave <= wave[0] - 2 * limit / model.contact_stiffness[contact]
    return bool(np.any(np.diff(wave[int(np.argmax(fallen)) :]) > 0))


@pytest.mark.parametrize("harmonics", [(1, 3), (1, 3, 5)])
@pytest.mark.parametrize("solver", SOLVERS)
def test_motion_that_reverses_while_slipping_is_refused(solver, harmonics):
    """Three reversals per half period: at 64.5 Hz all while sticking, at 66 Hz not."""
    problem, _ = study(fig08_engine_orders, harmonics)
    problem = problem.with_parameters(normal_load=10)
    for frequency, refused in ((64.5, False), (66.0, True)):
        located = solve_point(problem, TURN * frequency)
        assert np.all(located.evaluation.states.groups["friction"].details.reversals == 6)
        assert reverses_while_slipping(problem, located.unknowns) == refused
        result = solve_angles(problem, TURN * frequency, solver, located.unknowns)
        assert result.converged == (not refused)
        assert result.applies.all() == (not refused)
        assert (result.status == AngleStatus.DOES_NOT_APPLY) == refused
    assert "reverses while it slips" in result.status


def random_problem(rng, n_blades, harmonics):
    problem, angles = structure(n_blades, harmonics)
    each = {name: rng.uniform(0.8, 1.2, n_blades) for name in ("mass", "stiffness", "load", "kd")}
    values = dict(
        mass=each["mass"],
        stiffness=1e4 * each["stiffness"],
        damping=rng.uniform(0.3, 3, n_blades),
        **rub(
            10 ** rng.uniform(3.5, 6.5) * each["kd"],
            rng.uniform(0.3, 0.7, n_blades),
            10 ** rng.uniform(-1.5, 1) * each["load"],
        ),
    )
    return problem.with_parameters(**values), angles


@pytest.mark.parametrize("count", quick_first([48, 200], 1))
def test_three_solvers_agree_on_random_problems(count):
    rng = np.random.default_rng(2013)
    converged, applied, slipped, worked = dict.fromkeys(SOLVERS, 0), 0, 0, []
    for number in range(count):
        n_blades, harmonics = (1, 3, 4, 5)[number % 4], HARMONICS[number // 4 % 3]
        problem, angles = random_problem(rng, n_blades, harmonics)
        omega = TURN * rng.uniform(4, 40)
        located = solve_point(problem, omega)
        assert located.converged
        start, slip = angles.start(problem, located.unknowns)
        first = perturbed(angles, start, slip, 0.05, rng)
        results = [
            solve_angles(problem, omega, name, located.unknowns, start=first) for name in SOLVERS
        ]
        refused = {result.status == AngleStatus.DOES_NOT_APPLY for result in results}
        assert len(refused) == 1
        applied += not refused.pop()
        slipped += slip.any()
        size = np.linalg.norm(located.unknowns)
        for name, result in zip(SOLVERS, results, strict=True):
            converged[name] += result.converged
            if not result.converged:
                assert result.status in set(AngleStatus) - {AngleStatus.SUCCESS}
                assert np.all(np.isnan(result.unknowns))
                continue
            # The accuracy asked for.
            assert np.linalg.norm(result.unknowns - located.unknowns) <= 1e-9 * size
            assert problem.evaluate(result.unknowns, omega).norm <= ACCEPTED
            assert_angles(result, located.evaluation)
            if slip.any():
                worked.append(result.iterations)
        good = [result.unknowns for result in results if result.converged]
        for other in good[1:]:
            assert np.linalg.norm(other - good[0]) <= 1e-9 * size
    # Measured of 200: the form applies to 194, 141 slip, 194, 194 and 193 converge.
    assert slipped >= 0.65 * count
    assert applied >= 0.95 * count
    assert min(converged.values()) >= 0.95 * count
    assert min(worked) >= 1
    assert np.median(worked) >= 3


def motion(shares, harmonics=(1, 3, 5), seed=4):
    """A ring of three, and a motion of it that asks for these shares of slip."""
    problem, angles = structure(3, harmonics)
    rng = np.random.default_rng(seed)
    unknowns = 1e-4 * rng.normal(size=problem.n_unknowns)
    unknowns /= np.tile(np.repeat(np.array(harmonics) ** 4.0, 2), 3)
    located = problem.locate(unknowns, 1.0).groups["friction"].details
    assert np.all(located.reversals == 2)
    # Times the load at which each contact begins to slip.
    load = np.exp(located.slip_margin) * problem.parameters["normal_load"] * np.array(shares)
    problem = problem.with_parameters(normal_load=load)
    start, slip = angles.start(problem, unknowns)
    return problem, angles, start, slip


SHARES = {
    "near onset": (1 - 1e-3, 1 - 2e-3, 1 - 1e-2),
    "half": (0.5, 0.3, 0.7),
    "gross slip": (1e-2, 1e-3, 1e-4),
    "mixed": (1.5, 0.4, 0.0),
}


def differences(function, name, angles, problem, start, slip, scale):
    """Central differences of a function's output by the unknowns, one column each."""
    columns = []
    for i, size in enumerate(scale):
        step = np.zeros(len(start))
        step[i] = size
        up, down = (
            function(**angles.arguments(problem, start + sign * step, 500.0, slip))
            for sign in (1, -1)
        )
        columns.append((np.asarray(up[name].full()) - np.asarray(down[name].full())) / (2 * size))
    return columns


def steps(angles, start, slip):
    """A millionth of the distance over which each unknown matters."""
    coefficients, theta_0, rho = angles.split(start)
    size = np.full(len(coefficients), np.abs(coefficients).max())
    return 1e-6 * np.concatenate([size, np.ones(len(theta_0)), rho * (1 - rho)])


def kinds(angles, problem):
    n, m = problem.n_unknowns, problem.model.n_contacts
    return [slice(0, n), slice(n, n + m), slice(n + m, n + 2 * m)]


@pytest.mark.parametrize("shares", SHARES.values(), ids=SHARES)
def test_jacobian_against_differences(shares):
    problem, angles, start, slip = motion(shares)
    exact = angles.jacobian(**angles.arguments(problem, start, 500.0, slip))["jacobian"]
    exact = np.asarray(exact.full())
    step = steps(angles, start, slip)
    numeric = np.hstack(
        differences(angles.residual, "residual", angles, problem, start, slip, step)
    )
    assert np.all(np.isfinite(exact))
    for rows in kinds(angles, problem):
        for columns in range(len(start)):
            # A relative step of 1e-6 errs by its square, round-off by some 1e-16 / 1e-6.
            size = np.abs(exact[rows] * step).max() / step[columns]
            np.testing.assert_allclose(
                exact[rows, columns], numeric[rows, columns], rtol=0, atol=1e-8 * size
            )


@pytest.mark.parametrize("shares", SHARES.values(), ids=SHARES)
def test_hessian_against_differences_of_the_jacobian(shares):
    problem, angles, start, slip = motion(shares)
    multipliers = np.random.default_rng(7).normal(size=len(start))
    named = angles.arguments(problem, start, 500.0, slip)
    exact = np.asarray(angles.hessian(**named, multipliers=multipliers)["hessian"].full())
    step = steps(angles, start, slip)
    numeric = np.column_stack(
        [
            multipliers @ column
            for column in differences(
                angles.jacobian, "jacobian", angles, problem, start, slip, step
            )
        ]
    )
    assert np.all(np.isfinite(exact))
    np.testing.assert_array_equal(exact, exact.T)
    # Every entry times both steps is a force: blocks of very different units become comparable.
    exact, numeric = exact * np.outer(step, step), numeric * np.outer(step, step)
    for rows in kinds(angles, problem):
        for columns in kinds(angles, problem):
            block = exact[rows, columns]
            # The accuracy asked for.
            atol = 1e-5 * np.abs(block).max()
            np.testing.assert_allclose(block, numeric[rows, columns], rtol=0, atol=atol)
    assert np.abs(exact).max() > 0


@pytest.mark.parametrize("harmonics", HARMONICS)
@pytest.mark.parametrize("shares", SHARES.values(), ids=SHARES)
def test_equations_agree_with_located_friction(shares, harmonics):
    """At the located angles: the balance of Eq. (9), and Eqs. (10) and (11) fulfilled."""
    problem, angles, start, slip = motion(shares, harmonics)
    unknowns = angles.split(start)[0]
    named = angles.arguments(problem, start, 500.0, slip)
    balance, turning, onset = angles.split(
        np.asarray(angles.residual(**named)["residual"].full())[:, 0]
    )
    exact = problem.evaluate(unknowns, 500.0)
    # Round-off.
    np.testing.assert_allclose(balance, exact.residual, rtol=0, atol=1e-13 * exact.magnitude)
    assert max(np.abs(turning).max(), np.abs(onset).max()) <= 1e-13 * exact.magnitude
    # There the force does not depend on the angles, so the derivative is the located one too.
    jacobian = np.asarray(angles.jacobian(**named)["jacobian"].full())
    n = problem.n_unknowns
    size = np.abs(exact.jacobian).max()
    np.testing.assert_allclose(jacobian[:n, :n], exact.jacobian, rtol=0, atol=1e-12 * size)
    travel = 1e5 * np.abs(problem.layout.relative(unknowns)).sum(axis=1).max()
    # The onset is located to about 1e-15 rad over the square root of the distance to its ends.
    assert np.abs(jacobian[:n, n:]).max() <= 1e-11 * travel


def test_one_harmonic_has_the_closed_form():
    problem, angles = study(fig03_single_blade, (1,))
    problem = problem.with_parameters(normal_load=1.0)
    omega = TURN * 16.3
    result = solve_angles(problem, omega, "newton")
    amplitude = np.linalg.norm(result.unknowns)
    share = 0.5 * 1.0 / (1e4 * amplitude)
    assert 0.01 < share < 0.9
    start, _ = angles.start(problem, result.unknowns)
    # Round-off, twice over the square root of the share.
    assert angles.split(start)[2] == pytest.approx(share, rel=1e-12)
    stick = (result.theta_star - result.theta_0) % TURN
    assert stick == pytest.approx(np.arccos(1 - 2 * share), rel=1e-12)
    phase = np.arctan2(result.unknowns[1], result.unknowns[0])
    assert turned(result.theta_0, phase) <= 1e-12


def false_start(problem):
    """Near a solution of Eqs. (4)-(11) whose theta_0 is on a smaller maximum of ``y``."""
    first, third, theta_0 = 1.67e-5 * np.exp(-0.727j), 2.74e-4 * np.exp(-4.27j), 0.096
    blades = np.arange(13) * TURN / 13
    first, third = first * np.exp(-1j * blades), third * np.exp(-3j * blades)
    wave = np.column_stack([first.real, -first.imag, third.real, -third.imag])
    return np.concatenate([wave.ravel(), theta_0 + blades, np.full(13, 0.73)])


def test_false_solution_is_rejected():
    problem, _ = study(fig08_engine_orders, (1, 3))
    problem, omega = problem.with_parameters(normal_load=10), TURN * 69
    start = false_start(problem)
    for solver in ("newton", "rootfinder"):
        result = solve_angles(problem, omega, solver, start=start)
        # The equations are solved, far from the located solution.
        assert result.difference > 1
        assert result.status == AngleStatus.FALSE_SOLUTION
        assert not result.converged
        assert not result.applies.any()
        assert np.all(np.isnan(result.unknowns))
    assert solve_angles(problem, omega, solver).converged


@pytest.mark.parametrize("harmonics", [(1,), (1, 3)])
def test_a_start_on_the_minimum_gives_no_false_solution(harmonics):
    problem, angles = study(fig08_engine_orders, harmonics)
    omega = TURN * 77
    located = solve_point(problem, omega)
    start, slip = angles.start(problem, located.unknowns)
    assert slip.all()
    unknowns, theta_0, rho = angles.split(start)
    theta_star = theta_0 + np.arccos(1 - 2 * rho)
    assert angles.applies(problem, unknowns, theta_0, theta_star).all()
    assert not angles.applies(problem, unknowns, theta_0 + np.pi, theta_star + np.pi).any()
    # A later onset exceeds the limit, a slip from the maximum on ends before the next extreme.
    assert not angles.applies(problem, unknowns, theta_0, theta_star + 0.1).any()
    on_minimum = np.concatenate([unknowns, theta_0 + np.pi, rho])
    for solver in SOLVERS:
        result = solve_angles(problem, omega, solver, located.unknowns, start=on_minimum)
        assert result.converged == (result.difference <= 1e-9)
        assert result.converged or np.all(np.isnan(result.unknowns))


def test_applies_tells_slip_from_stick():
    """A reversal during slip, one during stick, and a force beyond the limit."""
    problem, angles = structure(1, (1, 3))
    # Between its extremes 1.5 and -1.5, cos(t) + cos(3 t) / 2 turns at -0.0962 and at 0.0962:
    # the second reversal falls into stick where 2 g / k_d exceeds 1.5962.
    wave = np.array([1.0, 0.0, 0.5, 0.0])
    for limit, applies in ((0.71, False), (0.79, False), (0.81, True)):
        changed = problem.with_parameters(contact_stiffness=1.0, normal_load=limit / 0.5)
        start, slip = angles.start(changed, wave)
        assert slip.all()
        _, theta_0, rho = angles.split(start)
        theta_star = theta_0 + np.arccos(1 - 2 * rho)
        assert angles.applies(changed, wave, theta_0, theta_star).all() == applies
        assert reverses_while_slipping(changed, wave) != applies
        # Onset where y is at its level for the last time, the force beyond the limit before.
        last = brentq(lambda t, g=limit: problem.basis.values(t) @ wave - 1.5 + 2 * g, 1.9, np.pi)
        assert angles.applies(changed, wave, theta_0, np.array([last])).all() == applies


@pytest.mark.parametrize("solver", SOLVERS)
def test_special_contacts(solver):
    """No limit, no spring, no motion: regular, and the located solution."""
    problem, angles = structure(3, (1, 3))
    cases = [
        dict(normal_load=[0.0, 0.05, 1e3]),
        dict(contact_stiffness=[0.0, 1e5, 1e5], normal_load=0.05),
        dict(friction_coefficient=0.0),
        dict(engine_order=0),
    ]
    seen = set()
    for case in cases:
        changed, omega = problem.with_parameters(**case), TURN * 15
        located = solve_point(changed, omega)
        start, slip = angles.start(changed, located.unknowns)
        first = start.copy()
        first[: problem.n_unknowns] *= 1.01
        for some in (None, first):
            result = solve_angles(changed, omega, solver, start=some)
            assert result.converged, (case, result.status)
        named = angles.arguments(changed, start, omega, slip)
        for function in (angles.residual, angles.jacobian):
            assert np.all(np.isfinite(np.asarray(function(**named)[function.name_out(0)].full())))
        seen.add(tuple(slip.tolist()))
    assert (False, True, False) in seen
    assert (False, False, False) in seen


def test_one_object_serves_every_parameter_set():
    problem, angles = structure(3, (1, 3))
    other = problem.with_parameters(mass=1.1, normal_load=0.1, force_amplitude=2.0)
    fresh = sh.HarmonicBalance(other.model, other.excitation, (1, 3))
    omega = TURN * 15
    for solver in SOLVERS:
        shared = solve_angles(other, omega, solver)
        alone = solve_angles(fresh, omega, solver)
        assert shared.converged
        np.testing.assert_array_equal(shared.unknowns, alone.unknowns)
    start, slip = angles.start(other, alone.unknowns)
    with pytest.raises(ValueError, match="the one these equations were built from"):
        angles.arguments(fresh, start, omega, slip)


def test_names_of_inputs_and_outputs():
    problem, angles = structure(3, (1, 3))
    expected = [n for n in problem.residual.name_in() if n != "events_of_friction"] + ["slip"]
    assert angles.n_unknowns == problem.n_unknowns + 6
    for name in ("residual", "jacobian"):
        assert getattr(angles, name).name_in() == expected
        assert getattr(angles, name).name_out() == [name]
    assert angles.hessian.name_in() == [*expected, "multipliers"]
    assert set(expected) >= {"mass", "contact_stiffness", "friction_coefficient", "normal_load"}


def test_a_start_out_of_range_does_not_converge():
    problem, angles = structure(1, (1, 3))
    problem, omega = problem.with_parameters(normal_load=0.1), TURN * 15
    located = solve_point(problem, omega).unknowns
    start, slip = angles.start(problem, located)
    assert slip.all()
    start[-1] = 1.5
    for solver in ("newton", "rootfinder"):
        result = solve_angles(problem, omega, solver, located, start=start)
        assert result.status == AngleStatus.NO_CONVERGENCE
        assert np.isnan(result.difference)


def test_a_point_that_is_no_solution_is_no_reference():
    problem, _ = structure(1, (1, 3))
    result = solve_angles(problem, 90.0, "newton", np.full(4, 1e-3))
    assert result.status == AngleStatus.NOT_LOCATED
    assert not result.converged


@pytest.mark.parametrize("harmonics", [(0, 1), (1, 2), (1, 2, 3)])
def test_harmonics_must_be_odd(harmonics):
    problem = fig03_single_blade.problem(harmonics)
    with pytest.raises(ValueError, match="odd harmonics only") as error:
        SwitchingAngles(problem)
    assert str([n for n in harmonics if n % 2 == 0]) in str(error.value)


def test_bad_arguments():
    problem, _ = structure(1, (1, 3))
    with pytest.raises(ValueError, match="'broyden': expected one of newton, rootfinder, ipopt"):
        solve_angles(problem, 90.0, "broyden")
    with pytest.raises(ValueError, match="frequency=-1"):
        solve_angles(problem, -1, "newton")
    with pytest.raises(ValueError, match="located_unknowns: expected shape"):
        solve_angles(problem, 90.0, "newton", np.zeros(3))
    with pytest.raises(ValueError, match="start: expected shape"):
        solve_angles(problem, 90.0, "newton", start=np.zeros(4))
    with pytest.raises(ValueError, match="start="):
        solve_angles(problem, 90.0, "newton", start=np.full(6, np.nan))


def test_angles_beside_a_contact_that_sticks():
    """Of one contact that slips, ``1 - cos(theta_star - theta_0) = 2 mu F_n / (k_d A)``."""
    model = sh.Model(np.eye(2), np.eye(2), 1e4 * np.eye(2), contacts=[(0,), (1,)],
                     **rub(1e5, 0.5, [1.0, 50.0]))  # fmt: skip
    problem = sh.HarmonicBalance(model, sh.forces.PointForce(), (1,))
    motion = np.array([3e-5 * np.exp(0.4j), 2e-5j])
    unknowns = np.stack([motion.real, -motion.imag], axis=1).ravel()
    theta_0, theta_star = slip_angles(problem, unknowns, np.array([True, False]))
    assert 1 - np.cos(theta_star[0] - theta_0[0]) == pytest.approx(2 * 0.5 / (1e5 * 3e-5))
    assert np.isnan([theta_0[1], theta_star[1]]).all()
