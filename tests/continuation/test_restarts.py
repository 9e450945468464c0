"""Paths that end within the band: what is beyond is followed, what is between is told."""

from typing import ClassVar

import casadi as ca
import numpy as np
import pytest

import symhbm as sh

STEP = 19.1
"""Frequency [Hz] at which the stop of `problem` changes, so that no path leads across."""


class TwoStops(sh.laws.PolynomialLaw):
    """A cubic spring that is another one above a frequency."""

    directions = ("tangential",)
    parameters: ClassVar = {
        "stop_stiffness": sh.laws.Parameter("N m-3", "stiffness of the stop", "$a$")
    }
    degree = 3

    def force_at(self, displacement, frequency, values):
        factor = ca.if_else(frequency > 2 * np.pi * STEP, 20.0, 1.0)
        return factor * values["stop_stiffness"] * displacement**3


def problem():
    stop = sh.Contacts(TwoStops(), [(0,)], stop_stiffness=1e8)
    masses, stiffness = np.eye(2), [[1.5e4, -5e3], [-5e3, 2.5e4]]
    model = sh.Model(masses, 4 * masses, stiffness, contacts={"stop": stop})
    return sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=3.0), (1,))


def followed(*args, **options):
    with pytest.warns(RuntimeWarning, match="begins anew beyond") as told:
        result = sh.frf(*args, **options)
    return result, str(told[0].message)


def test_a_path_begins_anew_beyond_its_end():
    curve, _ = followed(problem(), (15, 28))
    assert curve.status == sh.Status.INTERRUPTED
    values, solved = curve.frequency.values, curve.converged.values
    assert (values[0], values[-1]) == (15, 28)
    (gap,) = np.flatnonzero(~solved)
    assert np.isnan(curve.amplitude.values[gap]).all()
    assert values[gap - 1 : gap + 2] == pytest.approx(STEP, abs=1e-6)
    assert curve.residual_norm.values[solved].max() < 1e-11
    beyond = sh.frf(problem(), (STEP + 0.1, 28), throw=True)
    np.testing.assert_allclose(curve.peak_frequency, beyond.peak_frequency, rtol=1e-9)


def test_values_of_a_grid_are_solved_beyond_an_end():
    at = [16.0, STEP - 1e-3, STEP + 0.1, 22.0, 27.0]
    grid, _ = followed(problem(), (15, 28), at)
    assert (grid.n_solutions > 0).all()
    assert grid.residual_norm.values[:, 0].max() < 1e-11
    path, _ = followed(problem(), (15, 28))
    beyond = path.isel(point=path.frequency.values > STEP + 1)
    assert grid.sel(frequency=[22.0, 27.0]).amplitude.max() <= beyond.amplitude.max()


@pytest.mark.slow
def test_more_harmonics_on_both_sides():
    curve, _ = followed(problem(), (15, 28), accuracy=1e-4)
    assert curve.highest_harmonic.max() >= 3
    assert (~curve.converged.values).sum() == 1
    assert np.nanmax(curve.truncation_error) <= 1e-4
    assert curve.status == sh.Status.INTERRUPTED


def test_a_warning_names_the_curves_of_a_sweep():
    _, text = followed(problem(), (15, 28), over={"force_amplitude": [0.1, 3.0]})
    assert text.startswith("1 of 2 curves are incomplete")
    assert "those of force_amplitude=3.0" in text
    assert "more harmonics if contacts lift off" in text


def pressed_lightly():
    """Planar friction that lifts off; its slip begins with two folds very close to each other."""
    stiffness = [
        [22340, 1300, 3500, -20],
        [1300, 24110, 4240, 4370],
        [3500, 4240, 30500, 3100],
        [-20, 4370, 3100, 32280],
    ]
    pad = sh.Friction(
        tangential=(0,), across=(1,), normal=(2,), contact_stiffness=3120, normal_stiffness=4990,
        friction_coefficient=0.43, normal_load=1.2,
    )  # fmt: skip
    damping = [
        [1.2, 0.03, 0.09, 0],
        [0.03, 1.24, 0.1, 0.1],
        [0.09, 0.1, 1.4, 0.07],
        [0, 0.1, 0.07, 1.44],
    ]
    model = sh.Model(np.eye(4), damping, stiffness, contacts={"pad": pad})
    force = sh.forces.HarmonicForce(
        cosine={1: [0.389, 0.432, 0.2, -0.477]}, sine={1: [-0.417, -0.319, 0.086, -0.228]}
    )
    return sh.HarmonicBalance(model, force, (0, 1))


@pytest.mark.slow
def test_a_light_preload_is_passed_from_both_sides():
    problem, at = pressed_lightly(), [30.5, 31.5, 32.5, 33.0]
    curves = [sh.frf(problem, band, at, throw=True) for band in ((30, 34), (34, 30))]
    alone = [sh.solve(problem, value, throw=True).amplitude for value in at]
    for curve in curves:
        assert curve.status == sh.Status.REACHED_END
        np.testing.assert_allclose(curve.amplitude[:, 0], alone, rtol=1e-8)
        np.testing.assert_allclose(curve.peak_frequency, curves[0].peak_frequency, rtol=1e-8)
