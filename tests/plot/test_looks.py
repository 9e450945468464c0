"""Several results in one picture: names, colours that go on, legends, sizes, what differs."""

from itertools import combinations

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from symhbm.plot import LINE_STYLES
from symhbm.plot.front import _values
from symhbm.plot.looks import HUES
from symhbm.plot.rendering import _LETTER, _wrap_label
from tests.paper import texts
from tests.problems import one_blade

PROBLEM = sh.HarmonicBalance(one_blade(), sh.forces.PointForce(), (1, 3))
STIFFER = PROBLEM.with_parameters(stiffness=1.2e4)


@pytest.fixture(scope="module")
def curves():
    return [
        sh.frf(PROBLEM.with_parameters(normal_load=load), (10, 30), progress=False)
        for load in (3.0, 6.0, 1.0)
    ]


@pytest.fixture(scope="module")
def sweeps():
    loads = {"normal_load": [1.0, 3.0, 6.0]}
    return [sh.frf(problem, (10, 30), over=loads, progress=False) for problem in (PROBLEM, STIFFER)]


def lines(ax):
    return [line for line in ax.lines if len(line.get_xdata()) > 20]


def test_colours_go_on_in_the_axes_of_the_caller(curves):
    figure, ax = plt.subplots()
    for label, one in zip(("first", "second", "third"), curves, strict=True):
        assert sh.plot.response(one, label=label, ax=ax) is figure
    assert texts(ax) == ["first", "second", "third"]
    hexes = [plt.matplotlib.colors.to_hex(line.get_color()) for line in lines(ax)]
    assert hexes == [*HUES[:3]]


@pytest.mark.parametrize("size", [None, "column", "page"])
def test_legends_leave_axes_their_width_and_stay_inside(sweeps, size):
    figure = sh.plot.response({"a design as built": sweeps[0], "another one": sweeps[1]}, size=size)
    figure.canvas.draw()
    [ax] = figure.axes
    assert ax.get_position().width >= 0.7
    legend, whole = ax.get_legend().get_window_extent(), figure.bbox
    assert whole.x0 <= legend.x0 < legend.x1 <= whole.x1
    assert legend.y0 >= whole.y0
    assert not legend.overlaps(ax.get_window_extent())
    widths = {None: 6.4, "column": 3.5, "page": 7.2}
    assert figure.get_size_inches()[0] == widths[size]
    assert ax.yaxis.label.get_window_extent().y1 <= whole.y1


@pytest.mark.parametrize("name", ["as built", "thicker shroud", "a name that is longer"])
def test_axes_beside_any_legend_are_wide(curves, name):
    figure = sh.plot.response(curves[0], label=name)
    figure.canvas.draw()
    assert figure.axes[0].get_position().width >= 0.7


def test_labels_that_are_longer_than_axes_are_high_are_broken(curves):
    values = (
        curves[0]
        .amplitude.max("point")
        .assign_attrs(long_name="largest displacement of all the points shown", units="m")
    )
    for size, broken in (("column", True), ("page", False)):
        figure = sh.plot.blades(values, size=size)
        figure.canvas.draw()
        label = figure.axes[0].yaxis.label
        assert ("\n" in label.get_text()) is broken
        assert label.get_window_extent().y1 <= figure.bbox.y1
        assert label.get_window_extent().y0 >= 0


@pytest.mark.parametrize(("letters", "lines"), [(34, 1), (26, 2), (20, 2)])
def test_labels_are_broken_where_words_and_unit_are_longer(letters, lines):
    figure = plt.Figure()
    ax = figure.subplots()
    ax.set_ylabel("largest amplitude [mm per newton]")
    letter = _LETTER * ax.yaxis.label.get_fontsize() * figure.dpi / 72
    _wrap_label(ax, letters * letter)
    assert ax.get_ylabel().count("\n") == lines - 1


def test_fronts_tell_their_variables_by_the_style_of_lines():
    names = [f"load_{number}" for number in range(len(LINE_STYLES) + 1)]
    data = dict(front_value=(("point", "variable"), np.ones((2, len(names)))))
    data |= dict(variable=("variable", names), variable_units=("variable", ["N"] * len(names)))
    panel = _values(xr.Dataset(data), np.arange(2), np.ones(2), "peak")
    assert [item.look["linestyle"] for item in panel.items] == [*LINE_STYLES, LINE_STYLES[0]]


def test_axes_of_the_caller_have_their_size(curves):
    figure, ax = plt.subplots()
    with pytest.raises(ValueError, match="size='column': expected None"):
        sh.plot.response(curves[0], ax=ax, size="column")
    plt.close(figure)


def test_no_legend_where_none_is_asked_for(sweeps):
    [ax] = sh.plot.response(sweeps[0], legend=False).axes
    assert ax.get_legend() is None


def test_saved_figures_of_others_keep_labels_inside(tmp_path):
    figure, ax = plt.subplots(figsize=(3, 2))
    ax.set_xlabel("a label", labelpad=60)
    image = plt.imread(sh.plot.save(figure, tmp_path / "a.png", dpi=50))
    assert image.shape[0] > 2 * 50
    plt.close(figure)


def test_what_differs_is_told(curves, sweeps):
    told = sh.datasets.compare(*sweeps)
    assert told.startswith(
        "stiffness               10000 N m-1\n                    ->  12000 N m-1"
    )
    tops = [one.peak_amplitude.max().item() for one in sweeps]
    assert f"change of the peak      {100 * (tops[1] / tops[0] - 1):+.3g} %" in told
    assert (
        sh.datasets.compare(sweeps[0], sweeps[0]) == "alike in problem and results, to six digits"
    )
    newer = sweeps[0].assign_attrs(symhbm_version="9.9")
    assert "->  symhbm 9.9" in sh.datasets.compare(sweeps[0], newer)
    other = sh.Model([[1.0]], [[0.6]], [[1e4]])
    same = sh.Model([[1.0]], [[0.5]], [[1e4]])
    results = [sh.solve(sh.HarmonicBalance(m, sh.forces.PointForce()), 10.0) for m in (other, same)]
    assert "matrices, forces" in sh.datasets.compare(*results)
    with pytest.raises(TypeError, match="second=3"):
        sh.datasets.compare(sweeps[0], 3)


def test_engine_orders_that_meet_one_mode_are_read_beside_each_other():
    sheet = sh.Model([[1, 0], [0, 0.0]], [[0.1, 0], [0, 0.0]], [[3e4, -2e4], [-2e4, 2e4]])
    disk = sh.Sector(sheet, [0], [1], 24)
    lines = sh.campbell(disk, [60, 900], orders=[5, 7, 17, 19], count=1)
    figure = sh.plot.interference(lines)
    figure.canvas.draw()
    labels = [text.get_window_extent() for text in figure.axes[0].texts]
    assert len(labels) == 4
    assert not any(one.overlaps(other) for one, other in combinations(labels, 2))
