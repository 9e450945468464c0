"""Figures in a notebook: one picture per cell, in a kernel that is emulated."""

import io
import sys
import types

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest
from matplotlib.backends import backend_agg
from matplotlib.figure import Figure

import symhbm as sh
from studies import fig03_single_blade as fig03

INLINE = "backend_inline"
"""Matplotlib knows the name of the real one, and asks for its package."""


@pytest.fixture(scope="module")
def response():
    return sh.frf(fig03.problem(), (10, 12), at=[10, 11, 12])


@pytest.fixture
def cell(monkeypatch):
    """What a cell shows: its value where that is a figure, then what pyplot holds at its end."""
    backend = types.ModuleType(INLINE)
    setattr(backend, "FigureCanvas", backend_agg.FigureCanvasAgg)  # noqa: B010
    monkeypatch.setitem(sys.modules, INLINE, backend)
    before = mpl.get_backend()
    mpl.use(f"module://{INLINE}")

    def shown(run) -> list[Figure]:
        value = run()
        figures = [value] if isinstance(value, Figure) else []
        figures += [plt.figure(number) for number in plt.get_fignums()]
        plt.close("all")
        for figure in figures:
            png = io.BytesIO()
            figure.canvas.print_figure(png, format="png", bbox_inches="tight")
            assert png.getvalue().startswith(b"\x89PNG")
        return figures

    yield shown
    plt.close("all")
    mpl.use(before)


def test_a_cell_shows_its_figure_once(cell, response):
    assert len(cell(lambda: sh.plot.response(response))) == 1
    assert len(cell(lambda: sh.plot.model(fig03.problem()))) == 1
    assert cell(lambda: None) == []


def test_a_figure_of_the_caller_stays_with_pyplot(cell, response):
    def run():
        _, ax = plt.subplots()
        sh.plot.response(response, ax=ax)

    assert len(cell(run)) == 1


def test_scripts_show_figures_by_pyplot(response):
    """``plt.show()`` opens the windows of the figures that pyplot holds."""
    figure = sh.plot.response(response)
    assert [plt.figure(number) for number in plt.get_fignums()] == [figure]
