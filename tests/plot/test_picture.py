"""A picture is data: what makes it knows no renderer, and both renderers draw it."""

import json

import matplotlib.pyplot as plt
import numpy as np
import pytest

import symhbm as sh
from symhbm.cli.selection import kinds
from symhbm.plot.looks import pictured
from symhbm.plot.picture import Axis, Colours, Panel, Picture
from symhbm.plot.viewer.packing import as_json
from symhbm.plot.viewer.page import embedded
from tests.paper import texts
from tests.plot.viewer.test_view import response, unpacked


@pictured
def square(values: np.ndarray, *, ax: plt.Axes | None = None) -> Picture:
    """Draw squares: a kind of picture is one function."""
    panel = Panel(Axis("value $x$ [m]", room=0.0), Axis("square", log=True))
    panel.band(values, values**2 / 2, values**2, "within", color="0.87")
    panel.line(values, values**2, "squares", color="#0072b2", linestyle="--")
    panel.bar = Colours("viridis", 0.0, 1.0, label="nothing")
    return Picture([panel])


def test_a_new_kind_is_drawn_by_matplotlib():
    values = np.arange(1.0, 5.0)
    figure = square(values)
    ax, bar = figure.axes
    assert (ax.get_xlabel(), ax.get_ylabel(), ax.get_yscale()) == ("value $x$ [m]", "square", "log")
    np.testing.assert_array_equal(ax.lines[0].get_xydata(), np.stack([values, values**2], axis=1))
    assert texts(ax) == ["within", "squares"]
    assert bar.get_ylabel() == "nothing"
    own, axes = plt.subplots()
    assert square(values, ax=axes) is own
    with pytest.raises(TypeError, match="ax=3: expected matplotlib Axes"):
        square(values, ax=3)  # type: ignore[arg-type]


def test_a_new_kind_is_drawn_by_pages():
    values = np.arange(1.0, 5.0)
    page = json.loads(embedded(as_json(square.picture(values).panels[0], names="abcd")))
    assert page["x"] == {"label": "value [m]", "log": False, "limits": None}
    band, line = page["items"]
    assert (band["kind"], band["label"], band["color"]) == ("band", "within", "0.87")
    assert (line["kind"], line["dash"], line["color"]) == ("line", "dash", "#0072b2")
    np.testing.assert_array_equal([unpacked(part) for part in line["data"]], [values, values**2])
    assert band["names"] == ["a", "b", "c", "d"]


def test_all_kinds_give_their_data():
    for kind in kinds():
        assert callable(getattr(sh.plot, kind.replace("-", "_")).picture)
    sh.plot.response.picture(response())
    assert plt.get_fignums() == []
