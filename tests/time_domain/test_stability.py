"""Stability: Hill's exponents against closed forms and integrated motions, friction beside them."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.time_domain.stability import NEUTRAL, verdict
from tests.pressed_contact import shroud
from tests.problems import duffing, one_blade, problem

TURN = 2 * np.pi
UPPER_FOLD = 1.26753695951261
"""Of the Duffing oscillator below with one harmonic [rad/s], from its closed form."""


def check_folds(curve):
    """Unstable between the two folds, stable elsewhere; at the folds themselves it is not known.

    There the exponent is zero to round-off. Returns where the folds are.
    """
    at = curve.event_frequency.values[curve.event_kind.values == "fold"]
    folds = [int(np.flatnonzero(curve.frequency == f)[0]) for f in at]
    assert len(folds) == 2
    expected = np.ones(curve.sizes["point"], dtype=int)
    expected[folds[0] + 1 : folds[1]] = 0
    others = np.delete(np.arange(len(expected)), folds)
    assert curve.stability.values[others].tolist() == expected[others].tolist()
    return folds


@pytest.mark.parametrize("band", [(0.5, 2.0), (2.0, 0.5)])
def test_the_branch_between_the_folds_is_unstable(band):
    curve = sh.frf(duffing(), (band[0] / TURN, band[1] / TURN), throw=True)
    folds = check_folds(curve)
    # Zero: the folds are solved to 1e-12, and the exponent goes with the root of the distance.
    assert np.all(np.abs(curve.growth_rate.values[folds]) < 1e-5)


def test_what_is_neither_kept_nor_asked_for_is_not_computed(monkeypatch):
    """By default responses that may be several tell which are stable."""
    band, at = (0.5 / TURN, 2 / TURN), [1.2 / TURN]
    whole, point = sh.frf(duffing(), band, at=at), sh.solve(duffing(), at[0])
    assert sh.frf(duffing(), band, at=at, keep=["stability"]).stability.identical(whole.stability)
    assert "stability" in point
    monkeypatch.setattr("symhbm.response.describe.growth", None)
    without = sh.frf(duffing(), band, at=at, keep=["amplitude"])
    assert "growth_rate" in without.attrs["left_out"]
    untold = sh.frf(duffing(), band, at=at, stability=False)
    alone = sh.solve(duffing(), at[0], stability=False)
    for one, other in ((without, whole), (untold, whole), (alone, point)):
        assert not {"growth_rate", "stability"} & {*one.variables}
        assert one.amplitude.identical(other.amplitude)


def fastest_growth(omega, amplitude):
    """Largest real part of the exponents of one harmonic beside a response of the Duffing one.

    ``x = p(t) cos(omega t) + q(t) sin(omega t)`` with the phase turned so that ``q = 0``: small
    changes obey ``z'' + D z' + J z = 0``.
    """
    spring = 0.75 * 0.1 * amplitude**2
    stiffness = np.array(
        [[1 - omega**2 + 3 * spring, 0.05 * omega], [-0.05 * omega, 1 - omega**2 + spring]]
    )
    damping = 0.05 * np.eye(2) + 2 * omega * np.array([[0, 1], [-1, 0]])
    state = np.block([[np.zeros((2, 2)), np.eye(2)], [-stiffness, -damping]])
    exponents = np.linalg.eigvals(state)
    return exponents[np.abs(exponents.imag) < 1].real.max()


@pytest.mark.parametrize("distance", [1e-2, 1e-4, 1e-6, 1e-8])
def test_slow_growth_is_unstable(distance):
    """Next to a fold growth vanishes with the root of the distance; its sign stays what it is."""
    omega = UPPER_FOLD * (1 - distance)
    # All solutions: [(1 - omega^2 + 3/4 gamma a^2)^2 + (c omega)^2] a^2 = f^2, cubic in a^2.
    spring, detuning = 0.075, 1 - omega**2
    square = np.roots(
        [spring**2, 2 * spring * detuning, detuning**2 + (0.05 * omega) ** 2, -(0.18**2)]
    )
    assert np.isreal(square).all()
    amplitude = np.sort(np.sqrt(square.real))
    grid = sh.frf(duffing(), (0.5 / TURN, 2 / TURN), at=[omega / TURN]).isel(frequency=0)
    order = np.argsort(grid.amplitude.values.ravel())
    # Two roots that nearly meet have the root of all digits.
    np.testing.assert_allclose(grid.amplitude.values.ravel()[order], amplitude, rtol=1e-7)
    expected = np.array([fastest_growth(omega, a) for a in amplitude])
    assert (expected > 0).tolist() == [False, True, False]
    assert expected[1] < np.sqrt(distance)
    found = grid.growth_rate.values[order]
    np.testing.assert_allclose(found, expected, rtol=1e-4)
    assert grid.stability.values[order].tolist() == [1, 0, 1]


@pytest.mark.parametrize("frequency", [1e-3, 1.0, 1e4])
def test_neutral_motions_are_unknown(frequency):
    """Only what round-off leaves of no growth at all is not known."""
    for share in (1.01 * NEUTRAL, 1e-6, 1e-3, 1.0):
        assert verdict(share * frequency, frequency) == 0
        assert verdict(-share * frequency, frequency) == 1
    for share in (0.0, 0.99 * NEUTRAL, -0.99 * NEUTRAL, np.nan):
        assert verdict(share * frequency, frequency) == -1


def test_linear_oscillator_has_its_decay_rate():
    point = sh.solve(sh.HarmonicBalance(duffing().model, sh.forces.PointForce(amplitude=1e-9)), 0.3)
    # -c / (2 m); the cube of a motion of a nanometre is nothing.
    assert float(point.growth_rate) == pytest.approx(-0.025, rel=1e-9)
    assert int(point.stability) == 1


def test_singular_mass_is_unknown():
    model = sh.Model(np.ones((2, 2)), np.eye(2), np.eye(2), contacts=[(0,)], cubic_stiffness=0.4)
    point = sh.solve(
        sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=0.1)), 0.1, throw=True
    )
    assert np.isnan(point.growth_rate)
    assert int(point.stability) == -1


def test_too_stiff_is_unknown():
    problem = duffing().with_parameters(
        contact_stiffness=1e15, friction_coefficient=0.5, normal_load=0.01
    )
    point = sh.solve(problem, 0.2, throw=True)
    assert int(point.contact_state[0]) == 1
    assert int(point.stability) == -1


def test_friction_responses_are_stable_where_it_is_asked():
    """Unique responses are stable; the rate is that of the exact motion's largest multiplier."""
    blade = one_blade()
    problem = sh.HarmonicBalance(blade, sh.forces.PointForce(amplitude=1.0), (1, 3, 5))
    curve = sh.frf(problem, (15, 25), stability=True)
    assert curve.stability.values.tolist() == [1] * curve.sizes["point"]
    middle = curve.isel(point=curve.sizes["point"] // 2)
    assert middle.contact_state.values == [1]
    motion = sh.periodic_motion(problem, float(middle.frequency))
    largest = np.hypot(motion.multiplier_real, motion.multiplier_imag).max()
    rate = np.log(float(largest)) * float(middle.frequency)
    # Truncation of the motion moves the events it is judged by.
    assert float(middle.growth_rate) == pytest.approx(rate, rel=1e-2)
    assert float(sh.solve(problem, 20.0, stability=True).growth_rate) < 0
    assert "stability" not in sh.frf(problem, (15, 25))
    assert "stability" not in sh.solve(problem, 20.0)


def test_instability_beside_odd_harmonics():
    """A symmetric motion that small unsymmetric ones leave, which its own harmonics cannot tell."""
    model = sh.Model([[1.0]], [[0.2]], [[1.0]], contacts=[(0,)], cubic_stiffness=1.0)
    problem = sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=6.0), (1, 3, 5, 7, 9))
    point = sh.solve(problem, 1 / TURN)
    motion = sh.periodic_motion(problem, 1 / TURN, start=point)
    largest = np.hypot(motion.multiplier_real, motion.multiplier_imag).max()
    # At one radian per second; five harmonics leave 3e-3 of the rate.
    rate = np.log(float(largest)) / TURN
    assert rate > 0.06
    assert float(point.growth_rate) == pytest.approx(rate, rel=1e-2)
    assert int(point.stability) == 0


OPENING = {
    "gap": sh.Gap(normal=(1,), normal_stiffness=2e4, gap=1e-3),
    "friction": shroud((1,), (2,), normal_load=2.0),
    "planar friction": shroud((1,), (2,), across=(3,), normal_load=2.0),
}


@pytest.mark.parametrize("name", OPENING)
def test_without_mass_responses_are_the_limit_of_small_masses_and_stability_is_unknown(name):
    stiffness = np.array(
        [[2e4, -1e4, -5e3, 0], [-1e4, 1.1e4, 0, 500], [-5e3, 0, 6e3, 0], [0, 500, 0, 8e3]]
    )

    def problem(mass):
        structure = np.diag([1, mass, mass, 1]), np.diag([2.0, 0, 0, 2]), stiffness
        model = sh.Model(*structure, contacts={"contact": OPENING[name]})
        force = sh.forces.HarmonicForce(cosine={1: [20.0, 0, 0, 5]})
        return sh.HarmonicBalance(model, force, (0, 1, 2, 3))

    at = np.linspace(14, 18, 9)
    without = sh.frf(problem(0.0), (14, 18), at=at, throw=True, progress=False)
    only = ["amplitude"]  # exponents of so small masses take minutes
    small = sh.frf(problem(1e-9), (14, 18), at=at, keep=only, throw=True, progress=False)
    assert without.open_fraction.values.max() > 0.01
    np.testing.assert_allclose(without.amplitude, small.amplitude, rtol=1e-6)
    assert np.all(without.stability == -1)
    assert np.all(np.isnan(without.growth_rate))
    assert sh.solve(problem(0.0), 15.0).converged.all()
    followed = sh.follow(
        problem(0.0), "force_amplitude", (0.5, 1), frequency=15.0, throw=True, progress=False
    )
    assert followed.force_amplitude[-1] == 1
    with pytest.raises(ValueError, match="frf, follow and solve take"):
        sh.periodic_motion(problem(0.0), 15.0)


HILL, BALANCED, EXACT = range(3)


@pytest.mark.parametrize(
    ("cell", "frequency", "methods"),
    [
        ("cubic blade point 1", 24.0, {HILL}),
        ("coulomb blade point 1", 24.0, {BALANCED}),
        ("varying blade static 0123", 17.0, {EXACT}),
        ("planar blade point 13", 17.0, {EXACT}),
    ],
)
def test_results_say_what_the_growth_rate_is_of(cell, frequency, methods):
    point = sh.solve(problem(cell), frequency, stability=True)
    assert {*point.stability_method.values.ravel().tolist()} == methods
    meanings = point.stability_method.attrs["flag_meanings"].split()
    assert meanings == ["unknown", "Hill", "balanced_motion", "exact_motion"]
