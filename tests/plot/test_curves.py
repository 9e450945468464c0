"""Figures from datasets."""

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from studies import fig03_single_blade as fig03
from symhbm.plot import drawing
from tests.paper import level, texts


@pytest.fixture(scope="module")
def family():
    return sh.frf(fig03.problem(), (10, 30), over={"normal_load": [1, 3, 100]})


def test_lines_labels_and_peaks(family):
    ax = sh.plot.response(family).axes[0]
    curves = [line for line in ax.lines if len(line.get_xdata()) > 1]
    assert len(curves) == 3
    assert "Hz" in ax.get_xlabel()
    assert "dB" in ax.get_ylabel()
    assert texts(ax) == ["$F_n$ = 1 N", "$F_n$ = 3 N", "$F_n$ = 100 N"]
    marks = [line for line in ax.lines if len(line.get_xdata()) == 1]
    assert len(marks) == 3
    for i, mark in enumerate(marks):
        top = level(float(family.peak_amplitude[i, 0]))
        assert mark.get_ydata()[0] == pytest.approx(top)
        # No line rises above its own peak.
        assert curves[i].get_ydata().max() == pytest.approx(top, abs=1e-12)


def test_lines_differ_in_greyscale(family):
    ax = sh.plot.response(family).axes[0]
    colors = [mpl.colors.to_rgb(line.get_color()) for line in ax.lines if len(line.get_xdata()) > 1]
    lightness = [np.dot(color, [0.299, 0.587, 0.114]) for color in colors]
    assert np.all(np.diff(lightness) < -0.1)


def test_one_degree_of_freedom_on_given_axes(family):
    _, ax = plt.subplots()
    figure = sh.plot.response(family.isel(normal_load=0), place=0, ax=ax)
    assert figure is ax.get_figure()
    assert ax.get_legend() is None
    assert "DOF 0" in ax.get_ylabel()


def test_many_curves_get_a_colour_bar():
    family = sh.frf(
        fig03.problem(), (10, 12), over={"normal_load": np.geomspace(0.1, 100, 16)}, at=[10, 11, 12]
    )
    figure = sh.plot.response(family)
    assert len(figure.axes) == 2
    ax, bar = figure.axes
    assert ax.get_legend() is None
    assert "F_n" in bar.get_ylabel()
    assert bar.get_yscale() == "log"
    # Equal ratios of loads are equal steps of the colours: 16 of 256, rounded down.
    every = [drawing.FAMILY(i) for i in range(256)]
    found = [every.index(tuple(line.get_color())) for line in ax.lines]
    assert np.all(np.abs(np.diff(found) - 255 / 15) <= 1)


def test_many_curves_of_two_parameters():
    """Colours tell one, line styles the other."""
    over = {"normal_load": np.linspace(1, 9, 9), "damping": [0.5, 1.0]}
    family = sh.frf(fig03.problem(), (10, 12), over=over, at=[10, 11])
    ax, _ = sh.plot.response(family, peaks=False).axes
    assert len(ax.lines) == 18
    assert texts(ax) == ["$c$ = 0.5 N s/m", "$c$ = 1 N s/m"]
    first = [line for line in ax.lines if line.get_linestyle() == "-"]
    assert len(first) == 9
    for line, load in zip(first, family.normal_load, strict=True):
        expected = family.amplitude.sel(normal_load=load, damping=0.5).max("dof")
        known = np.isin(line.get_xdata(), family.frequency)
        np.testing.assert_array_equal(line.get_ydata()[known], level(expected))


def test_samples_are_thin_lines_alike():
    loads = xr.DataArray(np.linspace(1, 9, 5), dims="sample")
    family = sh.frf(fig03.problem(), (10, 30), over={"normal_load": loads})
    (ax,) = sh.plot.response(family).axes
    assert len(ax.lines) == 5
    assert ax.get_legend() is None
    assert len({str(line.get_color()) for line in ax.lines}) == 1
    for line, top in zip(ax.lines, family.peak_amplitude.max("peak").values, strict=True):
        assert line.get_alpha() < 1
        assert line.get_ydata().max() == pytest.approx(level(top), abs=1e-12)


BAD = {
    "response dof": (sh.plot.response, {"place": 3}, ValueError, "place=3"),
    "response ax": (sh.plot.response, {"ax": 3}, TypeError, "ax=3"),
    "envelope": (sh.plot.envelope, {}, KeyError, "'sample' is no dimension"),
    "disk": (sh.plot.disk, {}, ValueError, "expected one parameter set"),
    "hysteresis": (sh.plot.hysteresis, {"contact": 1}, ValueError, "contact=1"),
    "hysteresis fraction": (sh.plot.hysteresis, {"contact": 0.5}, ValueError, r"contact=0\.5"),
    "map contact": (sh.plot.stick_map, {"contact": -1}, ValueError, "contact=-1"),
    "map word": (sh.plot.stick_map, {"contact": "all"}, ValueError, "contact='all'"),
    "map over": (sh.plot.stick_map, {"over": "mass"}, KeyError, "'mass' is no swept dimension"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_arguments(family, name):
    function, options, error, words = BAD[name]
    with pytest.raises(error, match=words):
        function(family, **options)
    assert plt.get_fignums() == []


MISSING = {
    "amplitude": (sh.plot.response, sh.plot.envelope),
    "coefficient": (sh.plot.disk, sh.plot.hysteresis),
    "normal_load": (sh.plot.hysteresis,),
    "stick_fraction": (sh.plot.stick_map,),
}


@pytest.mark.parametrize("name", MISSING)
def test_missing_variables(family, name):
    for function in MISSING[name]:
        with pytest.raises(KeyError, match=f"'{name}' is no variable"):
            function(family.drop_vars(name))
        with pytest.raises(TypeError, match="dataset=3"):
            function(3)
    assert plt.get_fignums() == []


def test_dimensions_that_were_selected(family):
    """What was of one contact or one blade is not taken for another's."""
    for function, dim in (
        (sh.plot.response, "dof"),
        (sh.plot.hysteresis, "dof"),
        (sh.plot.disk, "dof"),
        (sh.plot.hysteresis, "contact"),
        (sh.plot.stick_map, "contact"),
    ):
        with pytest.raises(KeyError, match=f"'{dim}' is no dimension"):
            function(family.isel({dim: 0}))


def test_one_point_is_no_curve():
    point = sh.solve(fig03.problem(), 20.0)
    for function in (sh.plot.response, sh.plot.envelope):
        with pytest.raises(KeyError, match="one point"):
            function(point)
    with pytest.raises(KeyError, match="frequency"):
        sh.plot.stick_map(point)
