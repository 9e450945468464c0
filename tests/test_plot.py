"""Figures from datasets."""

import matplotlib as mpl
import numpy as np
import pytest

mpl.use("Agg")

import matplotlib.pyplot as plt

import symhbm as sh
from studies import fig03_single_blade as fig03


@pytest.fixture(autouse=True)
def _close():
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def family():
    return sh.frf(fig03.problem(), (10, 30), over={"normal_load": [1, 3, 100]})


def test_lines_labels_and_peaks(family):
    ax = sh.plot.response(family).axes[0]
    curves = [line for line in ax.lines if len(line.get_xdata()) > 1]
    assert len(curves) == 3
    assert "Hz" in ax.get_xlabel()
    assert "dB" in ax.get_ylabel()
    legend = ax.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [
        "$F_n$ = 1 N",
        "$F_n$ = 3 N",
        "$F_n$ = 100 N",
    ]
    marks = [line for line in ax.lines if len(line.get_xdata()) == 1]
    assert len(marks) == 3
    for i, mark in enumerate(marks):
        level = 20 * np.log10(float(family.peak_amplitude[i, 0]))
        assert mark.get_ydata()[0] == pytest.approx(level)
        # No line rises above its own peak.
        assert curves[i].get_ydata().max() == pytest.approx(level, abs=1e-12)


def test_lines_differ_in_greyscale(family):
    ax = sh.plot.response(family).axes[0]
    colors = [mpl.colors.to_rgb(line.get_color()) for line in ax.lines if len(line.get_xdata()) > 1]
    lightness = [np.dot(color, [0.299, 0.587, 0.114]) for color in colors]
    assert np.all(np.diff(lightness) < -0.1)


def test_one_degree_of_freedom_on_given_axes(family):
    _, ax = plt.subplots()
    figure = sh.plot.response(family.isel(normal_load=0), dof=0, ax=ax)
    assert figure is ax.get_figure()
    assert ax.get_legend() is None
    assert "DOF 0" in ax.get_ylabel()


def test_many_curves_get_a_colour_bar():
    family = sh.frf(
        fig03.problem(), (10, 12), over={"normal_load": np.geomspace(0.1, 100, 16)}, at=[10, 11, 12]
    )
    figure = sh.plot.response(family)
    assert len(figure.axes) == 2
    assert "F_n" in figure.axes[1].get_ylabel()


def test_bad_input(family):
    with pytest.raises(ValueError, match="dof=3"):
        sh.plot.response(family, dof=3)
    with pytest.raises(KeyError, match="one point"):
        sh.plot.response(sh.solve(fig03.problem(), 20.0))
    with pytest.raises(KeyError, match="amplitude"):
        sh.plot.response(family.drop_vars("amplitude"))
