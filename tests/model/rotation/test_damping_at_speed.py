"""Damping by a rule of what turns: with Coriolis forces, of the stiffness at the speed.

Against the whole ring, whose damping matrix SciPy's modes make.
"""

import numpy as np
import pytest
import scipy.linalg

import symhbm as sh

N, SPEED, OMEGA = 7, 3000.0, 2 * np.pi * 3000 / 60
MASS = np.diag([1.0, 0.6, 0])
AT_REST = np.array([[9e4, -2e4, -3e4], [-2e4, 6e4, 0], [-3e4, 0, 3e4]])
STIFFENING = np.diag([0.4, 0.8, 0])
SKEW = np.array([[0, 0.9, 0], [-0.9, 0, 0], [0, 0, 0]])
RULES = [
    sh.ModalDamping(0.02),
    sh.RayleighDamping(2.0, 3e-5),
    sh.StructuralDamping(0.03),
    np.diag([3.0, 2.0, 0]),
]
FORCE = sh.forces.EngineOrder(2, pattern={1: 2.0, 0: 1j})


def disk(rule, **friction):
    runs = {speed: AT_REST + (2 * np.pi * speed / 60) ** 2 * STIFFENING for speed in (0, 1000)}
    rotor = sh.RotatingModel(sh.Model(MASS, rule, AT_REST), runs, coriolis=SKEW)
    sector = sh.Sector(rotor, [0], [2], N)
    if not friction:
        return sector
    given = dict(contact_stiffness=2e4, friction_coefficient=0.5, normal_load=1.0)
    shroud = sh.Friction(tangential=(1, sh.next_sector(1)), **given | friction)
    return sector.with_contacts(shroud=shroud)


def around(matrix, factors=(1.0,) * N):
    """A matrix of a sector, assembled over the ring; the third of a sector is the next's first."""
    result = np.zeros((2 * N, 2 * N))
    for j in range(N):
        own = [2 * j, 2 * j + 1, 2 * (j + 1) % (2 * N)]
        result[np.ix_(own, own)] += factors[j] * matrix
    return result


def whole_response(rule, frequency, speed=SPEED):
    """Largest displacements of the first sector, by the ring's matrices."""
    turning = 2 * np.pi * speed / 60
    mass, stiffness = around(MASS), around(AT_REST + turning**2 * STIFFENING)
    dynamic = stiffness.astype(complex)
    if isinstance(rule, sh.StructuralDamping):
        dynamic = (1 + 1j * rule.loss_factor) * dynamic
        damping = 0 * mass
    elif isinstance(rule, sh.RayleighDamping):
        damping = rule.mass * mass + rule.stiffness * stiffness
    elif isinstance(rule, sh.ModalDamping):
        squares, shapes = scipy.linalg.eigh(stiffness, mass)
        momentum = mass @ shapes
        damping = momentum @ np.diag(2 * rule.ratio * np.sqrt(squares)) @ momentum.T
    else:
        damping = around(rule)
    omega = 2 * np.pi * frequency
    damping = damping + turning * around(SKEW)
    lags = np.exp(-2j * np.pi * 2 * np.arange(N) / N)
    force = np.kron(lags, [1j, 2.0])
    return np.abs(np.linalg.solve(dynamic + 1j * omega * damping - omega**2 * mass, force))[:2]


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: type(rule).__name__)
def test_sector_at_a_speed_is_the_ring(rule):
    sector = disk(rule).at(SPEED)
    for frequency in (15.7, 44.0, 60.0, 163.0):
        exact = whole_response(rule, frequency)
        found = sh.solve(sh.HarmonicBalance(sector, FORCE), frequency).amplitude.values
        np.testing.assert_allclose(found, exact, rtol=1e-11)
    ring = sh.mistuned_ring(sector)
    found = sh.solve(sh.HarmonicBalance(ring, FORCE), 60.0).amplitude.values
    np.testing.assert_allclose(found[:2], whole_response(rule, 60.0), rtol=1e-11)


@pytest.mark.parametrize("rule", RULES[1:], ids=lambda rule: type(rule).__name__)
def test_along_an_engine_order_damping_is_that_of_the_speed(rule):
    along = sh.HarmonicBalance(disk(rule), FORCE)
    for frequency in (20.0, 60.0):
        exact = whole_response(rule, frequency, speed=60 * frequency / 2)
        np.testing.assert_allclose(sh.solve(along, frequency).amplitude, exact, rtol=1e-11)


def test_modal_damping_along_an_engine_order_is_refused():
    with pytest.raises(ValueError, match="follows the speed along an engine order"):
        sh.HarmonicBalance(disk(RULES[0]), FORCE)


@pytest.mark.parametrize("rule", RULES[:2], ids=lambda rule: type(rule).__name__)
def test_reduced_structures_at_a_speed_keep_coriolis_forces(rule):
    n = 8
    springs = 2e4 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)) + 5e3 * np.eye(n)
    skew = np.zeros((n, n))
    skew[2, 3], skew[3, 2] = 0.5, -0.5
    model = sh.Model(np.eye(n), rule, springs)
    rotor = sh.RotatingModel(model, {0: springs, 900: springs + 3e3 * np.eye(n)}, skew).at(700)
    small = sh.craig_bampton(rotor, n - 1, (5, 60), places=[0])
    force = sh.forces.PointForce(0)
    for frequency in (12.0, 20.0):
        exact = sh.solve(sh.HarmonicBalance(rotor, force), frequency).amplitude.values[0]
        found = sh.solve(sh.HarmonicBalance(small, force), frequency).amplitude.values[0]
        np.testing.assert_allclose(found, exact, rtol=1e-9)


def test_loads_at_a_speed_are_those_of_the_speed():
    """Whatever the frequency of the excitation, and at rest."""
    load = 1.0 + 2e-5 * OMEGA**2
    turning = disk(RULES[3], centrifugal_load=2e-5, engine_order=2).at(SPEED)
    constant = disk(RULES[3], normal_load=load).at(SPEED)
    for frequency in (15.0, 44.0):
        found, expected = (
            sh.solve(sh.HarmonicBalance(each, FORCE), frequency).amplitude.values
            for each in (turning, constant)
        )
        np.testing.assert_allclose(found, expected, rtol=1e-12)
    stop = sh.Gap(
        normal=(0,), normal_stiffness=1e4, gap=1e-3, centrifugal_load=1e-3, engine_order=3
    )
    runs = {0: [[1e4]], 300: [[1.1e4]]}
    rotor = sh.RotatingModel(sh.Model([[1.0]], [[1.0]], [[1e4]]), runs).at(600)
    push = sh.forces.PointForce() + sh.forces.StaticLoad([30.0])
    pressed = sh.HarmonicBalance(rotor.with_contacts(stop=stop), push, (0, 1))
    load = 1e-3 * (2 * np.pi * 10) ** 2 - 1e4 * 1e-3  # -6.05 N: a gap of 0.6 mm is left
    rest = sh.static_states(pressed).static_displacement.item()
    assert rest == pytest.approx((30.0 - load) / (1.4e4 + 1e4), rel=1e-12)


def test_loss_factor_is_of_the_tuned_stiffness_without_air():
    push = {-1: 800 - 20j, 0: 2000 + 60j, 1: -500 + 10j}
    sector = disk(RULES[2]).at(SPEED).with_influences(sh.Influence({1: 1.0}, push, 40.0))
    deviation = 0.05 * np.sin(np.arange(N))
    one = AT_REST + OMEGA**2 * STIFFENING
    stiffness = around(one, 1 + deviation)
    air = np.zeros((2 * N, 2 * N), complex)
    for distance, value in push.items():
        for j in range(N):
            air[2 * j + 1, 2 * ((j + distance) % N) + 1] += value
    omega = 2 * np.pi * 40.0
    lags = np.exp(-2j * np.pi * 2 * np.arange(N) / N)
    dynamic = stiffness + 0.03j * around(one) + air - omega**2 * around(MASS)
    dynamic = dynamic + 1j * omega * OMEGA * around(SKEW)
    exact = np.abs(np.linalg.solve(dynamic, np.kron(lags, [1j, 2.0])))
    ring = sh.mistuned_ring(sector, stiffness_deviation=deviation)
    found = sh.solve(sh.HarmonicBalance(ring, FORCE), 40.0).amplitude.values
    np.testing.assert_allclose(found, exact, rtol=1e-11)
