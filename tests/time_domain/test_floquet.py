"""Multipliers by the monodromy: exact motions, integrated small motions, closed forms, bounds."""

from functools import cache, partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import symhbm as sh
from symhbm.continuation.newton import newton
from symhbm.continuation.start import linear_response
from symhbm.model.contacts.coulomb.located import locate, stick_intervals
from symhbm.numerics.fourier import FourierBasis
from symhbm.time_domain.active_contacts import ActiveContacts
from symhbm.time_domain.exact_motion import exact_motion
from symhbm.time_domain.motion import shoot
from symhbm.time_domain.perturbations import curved, multipliers, sliders
from tests.problems import one_blade, ring_of_blades, rub

TURN = 2 * np.pi
ODD = tuple(range(1, 32, 2))
ALL = tuple(range(24))


def distance(left, right):
    """Largest distance of two sets of numbers, each to the nearest that is left."""
    assert len(left) == len(right)
    rest, result = list(right), 0.0
    for value in left:
        nearest = int(np.argmin(np.abs(np.array(rest) - value)))
        result = max(result, abs(rest.pop(nearest) - value))
    return result


def solution(problem, omega, start=None):
    start = linear_response(problem, omega) if start is None else start
    computed = newton(partial(problem.evaluate, frequency=omega), start)
    assert problem.evaluate(computed.unknowns, omega).norm < 1e-10
    return computed.unknowns


def ring(order, normal_load, harmonics=ODD):
    disk = ring_of_blades(13, contact_stiffness=1e6, normal_load=normal_load)
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(order, amplitude=1.0), harmonics)


def blade(harmonics=ODD, harmonic=1):
    model = one_blade(normal_load=1.5)
    return sh.HarmonicBalance(
        model, sh.forces.PointForce(amplitude=1.0, harmonic=harmonic), harmonics
    )


def mistuned(force, harmonics):
    rng = np.random.default_rng(5)
    disk = ring_of_blades(
        5,
        mass=rng.uniform(0.95, 1.05, 5),
        stiffness=rng.uniform(0.9e4, 1.1e4, 5),
        damping=rng.uniform(0.4, 0.6, 5),
        contact_stiffness=rng.uniform(1e4, 2e4, 5),
        normal_load=rng.uniform(0.5, 1.0, 5),
    )
    return sh.HarmonicBalance(disk, force, harmonics)


MEAN = sh.forces.HarmonicForce(
    cosine={0: [0.3, 0, 0, 0, 0], 1: [1, 0, 0, 0.5, 0], 2: [0, 1, 0, 0, 0]},
    sine={3: [0, 0, 0.2, 0, 0]},
)
CASES = {
    "blade": (blade, 15.0, 1e-5),
    "ring, six reversals": (partial(ring, 1, 10.0), 63.0, 3e-4),
    "ring, order 3": (partial(ring, 3, 100.0), 211.4, 2e-5),
    "mistuned": (partial(mistuned, sh.forces.PointForce(amplitude=3.0), ODD), 20.0, 2e-4),
    "mistuned, even harmonics": (partial(mistuned, MEAN, ALL), 19.0, 1e-4),
}
each_case = pytest.mark.parametrize("name", CASES)


@cache
def solved(name):
    build, hertz, _ = CASES[name]
    problem, omega = build(), TURN * hertz
    motion = exact_motion(problem, omega)
    assert motion.converged
    assert len(motion.event_angle)
    return problem, omega, motion


@each_case
def test_against_the_exact_motion(name):
    problem, omega, motion = solved(name)
    start = motion.coefficients(problem.harmonics)[0].ravel()
    computed = multipliers(problem, omega, solution(problem, omega, start))
    assert distance(computed, motion.multipliers) < CASES[name][2]
    assert np.all(np.diff(np.abs(computed)) <= 0)


@each_case
def test_events_of_the_exact_motion_leave_no_error(name, monkeypatch):
    problem, omega, motion = solved(name)

    def exact_intervals(*_):
        rows = []
        for contact in np.unique(motion.event_contact):
            mine = motion.event_contact == contact
            angle, sticks = motion.event_angle[mine], motion.event_kind[mine] == "stick"
            assert np.all(sticks != np.roll(sticks, 1))
            end = np.append(angle[1:], angle[0] + TURN)
            rows += [(contact, a, b) for a, b in zip(angle[sticks], end[sticks], strict=True)]
        return tuple(map(np.array, zip(*rows, strict=True)))

    monkeypatch.setattr(sliders, "stick_intervals", exact_intervals)
    computed = multipliers(problem, omega, np.zeros(problem.n_unknowns))
    assert distance(computed, motion.multipliers) < 1e-11


@settings(max_examples=50)
@given(
    coefficients=st.lists(st.floats(-1, 1), min_size=7, max_size=7), stiffness=st.floats(0.1, 100)
)
def test_intervals_are_those_of_the_located_force(coefficients, stiffness):
    basis = FourierBasis((0, 1, 2, 3))
    motion = np.round([coefficients], 3)
    law = basis, motion, np.array([stiffness]), np.array([1.0])
    friction = locate(*law)
    contact, begin, end = stick_intervals(*law)
    assert len(contact) == 0 or friction.slip[0]
    if not friction.slip[0] or friction.reversals[0] == 0:
        return
    assert (end - begin).sum() == pytest.approx(TURN * friction.stick_fraction[0], abs=1e-12)
    slope = basis.values(begin, 1) @ motion[0]
    assert np.abs(slope).max() < 1e-6
    assert np.all(begin[1:] >= end[:-1])
    # Every stick run crosses to the other limit, or comes back to its own.
    travel = stiffness * (basis.values(end) - basis.values(begin)) @ motion[0]
    assert np.minimum(np.abs(travel), np.abs(np.abs(travel) - 2)).max() < 1e-9


def several(harmonics):
    """Full matrices with a gyroscopic part, springs of both signs, a stuck contact."""
    rng = np.random.default_rng(1)
    spread, turn = rng.normal(size=(2, 4, 4))
    model = sh.Model(
        np.eye(4) + 0.1,
        0.05 * np.eye(4) + 0.02 * (turn - turn.T),
        2 * np.eye(4) + 0.3 * spread @ spread.T,
        contacts=[(0, 1), (1, 2), (3,)],
        cubic_stiffness=[0.5, -0.2, 1.0],
        **rub([0.0, 1.0, 0.0], 0.5, 100.0),
    )
    return sh.HarmonicBalance(
        model, sh.forces.HarmonicForce(cosine={1: [0.5, 0, 0.3, 0]}), harmonics
    )


@pytest.mark.parametrize("harmonics", [(1,), (1, 3, 5), (0, 1, 2, 3)])
def test_against_the_integrated_variation(harmonics):
    """Along any motion, a solution or not."""
    problem, omega = several(harmonics), 1.9
    unknowns = np.random.default_rng(2).normal(size=problem.n_unknowns) / len(harmonics)
    model, relative = problem.model, problem.layout.relative(unknowns)
    directions = model.directions.toarray()
    mass, damping, stiffness = (
        getattr(model, f"{name}_matrix").toarray() for name in ("mass", "damping", "stiffness")
    )

    def rate(t, state):
        y = relative @ problem.basis.values(omega * t)
        springs = model.contact_stiffness + 3 * model.cubic_stiffness * y**2
        x, v = np.split(state.reshape(8, 8), 2)
        pull = (stiffness + directions.T @ (springs[:, None] * directions)) @ x + damping @ v
        return np.concatenate([v, -np.linalg.solve(mass, pull)]).ravel()

    run = solve_ivp(rate, (0, TURN / omega), np.eye(8).ravel(), "DOP853", rtol=1e-11, atol=1e-12)
    computed = multipliers(problem, omega, unknowns)
    assert distance(computed, np.linalg.eigvals(run.y[:, -1].reshape(8, 8))) < 1e-9
    # Liouville: the determinant knows the damping alone.
    loss = np.trace(np.linalg.solve(mass, damping)) * TURN / omega
    assert np.prod(computed) == pytest.approx(np.exp(-loss), rel=1e-11)


def test_bounds_of_growth_are_those_of_all_springs():
    """Whether their contacts slip or stick."""
    problem = several((1, 3))
    given = problem, 1.9, np.full(problem.n_unknowns, 0.1), ActiveContacts(problem.model, 1.9)
    every = np.ones(len(given[-1].active), dtype=bool)
    slips, sticks = (curved._Perturbation(*given, slipped) for slipped in (every, ~every))
    np.testing.assert_allclose(slips.growth, sticks.growth, rtol=1e-12)


def test_friction_beside_a_cubic_spring_on_one_body():
    """Against the derivative of its exact motion."""
    contact = dict(contacts=[(0,)], cubic_stiffness=0.3, **rub(1.0, 0.5, 0.3))
    model, omega = sh.Model([[1.0]], [[0.05]], [[1.0]], **contact), 1.9
    problem = sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=0.3), tuple(range(1, 42, 2)))
    unknowns = solution(problem, omega)
    motion = shoot(problem, unknowns, omega)
    assert motion.converged
    assert distance(multipliers(problem, omega, unknowns), motion.multipliers) < 1e-5


@pytest.mark.parametrize(
    ("values", "stiffness"),
    [
        (dict(normal_load=1e6), 2e4),
        (dict(normal_load=0.0), 1e4),
        (dict(contact_stiffness=0.0), 1e4),
    ],
)
def test_stuck_contacts_are_springs_and_without_spring_or_limit_nothing(values, stiffness):
    problem, omega = blade((1,)).with_parameters(**values), 100.0
    expected = np.exp(np.roots([1, 0.5, stiffness]) * TURN / omega)
    computed = multipliers(problem, omega, solution(problem, omega))
    assert distance(computed, expected) < 1e-12


def test_impossible():
    springs = dict(contact_stiffness=1.0, friction_coefficient=0.0, normal_load=0.0)
    model = sh.Model([[1, 1], [1, 1]], np.eye(2), np.eye(2), contacts=[(0,)], **springs)
    with pytest.raises(np.linalg.LinAlgError):
        multipliers(sh.HarmonicBalance(model, sh.forces.PointForce()), 1.0, np.ones(4))
    stiff = several((1,)).with_parameters(contact_stiffness=1e14, normal_load=1e20)
    with pytest.raises(ArithmeticError, match="too stiff"):
        multipliers(stiff, 1.0, np.zeros(8))
    disk = ring_of_blades(600, contact_stiffness=1e6, normal_load=1.0)
    large = sh.HarmonicBalance(disk, sh.forces.EngineOrder(1), by_sector=False)
    with pytest.raises(ArithmeticError, match="too large"):
        multipliers(large, 1.0, np.zeros(large.n_unknowns))


def test_stiffness_leaves_the_digits():
    problem = blade((1,)).with_parameters(stiffness=1e14)
    computed = multipliers(problem, 1.0, np.zeros(2))
    assert np.abs(computed) == pytest.approx(np.exp(-0.25 * TURN), rel=1e-9)


def two_bodies(held):
    """Two bodies, of which one rubs; where nothing holds them 0 is a double eigenvalue."""
    model = sh.Model(
        np.eye(2),
        np.zeros((2, 2)),
        np.array([[1.0, -1.0], [-1.0, 1.0]]) + held * np.eye(2),
        contacts=[(0,)],
        **rub(1.0, 0.5, 1.0),
    )
    return sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=1.0), (1, 3))


def test_states_without_a_set_of_eigenvectors():
    """Against the same bodies held by springs too weak to matter."""
    problem, held, omega = two_bodies(0.0), two_bodies(1e-9), 0.8
    unknowns = np.array([2.0, 0.5, 0.1, 0.0, 1.0, -0.3, 0.0, 0.2])
    assert np.count_nonzero(problem.locate(unknowns, omega).switches) == 1
    values = [np.poly(multipliers(each, omega, unknowns)) for each in (problem, held)]
    assert values[0] == pytest.approx(values[1], abs=1e-6)


def test_modes_are_kept_within_a_bound(monkeypatch):
    """Each motion of a mistuned ring has states of its contacts that others do not have."""
    problem, omega, rng = mistuned(MEAN, ALL[:4]), TURN * 19, np.random.default_rng(6)
    motions = 2e-4 * rng.normal(size=(6, problem.n_unknowns))
    kept = sliders._known(problem.model)
    expected = [multipliers(problem, omega, motion) for motion in motions]
    (linear,) = kept.values()
    assert len(linear._modes) > 20
    monkeypatch.setattr(sliders, "_KEPT_NUMBERS", 10 * 500)
    linear._modes.clear()
    for motion, values in zip(motions, expected, strict=True):
        assert multipliers(problem, omega, motion).tolist() == values.tolist()
        assert len(linear._modes) <= 11
