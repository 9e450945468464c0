"""Exact motions, multipliers and Hill's method with forces of velocities and of any expression."""

import casadi as ca
import numpy as np
import pytest

import symhbm as sh
from symhbm.numerics import RADIANS, unknowns_of
from symhbm.time_domain.motion import shoot
from symhbm.time_domain.perturbations import multipliers
from tests.quick import quick_first

ALL, ODD = tuple(range(30)), tuple(range(1, 30, 2))
GAP = {"k": (3e4, "N/m"), "g": (3e-4, "m")}
LAWS = {
    "dashpot": (lambda y, v, p: p["c"] * v, {"c": (3, "N s/m")}, (), ODD, 1e-10),
    "spring": (lambda y, v, p: p["k5"] * y**5, {"k5": (1e13, "N/m^5")}, (), ODD, 1e-10),
    "rounded": (
        lambda y, v, p: p["F"] * ca.tanh(v / p["e"]),
        {"F": (3, "N"), "e": (0.1, "m/s")},
        (),
        ODD,
        1e-9,
    ),
    "drag": (
        lambda y, v, p: p["c"] * v * ca.fabs(v),
        {"c": (3, "N s2 m-2")},
        lambda y, v, p: v,
        ODD,
        1e-7,
    ),
    "magnet": (
        lambda y, v, p: -p["b"] / (p["g"] - y) ** 2,
        {"b": (1e-3, "N m2"), "g": (2e-2, "m")},
        (),
        ALL[:16],
        1e-10,
    ),
    "gap": (
        lambda y, v, p: p["k"] * ca.fmax(y - p["g"], 0),
        GAP,
        lambda y, v, p: y - p["g"],
        ALL,
        1e-5,
    ),
}


def problem_of(name, harmonics=None, **others):
    expression, parameters, breakpoints, orders, _ = LAWS[name]
    own = sh.laws.SmoothLaw(expression, parameters, [(0, 1)], breakpoints)
    stiffness = [[1e4, -1e3], [-1e3, 2e4]]
    contacts = {"own": own, **others}
    model = sh.Model(np.eye(2), np.diag([2.0, 3.0]), stiffness, contacts=contacts)
    return sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=2.0), harmonics or orders)


def unknowns_at(problem, response):
    coefficient = response.coefficient.transpose("dof", "harmonic", "component").values
    return unknowns_of(problem.basis, problem.harmonics, coefficient)


@pytest.mark.parametrize("name", quick_first(LAWS, 3))
def test_the_exact_motion_is_that_of_many_harmonics(name):
    """By shooting; its multipliers are the exponents of Hill's method and those of Floquet."""
    problem, precision = problem_of(name), LAWS[name][-1]
    point = sh.solve(problem, 15.0, stability=True)
    motion = sh.periodic_motion(problem, 15.0, start=point)
    assert bool(motion.converged)
    np.testing.assert_allclose(motion.amplitude, point.amplitude, rtol=precision)
    lost = float(motion.viscous_dissipation) + motion.dissipation.values.sum()
    assert lost == pytest.approx(float(motion.work), rel=1e-10)
    np.testing.assert_allclose(
        motion.dissipation, point.dissipation, rtol=10 * precision, atol=1e-12
    )
    rates = np.log(np.hypot(motion.multiplier_real, motion.multiplier_imag).max()) * 15.0
    assert float(point.growth_rate) == pytest.approx(float(rates), rel=10 * precision)
    found = multipliers(problem, RADIANS * 15.0, unknowns_at(problem, point))
    expected = motion.multiplier_real.values + 1j * motion.multiplier_imag.values
    distance = np.abs(found[:, None] - expected).min(axis=1)
    assert distance.max() < max(30 * precision, 1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("name", quick_first(["rounded", "spring", "gap"], 1))
def test_multipliers_beside_friction_that_slips(name):
    """From event to event of a contact that slips, against the derivative of the exact motion."""
    rub = sh.Contacts(
        sh.laws.Coulomb(), [(1,)], contact_stiffness=5e3, friction_coefficient=0.3, normal_load=1.0
    )
    cube = sh.Contacts(sh.laws.CubicSpring(), [(0,)], cubic_stiffness=1e9)
    harmonics = ALL[:20] if name == "gap" else ODD
    problem = problem_of(name, harmonics, rub=rub, cube=cube)
    point = sh.solve(problem, 17.0, stability=True)
    assert point.contact_state.values.tolist() == [-1, 1, -1]
    unknowns = unknowns_at(problem, point)
    motion = shoot(problem, unknowns, RADIANS * 17.0)
    assert motion.converged
    found = multipliers(problem, RADIANS * 17.0, unknowns)
    precision = {"gap": 2e-3}.get(name, 1e-4)
    distance = np.abs(found[:, None] - motion.multipliers).min(axis=1)
    assert distance.max() < precision
    assert float(point.growth_rate) == pytest.approx(np.log(abs(found[0])) * 17.0, rel=1e-9)


def test_a_negative_dashpot_is_unstable():
    """Of a velocity, which displacements do not show: the motion at rest grows."""
    contacts = {"own": sh.laws.SmoothLaw(lambda y, v, p: p["c"] * v, {"c": (-3, "N s/m")}, [(0,)])}
    model = sh.Model([[1]], [[2]], [[1e4]], contacts=contacts)
    point = sh.solve(sh.HarmonicBalance(model, sh.forces.PointForce()), 10.0, stability=True)
    assert float(point.growth_rate) == pytest.approx(0.5, rel=1e-9)
    assert int(point.stability) == 0


def test_a_rounded_motor_starts_to_grow_where_it_should():
    """Van der Pol's oscillator beside its forced response, against the damping in the mean."""
    group = sh.laws.SmoothLaw(
        lambda y, v, p: p["c"] * (y**2 / p["a"] ** 2 - 1) * v,
        {"c": (1.0, "N s/m"), "a": (1e-3, "m")},
        [(0,)],
    )
    model = sh.Model([[1]], [[0.2]], [[1e4]], contacts={"own": group})
    problem = sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=30.0), ODD[:6])
    point = sh.solve(problem, 40.0, stability=True)
    motion = sh.periodic_motion(problem, 40.0, start=point)
    rate = np.log(np.hypot(motion.multiplier_real, motion.multiplier_imag).max()) * 40.0
    assert float(point.growth_rate) == pytest.approx(float(rate), rel=1e-6)
    # Small motions beside y are damped by c (mean of y^2 / a^2 - 1).
    amplitude = float(point.amplitude[0])
    assert float(rate) == pytest.approx(-(0.2 + amplitude**2 / 2e-6 - 1) / 2, rel=0.05)


@pytest.mark.slow
def test_kinks_without_break_points_keep_the_tolerance():
    problem = problem_of("gap")
    expression, parameters, *_ = LAWS["gap"]
    plain = sh.laws.SmoothLaw(expression, parameters, [(0, 1)])
    stiffness = [[1e4, -1e3], [-1e3, 2e4]]
    model = sh.Model(np.eye(2), np.diag([2.0, 3.0]), stiffness, contacts={"own": plain})
    other = sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=2.0), (0, 1, 2, 3, 4, 5))
    start = sh.solve(problem, 15.0)
    one, two = (sh.periodic_motion(p, 15.0, start=start) for p in (problem, other))
    assert bool(two.converged)
    np.testing.assert_allclose(one.amplitude, two.amplitude, rtol=1e-10)
