"""Lines of curves: told apart in grey, smooth through folds, under what was measured."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import to_rgb

import symhbm as sh
from tests.measurements import measured_responses
from tests.plot.test_same_pictures import BLADE, DRIVEN, QUIET, result
from tests.problems import one_blade


def lines(figure):
    return [line for line in figure.axes[0].lines if len(line.get_xdata()) > 1]


def test_lines_differ_in_greyscale():
    colors = [to_rgb(line.get_color()) for line in lines(sh.plot.response(result("loads")))]
    assert np.all(np.diff(np.dot(colors, [0.299, 0.587, 0.114])) < -0.1)


def test_lines_of_cycles_are_vertical_at_folds():
    """They are smooth through them: both sides meet in the fold, and leave it along the axis."""
    found = sh.limit_cycles(DRIVEN, "damping", (-30, -20), stability=True, **QUIET)
    ends = []
    for line in lines(sh.plot.limit_cycles(found))[:2]:
        value, amplitude = line.get_data()
        fold = int(np.argmin(value))
        assert fold in (0, len(value) - 1)
        ends.append((value[fold], amplitude[fold]))
        beside = 1 if fold == 0 else len(value) - 2
        step = (value[beside] - value[fold]) / 10, np.log(amplitude[beside] / amplitude[fold])
        assert abs(step[0]) < 0.2 * abs(step[1])
    assert ends[0] == ends[1]


def test_axes_that_hold_a_picture_are_not_taken():
    ax = plt.subplots()[1]
    sh.plot.response(result("loads"), ax=ax)
    for draw, what in ((sh.plot.nonlinear_modes, result("modes")), (sh.plot.model, one_blade())):
        n_children = len(ax.get_children())
        with pytest.raises(ValueError, match="expected axes without a picture"):
            draw(what, ax=ax)
        assert ax.axison
        assert len(ax.get_children()) == n_children


def test_measured_points_lie_on_the_curve_of_their_level():
    problem, levels = BLADE.with_harmonics((1,)), [0.5, 2.0]
    curves = sh.frf(problem, (13, 21), over={"force_amplitude": levels}, **QUIET)
    data = measured_responses(problem, levels, [14.0, 17.0, 20.0])
    figure = sh.plot.response(curves, measured=data, scale="linear", peaks=False)
    circles = [line for line in figure.axes[0].lines if str(line.get_markerfacecolor()) == "none"]
    for number, points in enumerate(circles):
        exact = np.interp(points.get_xdata(), *sh.plot.curve(curves.isel(force_amplitude=number)))
        np.testing.assert_allclose(points.get_ydata(), exact, rtol=2e-3)
    assert len(circles) == 2
