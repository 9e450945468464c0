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
            np.testing.assert_array_equal(line[: len(own)], own)
            assert len(line) - len(own) in (0, 1)
    folds = [line for line in ax.lines if line.get_marker() == "s"]
    np.testing.assert_array_equal([line.get_xdata()[0] for line in folds], found.fold_damping)
    assert "damping" in ax.get_xlabel()


def test_branches_are_not_joined():
    figure = sh.plot.limit_cycles(cycles("mass", (0.5, 2.0)))
    lines = [line for line in figure.axes[0].lines if line.get_linestyle() == "-"]
    assert len(lines) == 2


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
