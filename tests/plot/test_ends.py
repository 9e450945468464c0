"""Marks where curves end that are not complete."""

import numpy as np
import pytest

import symhbm as sh
from tests.paper import level, texts
from tests.problems import one_blade

PROBLEM = sh.HarmonicBalance(one_blade(), sh.forces.PointForce())


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
