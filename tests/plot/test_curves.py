"""Lines of curves: smooth through folds, straight on every scale, under measurements, with ends."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import to_rgb

import symhbm as sh
from symhbm.plot.curves import drawn
from symhbm.plot.drawing import Scale
from symhbm.plot.lines import Line
from tests.measurements import measured_responses
from tests.paper import level, texts
from tests.plot.test_same_pictures import BLADE, DRIVEN, QUIET, result
from tests.problems import one_blade, ring_of_blades

ONE = sh.HarmonicBalance(one_blade(), sh.forces.PointForce())


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


def crosses(ax):
    """Places (n, 2) of the marks of axes, and what the legend says of them."""
    lines = [line for line in ax.lines if line.get_marker() == "x"]
    places = [line.get_xydata() for line in lines]
    said = texts(ax)
    assert ("incomplete, ends here" in said) == bool(len(lines))
    assert said.count("incomplete, ends here") <= 1
    return np.concatenate(places) if places else np.empty((0, 2))


def short(verb, *given, max_points=12, **options):
    with pytest.warns(RuntimeWarning, match="incomplete"):
        return verb(*given, max_points=max_points, progress=False, **options)


@pytest.mark.parametrize("band", [(10, 30), (30, 10)])
@pytest.mark.parametrize("loads", [[3.0], [1.0, 3.0]])
def test_paths_that_stop(band, loads):
    found = short(sh.frf, ONE, band, over={"normal_load": loads})
    last = [found.isel(normal_load=k, point=int(n) - 1) for k, n in enumerate(found.n_points)]
    levels = level([one.amplitude.item() for one in last])
    frequency = [one.frequency.item() for one in last]
    assert not np.isin(frequency, band).any()
    drawn = crosses(sh.plot.response(found).axes[0])
    np.testing.assert_allclose(drawn, np.transpose([frequency, levels]))
    lag = crosses(sh.plot.phase(found).axes[0])
    np.testing.assert_allclose(lag[:, 0], frequency)


def test_complete_paths_have_no_mark():
    for band in ((10, 30), (30, 10)):
        found = sh.frf(ONE, band, over={"normal_load": [1.0, 3.0]}, progress=False)
        assert not len(crosses(sh.plot.response(found).axes[0]))
        # What is warned of where the end of the band was reached ends nowhere.
        found["status"][:] = str(sh.Status.OTHER_SOLUTIONS)
        assert not len(crosses(sh.plot.response(found).axes[0]))
        assert not len(crosses(sh.plot.phase(found).axes[0]))


def test_values_without_a_solution():
    grid = np.linspace(10, 30, 9)
    found = sh.frf(ONE, (10, 30), grid, progress=False)
    for name in ("amplitude", "amplitude_slope", "coefficient"):
        found[name] = found[name].where(~found.frequency.isin(grid[[2, 3, 8]]))
    found["status"] = ((), str(sh.Status.POINTS_MISSING))
    beside = grid[[1, 4, 7]]
    np.testing.assert_array_equal(crosses(sh.plot.response(found).axes[0])[:, 0], beside)
    np.testing.assert_array_equal(crosses(sh.plot.phase(found).axes[0])[:, 0], beside)


LINEAR = sh.HarmonicBalance(sh.Model([[1.0]], [[2.0]], [[1e4]]), sh.forces.PointForce())


def test_a_linear_axis_has_lines_that_are_straight_on_it():
    """A slope that is straight in decibels is bent there."""
    rise = np.log(1000)
    amplitude = 1e-6 * np.array([[1.0], [1000.0]])
    stable = np.zeros(2, dtype=bool)
    line = Line(np.array([0.0, 1.0]), amplitude, rise * amplitude, rise * amplitude, stable)
    for scale in (Scale("decibel"), Scale("linear"), Scale("log")):
        value, shown, _ = drawn(line, scale)
        exact = scale.of(line.read((value[1:] + value[:-1]) / 2))
        if scale.kind == "log":
            shown, exact = np.log(shown), np.log(exact)
        distance = np.abs((shown[1:] + shown[:-1]) / 2 - exact).max()
        assert distance < 3e-4 * np.ptp(shown)


def test_phase_by_the_closed_form():
    response = sh.frf(LINEAR, (5, 30), progress=False)
    ax = sh.plot.phase(response).axes[0]
    ((value, lag),) = [line.get_data() for line in ax.lines]
    omega = 2 * np.pi * value
    exact = np.degrees(np.arctan2(2 * omega, 1e4 - omega**2))
    computed = np.isin(value, response.frequency.values)
    assert computed.sum() == response.n_points.item()
    np.testing.assert_allclose(lag[computed], exact[computed], rtol=1e-9)
    # Between the points it is a curve; straight lines are off by more than a degree.
    straight = np.interp(value, value[computed], lag[computed])
    assert np.abs(lag - exact).max() < 0.15 < 1 < np.abs(straight - exact).max()
    assert "deg" in ax.get_ylabel()


def test_lines_on_a_grid_invent_no_peaks():
    """Between points of a coarse grid slopes may promise a peak that is not located there."""
    slopes = np.array([[30.0], [-30.0], [-0.1], [np.nan]])
    amplitude = np.array([[1.0], [1.0], [0.5], [0.4]])
    line = Line(np.arange(4.0), amplitude, slopes, slopes, np.zeros(4, dtype=bool))
    value, level, _ = line.polyline()
    assert level.max() > 20
    held = line.held(line.value, amplitude[:, 0])
    at, told, _ = held.polyline()
    assert told.max() == 0.0
    np.testing.assert_allclose(told[at < 1], 0.0, atol=1e-12)
    after = value >= 1
    np.testing.assert_allclose(np.interp(value[after], at, told), level[after], atol=1e-2)
    # A located peak as high keeps the curve as its slopes tell it.
    peak = 10 ** (level.max() / 20)
    both = line.held(np.append(line.value, 0.5), np.append(amplitude[:, 0], peak))
    assert not both.straight.any()


def test_a_coarse_grid_of_a_ring_is_drawn_below_its_peaks():
    """13 blades at steps of 5 Hz: slopes beside two resonances promise 0.7 dB too much."""
    disk = ring_of_blades(13, contact_stiffness=1e6, normal_load=10)
    draws = sh.mistuning.uniform(disk, 4, seed=1, contact_stiffness=0.1).isel(sample=[3])
    problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(3))
    grid = np.arange(50.0, 351, 5)
    curve = sh.frf(problem, (50, 350), at=grid, over=draws, progress=False).isel(sample=0)
    lines = sh.plot.response(curve).axes[0].lines
    top = level(float(curve.peak_amplitude.max()))
    assert max(np.max(line.get_ydata(), initial=-np.inf) for line in lines) <= top + 1e-9


def test_straight_lines_of_what_rests_are_whole():
    """Between points of which one degree of freedom does not move, as those across a force."""
    amplitude = np.array([[0.0, 1.0], [0.0, 4.0]])
    slopes = np.array([[0.0, 30.0], [0.0, -30.0]])
    line = Line(np.arange(2.0), amplitude, slopes, slopes, np.zeros(2, dtype=bool))
    held = line.held(np.arange(2.0), amplitude[:, 1])
    assert held.straight.all()
    np.testing.assert_allclose(held.read(np.array([0, 0.5, 1])), [1, 2, 4], rtol=1e-12)
