"""Measured points beside computed curves, on the same axes and in their colours."""

from typing import Any

import matplotlib.colors
import numpy as np
import pytest

import symhbm as sh
from tests.measurements import measured_responses
from tests.problems import one_blade, ring_of_blades

LEVELS, FREQUENCIES = [0.5, 2.0], [14.0, 17.0, 20.0]


@pytest.fixture(scope="module")
def problem():
    return sh.HarmonicBalance(one_blade(), sh.forces.PointForce())


@pytest.fixture(scope="module")
def curves(problem):
    return sh.frf(problem, (13, 21), over={"force_amplitude": LEVELS}, progress=False)


def circles(figure: Any) -> list[Any]:
    return [line for line in figure.axes[0].lines if str(line.get_markerfacecolor()) == "none"]


def test_points_lie_on_the_curve_of_their_level(problem, curves):
    data = measured_responses(problem, LEVELS, FREQUENCIES)
    figure = sh.plot.response(curves, measured=data, scale="linear", peaks=False)
    drawn = [line for line in figure.axes[0].lines if line.get_marker() in ("", "None")]
    for i, points in enumerate(circles(figure)):
        real = data.measured_form.values == "real"
        of_level = real & (data.measured_at_force_amplitude.values == LEVELS[i])
        np.testing.assert_allclose(points.get_xdata(), data.measured_frequency[of_level])
        assert matplotlib.colors.same_color(points.get_color(), drawn[i].get_color())
        line = curves.isel(force_amplitude=i)
        frequency, amplitude = sh.plot.curve(line)
        expected = np.interp(points.get_xdata(), frequency, amplitude)
        np.testing.assert_allclose(points.get_ydata(), expected, rtol=2e-3)
    assert len(circles(figure)) == 2


def test_accelerations_become_displacements(problem, curves):
    omega = 2 * np.pi * np.array(FREQUENCIES)
    data = sh.datasets.measured(
        FREQUENCIES, 1e-4 * omega**2, units="m s-2", form="magnitude", force_amplitude=2.0
    )
    [points] = [
        line
        for line in circles(sh.plot.response(curves, measured=data, scale="linear"))
        if len(line.get_xdata())
    ]
    np.testing.assert_allclose(points.get_ydata(), 1e-4)


def test_places_that_are_not_shown_and_points_left_out(problem):
    ring = sh.HarmonicBalance(ring_of_blades(3), sh.forces.PointForce())
    response = sh.frf(ring, (14, 16), at=[14, 15, 16], progress=False)
    data = sh.datasets.measured(
        [14.0, 15.0], [1e-4, 2e-4], units="m", form="magnitude", place=1, left_out=[False, True]
    )
    for place, n_points in ((1, 1), (0, 0), (None, 1)):
        figure = sh.plot.response(response, measured=data, place=place)
        assert sum(len(line.get_xdata()) for line in circles(figure)) == n_points


def test_what_is_no_measurement_is_refused(curves):
    with pytest.raises(TypeError, match=r"measured=3: expected a dataset"):
        sh.plot.response(curves, measured=3)  # pyright: ignore[reportArgumentType]


def test_peaks_and_modes_lie_on_their_curves(problem):
    data = [
        sh.datasets.measured(18.0, 5e-4, units="m", form="peak", force_amplitude=2.0),
        sh.datasets.measured(
            [20.0, 17.0], [0.1, 0.08], units="mm", form="mode", amplitude=[0.2, 1]
        ),
    ]
    curves = sh.frf(problem, (13, 21), over={"force_amplitude": LEVELS}, progress=False)
    figure = sh.plot.response(curves, measured=data[0], scale="linear", peaks=False)
    assert [line.get_xydata().tolist() for line in circles(figure)] == [[], [[18.0, 5e-4]]]
    modes = sh.nonlinear_modes(problem, progress=False)
    figure = sh.plot.nonlinear_modes(modes, measured=data[1])
    panels = figure.axes[0].child_axes
    drawn = [line.get_xydata() for panel in panels for line in panel.lines]
    assert any(np.array_equal(points, [[2e-4, 20.0], [1e-3, 17.0]]) for points in drawn)
    assert any(np.array_equal(points, [[2e-4, 0.1], [1e-3, 0.08]]) for points in drawn)
