"""Goals over a parameter: `peak_curve` beside dense grids, slopes beside differences."""

import numpy as np
import pytest

import symhbm as sh
from tests.designs import BAND, blade

GOALS = sh.goals.Dissipation(), sh.goals.SlipDistance()


def curve(goal, loads, **given):
    ends = min(loads), max(loads) + 1
    given = dict(frequency_band=BAND, progress=False, at=loads) | given
    problem = blade((1, 3)).with_peaks_of(goal)
    return sh.peak_curve(problem, "normal_load", ends, **given)


@pytest.mark.parametrize("goal", GOALS, ids=lambda goal: type(goal).__name__)
def test_largest_values_are_those_of_grids(goal):
    loads = [2.0, 5.0]
    found = curve(goal, loads)
    assert found.peak_amplitude.attrs["units"] == goal.units
    assert found.peak_amplitude_slope.attrs["units"] == f"{goal.units}/(N)"
    assert found.peak_kind.values.tolist() == ["smooth", "smooth"]
    pairs = zip(loads, found.peak_amplitude.values, found.peak_frequency.values, strict=True)
    for load, largest, frequency in pairs:
        near = frequency + np.linspace(-0.3, 0.3, 301)
        problem = blade((1, 3)).with_parameters(normal_load=load)
        grid = sh.frf(problem, BAND, at=near, progress=False).dissipation.max().item()
        if isinstance(goal, sh.goals.SlipDistance):
            grid /= 0.5 * load
        assert grid == pytest.approx(largest, rel=1e-12)


def test_slopes_are_those_of_differences():
    step = 1e-4
    found = curve(GOALS[1], [4.0 - step, 4.0, 4.0 + step])
    values = found.peak_amplitude.values
    slope = (values[2] - values[0]) / (2 * step)
    assert found.peak_amplitude_slope.values[1] == pytest.approx(slope, rel=1e-7)


@pytest.mark.slow
def test_values_of_zero_are_refused():
    with pytest.raises(ValueError, match="is 0 at normal_load="):
        curve(GOALS[0], [1.0, 1e3])


def test_other_paths_have_no_peaks_of_goals():
    problem = blade((1, 3)).with_peaks_of(GOALS[0])
    with pytest.raises(ValueError, match=r"those of Dissipation.* are over the frequency"):
        sh.follow(problem, "normal_load", (1, 9), frequency=19)
    with pytest.raises(ValueError, match="free motions have none of Dissipation"):
        sh.nonlinear_modes(problem)


def test_response_at_one_frequency():
    """Its values, slopes and minimum are those of responses that are solved for one by one."""
    frequency, loads, step = 18.5, [1.0, 2.0], 1e-3

    def amplitude(load):
        return sh.solve(blade(normal_load=load), frequency).amplitude.item()

    found = sh.peak_curve(
        blade(), "normal_load", (0.5, 6), at=loads, frequency_band=frequency, progress=False
    )
    assert found.peak_kind.values.tolist() == ["point", "point"]
    pairs = zip(loads, found.peak_amplitude.values, found.peak_amplitude_slope.values, strict=True)
    for load, value, slope in pairs:
        assert value == pytest.approx(amplitude(load), rel=1e-12)
        once, twice = (amplitude(load + n * step) - amplitude(load - n * step) for n in (1, 2))
        assert slope == pytest.approx((8 * once - twice) / (12 * step), rel=1e-9)
    lowest = found.minimum_normal_load.values[-1]
    beside = [amplitude(lowest * share) for share in (0.999, 1.0, 1.001)]
    assert np.argmin(beside) == 1
