"""What pictures of studies need: intervals of statistics, and curves between their points."""

import numpy as np
import pytest
from scipy import stats

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import sampling
from studies.smooth import along, with_states


def test_intervals_of_means_are_those_of_student():
    values = np.random.default_rng(3).normal(2, 0.5, (4, 12))
    for row, half in zip(values, sampling.of_mean(values), strict=True):
        exact = stats.t.interval(0.95, 11, row.mean(), stats.sem(row))
        assert (row.mean() - half, row.mean() + half) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("n", [6, 25, 100])
def test_intervals_of_medians_hold_what_they_say(n):
    """Ranks of the ends, and the share of draws whose interval holds the median 0."""
    values = np.random.default_rng(n).normal(0, 1, (n, 4000))
    low, high = sampling.of_median(values)
    within = np.mean((low <= 0) & (high >= 0))
    rank = int((values < low).sum(axis=0)[0])
    exact = 1 - 2 * stats.binom.cdf(rank, n, 0.5)
    assert exact >= 0.95
    # One rank more at both ends would not do.
    assert 1 - 2 * stats.binom.cdf(rank + 1, n, 0.5) < 0.95
    # 4,000 draws: a standard error of 0.4 %.
    assert within == pytest.approx(exact, abs=0.015)


def test_intervals_by_resampling_are_those_of_a_mean():
    values = np.random.default_rng(5).normal(0, 1, 60)
    low, high = sampling.of_statistic(lambda draw: float(values[draw].mean()), 60)
    half = 1.96 * values.std() / np.sqrt(60)
    # 2,000 resampled sets.
    assert (high - low) / 2 == pytest.approx(half, rel=0.06)
    assert sampling.of_share(np.array(0.5), 100) == pytest.approx(0.0992, abs=1e-4)


@pytest.mark.parametrize("load", [1, 3])
def test_a_curve_tells_the_stretch_of_each_of_its_lines(load):
    curve = sh.frf(fig03.problem().with_parameters(normal_load=load), (10, 30), progress=False)
    value, amplitude, stretch = along(curve)
    points = curve.frequency.values
    middle = (value[:-1] + value[1:]) / 2
    assert (points[stretch] <= middle).all()
    assert (middle <= points[stretch + 1]).all()
    own = np.isin(value, points)
    assert own.sum() == len(np.unique(points))
    np.testing.assert_allclose(
        amplitude[own], np.interp(value[own], points, curve.amplitude[:, 0]), rtol=1e-12
    )
    _, _, states = with_states(curve, 0, np.maximum)
    slips = np.interp(value, points, curve.contact_state.values[:, 0]) > 0
    np.testing.assert_array_equal(states[:, 0] > 0, slips)
