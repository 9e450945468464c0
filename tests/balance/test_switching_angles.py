"""Switching angles as unknowns: exact derivatives, three solvers, and only true solutions."""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

import symhbm as sh
from studies import fig03_single_blade, fig08_engine_orders
from symhbm.balance.switching_angles import SwitchingAngles, slip_angles
from symhbm.continuation.angles.one_point import AngleStatus, solve_angles
from symhbm.continuation.start import solve_point
from tests.problems import rub
from tests.refusals import refused

SOLVERS = ("newton", "rootfinder", "ipopt")
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


def turned(first, second):
    """Distance of two angles on the circle."""
    return np.abs((first - second + np.pi) % TURN - np.pi)


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
    problem, angles = study(fig08_engine_orders, harmonics)
    problem = problem.with_parameters(normal_load=10)
    for frequency, is_refused in ((64.5, False), (66.0, True)):
        located = solve_point(problem, TURN * frequency)
        assert np.all(located.evaluation.states.groups["friction"].details.reversals == 6)
        assert reverses_while_slipping(problem, located.unknowns) == is_refused
        result = solve_angles(problem, TURN * frequency, solver, located.unknowns, angles=angles)
        assert result.converged == (not is_refused)
        assert result.applies.all() == (not is_refused)
        assert (result.status == AngleStatus.DOES_NOT_APPLY) == is_refused
    assert "reverses while it slips" in result.status


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


def test_one_harmonic_has_the_closed_form():
    problem, angles = study(fig03_single_blade, (1,))
    problem = problem.with_parameters(normal_load=1.0)
    omega = TURN * 16.3
    result = solve_angles(problem, omega, "newton", angles=angles)
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


def test_a_start_out_of_range_does_not_converge():
    problem, angles = structure(1, (1, 3))
    problem, omega = problem.with_parameters(normal_load=0.1), TURN * 15
    located = solve_point(problem, omega).unknowns
    start, slip = angles.start(problem, located)
    assert slip.all()
    start[-1] = 1.5
    for solver in ("newton", "rootfinder"):
        result = solve_angles(problem, omega, solver, located, start=start, angles=angles)
        assert result.status == AngleStatus.NO_CONVERGENCE
        assert np.isnan(result.difference)


def test_a_point_that_is_no_solution_is_no_reference():
    problem, angles = structure(1, (1, 3))
    result = solve_angles(problem, 90.0, "newton", np.full(4, 1e-3), angles=angles)
    assert result.status == AngleStatus.NOT_LOCATED
    assert not result.converged


def asked(*given, **options):
    problem, angles = structure(1, (1, 3))
    return solve_angles(problem, *given, angles=angles, **options)


test_bad_arguments = refused([
    (lambda: asked(90.0, "broyden"),
     ValueError, "'broyden': expected one of newton, rootfinder, ipopt"),
    (lambda: asked(-1, "newton"), ValueError, "frequency=-1"),
    (lambda: asked(90.0, "newton", np.zeros(3)), ValueError, "located_unknowns: expected shape"),
    (lambda: asked(90.0, "newton", start=np.zeros(4)), ValueError, "start: expected shape"),
    (lambda: asked(90.0, "newton", start=np.full(6, np.nan)), ValueError, "start="),
    (lambda: solve_angles(structure(3, (1, 3))[0], 90.0, "newton", angles=structure(1, (1, 3))[1]),
     ValueError, "the one these equations were built from"),
])  # fmt: skip


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


def false_start(problem):
    """Near a solution of Eqs. (4)-(11) whose theta_0 is on a smaller maximum of ``y``."""
    first, third, theta_0 = 1.67e-5 * np.exp(-0.727j), 2.74e-4 * np.exp(-4.27j), 0.096
    blades = np.arange(13) * TURN / 13
    first, third = first * np.exp(-1j * blades), third * np.exp(-3j * blades)
    wave = np.column_stack([first.real, -first.imag, third.real, -third.imag])
    return np.concatenate([wave.ravel(), theta_0 + blades, np.full(13, 0.73)])


def test_false_solution_is_rejected():
    problem, angles = study(fig08_engine_orders, (1, 3))
    problem, omega = problem.with_parameters(normal_load=10), TURN * 69
    start = false_start(problem)
    for solver in ("newton", "rootfinder"):
        result = solve_angles(problem, omega, solver, start=start, angles=angles)
        # The equations are solved, far from the located solution.
        assert result.difference > 1
        assert result.status == AngleStatus.FALSE_SOLUTION
        assert not result.converged
        assert not result.applies.any()
        assert np.all(np.isnan(result.unknowns))
    assert solve_angles(problem, omega, solver, angles=angles).converged
