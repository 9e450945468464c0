"""Pictures of limit cycles."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import symhbm as sh
from tests.problems import one_blade

BLADE = one_blade(damping=-0.5)
PROBLEM = sh.HarmonicBalance(BLADE, harmonics=(1, 3))


def cycles(*given, **options):
    return sh.limit_cycles(PROBLEM, *given, **dict(progress=False) | options)


@pytest.mark.slow
def test_lines_tell_which_cycles_are_stable():
    found = cycles("damping", (-30, -0.1), stability=True, over={"normal_load": [1.0, 3.0]})
    figure, ax = plt.subplots()
    assert sh.plot.limit_cycles(found, ax=ax) is figure
    for style, verdict in (("-", 1), ("--", 0)):
        drawn = [line.get_ydata() for line in ax.lines if line.get_linestyle() == style]
        assert len(drawn) == 2
        for k, line in enumerate(drawn):
            one = found.isel(normal_load=k)
            own = one.amplitude.values[one.stability.values == verdict]
            # Smooth lines through the points, up to the first one of other stability.
            nearest = np.abs(np.log(line[:, None] / own)).argmin(axis=0)
            np.testing.assert_allclose(line[nearest], own, rtol=1e-12)
            assert np.diff(nearest).min() >= 2
            assert nearest[0] == 0
            assert len(line) - 1 - nearest[-1] in (0, 8)
    folds = [line for line in ax.lines if line.get_marker() == "s"]
    np.testing.assert_array_equal([line.get_xdata()[0] for line in folds], found.fold_damping)
    assert "damping" in ax.get_xlabel()


def test_branches_are_not_joined():
    figure = sh.plot.limit_cycles(cycles("mass", (0.5, 2.0)))
    lines = [line for line in figure.axes[0].lines if line.get_linestyle() == "-"]
    assert len(lines) == 2


def test_lines_are_vertical_at_folds():
    """They are smooth through them: both sides meet in the fold, and leave it along the axis."""
    found = cycles("damping", (-30, -20), stability=True)
    ax = sh.plot.limit_cycles(found).axes[0]
    ends = []
    for line in ax.lines[:2]:
        value, amplitude = line.get_xdata(), line.get_ydata()
        fold = int(np.argmin(value))
        assert fold in (0, len(value) - 1)
        ends.append((value[fold], amplitude[fold]))
        beside = 1 if fold == 0 else len(value) - 2
        step = (value[beside] - value[fold]) / 10, np.log(amplitude[beside] / amplitude[fold])
        assert abs(step[0]) < 0.2 * abs(step[1])
    assert ends[0] == ends[1]


@pytest.mark.slow
def test_other_datasets_are_refused():
    with pytest.raises(TypeError, match="over a parameter"):
        sh.plot.limit_cycles(cycles())
    with pytest.raises(ValueError, match="grid"):
        sh.plot.limit_cycles(cycles("damping", (-30, 0), [-1.0]))
    with pytest.raises(TypeError, match="dataset="):
        sh.plot.limit_cycles(PROBLEM)
    with pytest.warns(RuntimeWarning, match="no limit cycle"):
        nothing = cycles("damping", (-50, -40))
    with pytest.raises(ValueError, match="no limit cycle"):
        sh.plot.limit_cycles(nothing)
