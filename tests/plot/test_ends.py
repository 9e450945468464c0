"""Marks where curves end that are not complete."""

import numpy as np
import pytest

import symhbm as sh
from tests.paper import level, texts
from tests.problems import one_blade

PROBLEM = sh.HarmonicBalance(one_blade(), sh.forces.PointForce())
FREE = sh.HarmonicBalance(one_blade(damping=-0.5), harmonics=(1, 3))


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
    found = short(sh.frf, PROBLEM, band, over={"normal_load": loads})
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
        found = sh.frf(PROBLEM, band, over={"normal_load": [1.0, 3.0]}, progress=False)
        assert not len(crosses(sh.plot.response(found).axes[0]))
        # What is warned of where the end of the band was reached ends nowhere.
        found["status"][:] = str(sh.Status.OTHER_SOLUTIONS)
        assert not len(crosses(sh.plot.response(found).axes[0]))
        assert not len(crosses(sh.plot.phase(found).axes[0]))


def test_values_without_a_solution():
    grid = np.linspace(10, 30, 9)
    found = sh.frf(PROBLEM, (10, 30), grid, progress=False)
    for name in ("amplitude", "amplitude_slope", "coefficient"):
        found[name] = found[name].where(~found.frequency.isin(grid[[2, 3, 8]]))
    found["status"] = ((), str(sh.Status.POINTS_MISSING))
    beside = grid[[1, 4, 7]]
    np.testing.assert_array_equal(crosses(sh.plot.response(found).axes[0])[:, 0], beside)
    np.testing.assert_array_equal(crosses(sh.plot.phase(found).axes[0])[:, 0], beside)


def test_nonlinear_modes_that_stop():
    found = short(sh.nonlinear_modes, FREE)
    ax = sh.plot.nonlinear_modes(found).axes[0]
    panels = list(ax.child_axes)
    last = found.isel(point=-1)
    for panel, name in zip(panels, ("frequency", "damping_ratio"), strict=True):
        marks = [line.get_xydata() for line in panel.lines if line.get_marker() == "x"]
        np.testing.assert_array_equal(np.concatenate(marks), [[last.amplitude, last[name]]])
    assert len(crosses(panels[0]))
    # Negative damping, as here, is in its panel.
    low, high = panels[1].get_ylim()
    assert low < found.damping_ratio.min() <= found.damping_ratio.max() < high
    whole = sh.plot.nonlinear_modes(sh.nonlinear_modes(FREE, progress=False)).axes[0]
    assert not any(len(crosses(panel)) for panel in whole.child_axes)


@pytest.mark.slow
def test_limit_cycles_that_stop():
    found = short(sh.limit_cycles, FREE, "damping", (-30, -0.1), max_points=30)
    drawn = crosses(sh.plot.limit_cycles(found).axes[0])
    reached = np.isin(found.damping, (-30, -0.1))
    assert len(drawn) == 1
    for value, amplitude in drawn:
        at = (found.damping == value) & (found.amplitude == amplitude)
        assert at.any()
        assert not reached[at].any()
    whole = sh.limit_cycles(FREE, "damping", (-30, -0.1), progress=False)
    assert not len(crosses(sh.plot.limit_cycles(whole).axes[0]))


def test_flutter_limits_that_are_missing():
    found = sh.flutter_limit(
        FREE, "normal_load", (0.1, 10), np.geomspace(0.1, 10, 5), amplitudes=(1e-6, 4e-4),
        disturbance=[1e-6, 1e-4], progress=False,
    )  # fmt: skip
    assert not len(crosses(sh.plot.flutter_limit(found).axes[0]))
    value = found.normal_load.values
    found["flutter_limit"] = found.flutter_limit.where(found.normal_load != value[2])
    drawn = crosses(sh.plot.flutter_limit(found).axes[0])
    np.testing.assert_array_equal(drawn[:, 0], np.tile(value[[1, 3]], 2))


def test_fronts_that_are_not_complete():
    aims = {
        "peak [m]": lambda peaks, parameters: peaks["largest"],
        "load [N]": lambda peaks, parameters: parameters["normal_load"][0],
    }
    found = sh.pareto_front(
        PROBLEM, "normal_load", (0.5, 20), (5, 40), aims=aims, n_points=2, progress=False
    )
    for status in (sh.Status.FRONT_FOUND, sh.Status.FRONT_INCOMPLETE):
        found["status"] = ((), str(status))
        told = texts(sh.plot.pareto_front(found).axes[0].child_axes[0])
        said = any("incomplete" in text for text in told)
        assert said == (status == sh.Status.FRONT_INCOMPLETE)
