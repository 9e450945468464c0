"""Exact motions, multipliers and Hill's method with forces of velocities and of any expression."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.numerics import RADIANS, unknowns_of
from symhbm.time_domain.perturbations import multipliers
from tests.quick import quick_first
from tests.smooth_laws import group_of, problem_of

ALL, ODD = tuple(range(30)), tuple(range(1, 30, 2))
MANY = {
    "dashpot": (ODD, 1e-10), "spring": (ODD, 1e-10), "rounded": (ODD, 1e-9), "drag": (ODD, 1e-7),
    "magnet": (ALL[:16], 1e-10), "gap": (ALL, 1e-5),
}  # fmt: skip
"""Harmonics of responses that are close to exact motions, and how close."""


def unknowns_at(problem, response):
    coefficient = response.coefficient.transpose("dof", "harmonic", "component").values
    return unknowns_of(problem.basis, problem.harmonics, coefficient)


@pytest.mark.parametrize("name", quick_first(MANY, 3))
def test_the_exact_motion_is_that_of_many_harmonics(name):
    """By shooting; its multipliers are the exponents of Hill's method and those of Floquet."""
    orders, precision = MANY[name]
    problem = problem_of(group_of(name), orders)
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
