"""Pictures are right between the points of a dataset, and none is empty."""

from itertools import pairwise

import numpy as np
import pytest
from click.testing import CliRunner

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from symhbm.cli import main
from symhbm.numerics.loops.interpolation import amplitude_between
from symhbm.results.variables import SLOPES
from tests.paper import CLOSE, exact, level, long_lines, off_paper
from tests.plot.test_bad_pictures import failed
from tests.problems import duffing, ring_of_blades
from tests.quick import quick_first


def mistuned():
    """A ring of five blades with other contacts everywhere."""
    disk = ring_of_blades(
        5, contact_stiffness=[9e4, 1.1e5, 1e5, 1.2e5, 8e4], normal_load=[10, 8, 12, 9, 11]
    )
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(2, amplitude=1.0))


CURVES = {
    "downwards": (lambda: fig03.problem().with_parameters(normal_load=3), (30, 10), {}),
    "harmonics": (lambda: fig03.problem((1, 3)).with_parameters(normal_load=2), (12, 28), {}),
    "accuracy": (
        lambda: fig03.problem().with_parameters(normal_load=3),
        (14, 26),
        dict(accuracy=1e-3),
    ),
    "mistuned": (mistuned, (50, 110), {}),
    "a blade of a tuned disk": (fig08.problem, (50, 350), dict(place=5)),
    "antiresonances of a blade": (mistuned, (50, 110), dict(peaks="each", place=3)),
}


@pytest.mark.parametrize("name", quick_first(CURVES, 2))
def test_a_response_is_drawn_where_it_is(name):
    make, band, options = CURVES[name]
    problem, place = make(), options.get("place")
    given = {key: value for key, value in options.items() if key != "place"}
    curve = sh.frf(problem, band, throw=True, progress=False, **given)
    (line,) = long_lines(sh.plot.response(curve, place=place).axes[0])
    number = 200 if "accuracy" in options else 500
    assert off_paper(line, curve, dof=place, n_values=number, problem=problem) < CLOSE


def test_corners_between_values_of_a_grid():
    curve = sh.frf(mistuned(), (50, 110), np.linspace(50, 110, 31), progress=False)
    ax = sh.plot.response(curve).axes[0]
    (line,) = long_lines(ax)
    marks = [mark for mark in ax.lines if len(mark.get_xdata()) == 1]
    assert len(marks) > 1
    x, y = line.get_data()
    for mark in marks:
        (at,), (top,) = mark.get_data()
        assert y[x == at] == pytest.approx(top, abs=1e-9)
    assert y.max() == max(mark.get_ydata()[0] for mark in marks)


def test_slopes_are_derivatives():
    cases = [
        sh.frf(fig03.problem((1, 3)).with_parameters(normal_load=2), (12, 28)),
        sh.frf(mistuned(), (50, 110), np.linspace(51, 109, 8)),
        sh.follow(fig03.problem(), "normal_load", (1, 300), frequency=22.0),
        sh.frf(fig08.problem(), (190, 230)),
    ]
    for curve in cases:
        name = "normal_load" if "event_normal_load" in curve else "frequency"
        values = curve[name].values[1:-1]
        events = curve[f"event_{name}"].values
        far = np.abs(values[:, None] - events).min(axis=1, initial=np.inf) > 2e-3 * values
        rows = np.flatnonzero(far)[:: max(far.sum() // 6, 1)]
        assert len(rows) >= 4
        step = 1e-6 * values[rows]
        beside = np.sort(np.concatenate([values[rows] - step, values[rows] + step]))
        amplitude = exact(curve, beside).amplitude.values
        expected = (amplitude[1::2] - amplitude[::2]) / (2 * step[:, None])
        slope = curve.amplitude_slope.values[1:-1][rows]
        scale = np.abs(amplitude[::2]).max(axis=1, keepdims=True) / values[rows, None]
        np.testing.assert_array_less(np.abs(slope - expected), 2e-5 * (scale + np.abs(expected)))
        unit = {"frequency": "m Hz-1", "normal_load": "m N-1"}[name]
        assert curve.amplitude_slope.attrs["units"] == unit


def test_slopes_on_both_sides_of_an_event():
    curve = sh.frf(fig03.problem().with_parameters(normal_load=3), (10, 30))
    differ = curve.amplitude_slope.values[:, 0] != curve.amplitude_slope_before.values[:, 0]
    np.testing.assert_allclose(curve.frequency.values[differ], curve.event_frequency.values)
    for at, side, other in zip(
        curve.event_frequency.values,
        curve.amplitude_slope_before.values[differ, 0],
        curve.amplitude_slope.values[differ, 0],
        strict=True,
    ):
        step = 1e-7 * at
        near = exact(curve, at + step * np.array([-2, -1, 1, 2])).amplitude.values[:, 0]
        assert (near[1] - near[0]) / step == pytest.approx(side, rel=1e-2)
        assert (near[3] - near[2]) / step == pytest.approx(other, rel=1e-2)


def test_slopes_at_rest():
    """A response grows from nothing as the force does."""
    curve = sh.follow(fig03.problem(), "force_amplitude", (0, 0.5), frequency=19.5)
    first = curve.amplitude.values[1, 0] / curve.force_amplitude.values[1]
    assert curve.amplitude.values[0, 0] == 0
    assert curve.amplitude_slope.values[0, 0] == pytest.approx(first, rel=1e-9)


def test_slopes_at_folds_are_infinite():
    curve = sh.frf(duffing(), (0.08, 0.32))
    for at in curve.event_frequency.values:
        here = np.abs(curve.frequency.values - at).argmin()
        for name in SLOPES:
            assert np.isinf(curve[name].values[here, 0])
    assert np.isinf(curve.amplitude_slope.values).sum() == 2


def test_slopes_are_kept_where_they_are_asked_for():
    keep = ["amplitude", "amplitude_slope"]
    assert {*SLOPES} & {*map(str, sh.frf(fig03.problem(), (10, 12), keep=keep).variables)} == {
        "amplitude_slope"
    }
    assert "amplitude_slope" not in sh.frf(fig03.problem(), (10, 12), keep=["amplitude"])


def test_without_slopes_lines_are_monotone_between_points():
    curve = sh.frf(fig03.problem().with_parameters(normal_load=1), (10, 30)).drop_vars(SLOPES)
    (line,) = long_lines(sh.plot.response(curve).axes[0])
    x, y = line.get_data()
    points = curve.frequency.values
    corners = np.sort(np.append(points, curve.peak_frequency.values[0]))
    for low, high in pairwise(corners):
        steps = np.diff(y[(x >= low) & (x <= high)])
        assert np.all(steps >= -1e-12) or np.all(steps <= 1e-12)
    folded = sh.frf(duffing(), (0.08, 0.32)).drop_vars([*SLOPES, "stability"])
    (line,) = long_lines(sh.plot.response(folded).axes[0])
    np.testing.assert_allclose(line.get_ydata()[::2], level(folded.amplitude.values[:, 0]))


SHARES = np.linspace(0, 1, 41)


@pytest.mark.parametrize("sign", [1, -1])
def test_between_two_points(sign):
    """Exponentials of cubics, roots of squares and roots are met; ends to the last bit."""
    power = np.polynomial.Polynomial([0.3, 0.4 * sign, -0.2, 0.1])
    amplitude, slope = np.exp(power(SHARES)), np.exp(power(SHARES)) * power.deriv()(SHARES)
    ends = amplitude[0], amplitude[-1], (slope[0], slope[-1])
    np.testing.assert_allclose(amplitude_between(*ends, SHARES), amplitude, rtol=1e-13)
    assert amplitude_between(*ends, SHARES)[[0, -1]].tolist() == [amplitude[0], amplitude[-1]]
    near = np.polynomial.Polynomial([1.0, -2.6, 1.8])
    size, rate = np.sqrt(near(SHARES)), near.deriv()(SHARES) / (2 * np.sqrt(near(SHARES)))
    ends = size[0], size[-1], (rate[0], rate[-1])
    np.testing.assert_allclose(amplitude_between(*ends, SHARES), size, rtol=1e-13)
    rooted = 2 + sign * 0.7 * np.sqrt(SHARES) + 0.2 * SHARES
    last = sign * 0.35 + 0.2
    found = amplitude_between(2.0, rooted[-1], (np.inf, last), SHARES)
    np.testing.assert_allclose(found, rooted, rtol=1e-13)
    found = amplitude_between(rooted[-1], 2.0, (-last, np.inf), 1 - SHARES)
    np.testing.assert_allclose(found, rooted, rtol=1e-13)


def test_interpolation_does_not_overshoot():
    for first, last in ((50.0, 0.0), (0.0, 50.0), (80.0, 90.0)):
        steps = np.diff(amplitude_between(1.0, 2.0, (first, last), SHARES))
        assert np.all(steps >= 0)


def test_the_command_line_draws_no_empty_picture(tmp_path):
    sh.save(failed(), tmp_path / "failed.nc")
    arguments = ["plot", str(tmp_path / "failed.nc"), "--kind", "blades"]
    result = CliRunner().invoke(main, [*arguments, "--select", "normal_load=3"])
    assert result.exit_code != 0
    assert "no response was found" in result.output
    assert [path.name for path in tmp_path.iterdir()] == ["failed.nc"]
