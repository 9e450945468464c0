"""Pictures of nonlinear modes."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import symhbm as sh
from tests.paper import texts
from tests.problems import one_blade

BLADE = one_blade()
PROBLEM = sh.HarmonicBalance(BLADE)


def modes(**options):
    return sh.nonlinear_modes(PROBLEM, progress=False, **options)


def test_both_panels_show_the_lines_and_the_events():
    found = modes(over={"normal_load": [1, 3]})
    figure = sh.plot.nonlinear_modes(found)
    panels = figure.axes[0].child_axes
    for panel, name in zip(panels, ("frequency", "damping_ratio"), strict=True):
        lines = [line for line in panel.lines if line.get_linestyle() != "None"]
        assert len(lines) == 2
        for k, line in enumerate(lines):
            x, y = line.get_data()
            for amplitude, value in zip(
                found.amplitude[k].values, found[name][k].values, strict=True
            ):
                if np.isfinite(amplitude):
                    i = np.argmin(np.abs(x - amplitude))
                    assert (x[i], y[i]) == pytest.approx((amplitude, value), rel=1e-9)
        marks = [line for line in panel.lines if line.get_linestyle() == "None"]
        drawn = np.sort(np.concatenate([line.get_xdata() for line in marks]))
        np.testing.assert_array_equal(drawn, np.sort(found.event_amplitude.values.ravel()))
    assert texts(panels[0]) == ["$F_n$ = 1 N", "$F_n$ = 3 N"]


def test_grid_without_folds_is_drawn_into_axes_of_ones_own():
    found = modes(at=np.geomspace(1e-5, 1e-3, 9))
    figure, ax = plt.subplots()
    assert sh.plot.nonlinear_modes(found, ax=ax) is figure
    x, y = ax.child_axes[1].lines[0].get_data()
    chosen = [np.argmin(np.abs(x - amplitude)) for amplitude in found.amplitude.values]
    np.testing.assert_allclose(y[chosen], found.damping_ratio.isel(solution=0), rtol=1e-9)
    assert y.max() <= found.damping_ratio.max()


def test_axes_that_hold_a_picture_are_not_taken():
    response = sh.frf(sh.HarmonicBalance(BLADE, sh.forces.PointForce()), (10, 30), progress=False)
    ax = plt.subplots()[1]
    sh.plot.response(response, ax=ax)
    for draw, what in ((sh.plot.nonlinear_modes, modes(at=[1e-4])), (sh.plot.model, BLADE)):
        n_children = len(ax.get_children())
        with pytest.raises(ValueError, match="expected axes without a picture"):
            draw(what, ax=ax)
        assert ax.axison
        assert len(ax.get_children()) == n_children


def test_other_datasets_are_refused():
    response = sh.frf(sh.HarmonicBalance(BLADE, sh.forces.PointForce()), (10, 30), progress=False)
    with pytest.raises((TypeError, KeyError)):
        sh.plot.nonlinear_modes(response)
    with pytest.raises(TypeError, match="dataset="):
        sh.plot.nonlinear_modes(PROBLEM)
