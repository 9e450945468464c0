"""Nonlinear modes pass an internal resonance: by the other mode, and beyond zero amplitude."""

import numpy as np
import pytest
from scipy.optimize import fsolve

import symhbm as sh

HARMONICS = np.array([1, 3, 5])
CUBIC = 0.5
ANGLES = np.arange(64) * 2 * np.pi / 64
TURNED = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])


def stiffness(second):
    """Of two unit masses with natural frequencies of 1 and another one [rad/s]."""
    return TURNED @ np.diag([1.0, second**2]) @ TURNED.T


def modes(second, band, harmonics=(1, 3, 5), cubic=CUBIC, **options):
    spring = sh.Contacts(sh.laws.CubicSpring(), (0,), cubic_stiffness=cubic)
    model = sh.Model(np.eye(2), np.zeros((2, 2)), stiffness(second), contacts={"spring": spring})
    problem = sh.HarmonicBalance(model, harmonics=harmonics)
    return sh.nonlinear_modes(problem, band=band, place=0, progress=False, **options)


def independent(second, amplitude, guess):
    """Angular frequency of a motion in phase, its spring over samples, by a solver of SciPy."""
    waves = np.cos(np.outer(HARMONICS, ANGLES))

    def residual(unknowns):
        x, omega = np.array([amplitude, *unknowns[:-1]]).reshape(2, 3), unknowns[-1]
        spring = CUBIC * (x[0] @ waves) ** 3 @ waves.T * 2 / len(ANGLES)
        linear = stiffness(second) @ x - omega**2 * HARMONICS**2 * x
        return (linear + np.array([[1.0], [0.0]]) * spring).ravel()

    found, *_ = fsolve(residual, guess, xtol=1e-13, full_output=True)
    assert np.abs(residual(found)).max() < 1e-11
    return found[-1]


@pytest.fixture(scope="module")
def passed():
    return modes(3.2, (1e-3, 2.0))


def test_a_mode_passes_an_internal_resonance(passed):
    """The frequency of the independent balance at all points, on both sides and between."""
    assert passed.status.item() == sh.Status.REACHED_END
    assert passed.amplitude.values[-1] == pytest.approx(2.0)
    omega = 2 * np.pi * passed.frequency.values
    cosines = passed.coefficient.sel(component="cos").transpose("point", "dof", "harmonic").values
    assert abs(passed.coefficient.sel(component="sin")).max() < 1e-9
    for x, own in zip(cosines, omega, strict=True):
        guess = [*x.ravel()[1:], own * (1 + 1e-7)]
        assert independent(3.2, x[0, 0], guess) == pytest.approx(own, rel=1e-9)
    # Three times 1.067 is the second natural frequency: one side is below, the other beyond.
    assert omega[0] == pytest.approx(1, rel=1e-5)
    assert omega[-1] > 1.5


def test_it_goes_on_beyond_zero(passed):
    """Half a period later: the other mode moves alone, and its third harmonic changes its sign."""
    amplitude = passed.amplitude.values
    [joint] = np.flatnonzero((amplitude[1:] == amplitude[:-1]) & (amplitude[1:] < 1.01e-3))
    before, after = passed.isel(point=joint), passed.isel(point=joint + 1)
    assert before.frequency.item() == pytest.approx(after.frequency.item(), rel=1e-5)
    third = [
        of.coefficient.sel(harmonic=3, dof=1, component="cos").item() for of in (before, after)
    ]
    assert third[0] == pytest.approx(-third[1], rel=3e-3)
    assert abs(third[0]) > 1e3 * amplitude[joint]


def test_undamped_modes_have_no_points_of_round_off(passed):
    """Lines between points are as straight as damping asks for, and there is none."""
    assert abs(passed.damping_ratio).max() < 1e-11
    assert passed.sizes["point"] < 90


def test_a_resonance_of_an_even_order_returns_as_it_came():
    """The second harmonic of a spring with a mean: a delay by half a period makes it the same."""
    bent = {"square": (0.4, "N/m^2"), "cube": (0.5, "N/m^3")}
    stop = sh.laws.SmoothLaw(lambda y, v, p: p["square"] * y**2 + p["cube"] * y**3, bent, [(0,)])
    model = sh.Model(np.eye(2), np.zeros((2, 2)), stiffness(2.02), contacts={"stop": stop})
    problem = sh.HarmonicBalance(model, harmonics=(0, 1, 2))
    with pytest.warns(RuntimeWarning, match="turned back"):
        found = sh.nonlinear_modes(problem, band=(1e-3, 3.0), place=0, progress=False)
    assert found.status.item() == sh.Status.MODE_TURNED_BACK
    assert (found.amplitude.values == 1e-3).sum() == 2
