"""Pictures drawn by Matplotlib."""

import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from weakref import WeakKeyDictionary

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyBboxPatch, Patch
from matplotlib.ticker import LogFormatter, MaxNLocator, PercentFormatter
from matplotlib.transforms import offset_copy

from symhbm.numerics import FloatArray, check
from symhbm.plot.figures import STYLE, Size, canvas
from symhbm.plot.picture import Axis, Colours, Panel, Picture

MOST_POINTS = 40_000
"""Most points of the lines of axes that SVG and PDF hold as lines, some 7 to 25 bytes each."""
_OUTSIDE: Any = dict(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
_BELOW: Any = dict(loc="upper center", bbox_to_anchor=(0.5, 0.0), borderaxespad=0.0)
_LETTER = 0.5
"""Width of a letter over the size of the font."""
_GAP = 4
"""Distance of a legend below from the axes and their texts [points]."""
_SHARE, _PADS = 0.7, 0.04
"""Share of the width that axes keep beside a legend, else it stands below; that of gaps."""
_RESULTS: WeakKeyDictionary[Axes, int] = WeakKeyDictionary()
"""Results that were drawn into axes."""


def n_results(ax: Any) -> int:
    """How many results were drawn into axes."""
    return _RESULTS.get(ax, 0) if isinstance(ax, Axes) else 0


def drawn(picture: Picture, ax: Axes | None = None, size: Size | None = None) -> Figure:
    """Draw a picture into axes, by default into a new figure, and return the figure."""
    with _canvas(ax, picture, size) as whole:
        _RESULTS[whole] = n_results(whole) + picture.results
        if len(picture.panels) == 1:
            parts, handles = [whole], [_draw(whole, picture.panels[0])]
        else:
            whole.set_axis_off()
            parts, handles = list[Any](), list[dict[str, Any]]()
            for panel in picture.panels:
                low, height = panel.place
                shared = parts[0] if parts else None
                parts.append(whole.inset_axes((0, low, 1, height), sharex=shared))
                handles.append(_draw(parts[-1], panel))
            for part in parts[:-1]:
                part.tick_params(labelbottom=False)
        for part, panel, named in zip(parts, picture.panels, handles, strict=True):
            taken = _put_legend(part, parts[-1], panel, named) / len(parts)
            _wrap_label(part, part.bbox.height - taken)
        _bound_points(whole)
    return _figure_of(whole)


@contextmanager
def _canvas(ax: Axes | None, picture: Picture, size: Size | None) -> Iterator[Axes]:
    """Axes to draw into, in the style of the library, by default of a figure of `panels`."""
    if ax is not None and not isinstance(ax, Axes):
        raise TypeError(f"ax={check.shown(ax)}: expected matplotlib Axes or None")
    if picture.alone and ax is not None and (ax.has_data() or ax.child_axes):
        raise ValueError(
            f"ax={check.shown(ax)}: expected axes without a picture, this one needs their whole "
            "place; give others, as of matplotlib.pyplot.subplots, or none"
        )
    if ax is not None and size is not None:
        raise ValueError(f"size={check.shown(size)}: expected None, axes have their size")
    if ax is None:
        with canvas(1, 1, size, picture.size) as (_, own):
            yield own
    else:
        with plt.rc_context(STYLE):
            yield ax


def _bound_points(ax: Any) -> None:
    """Where lines have many points, SVG and PDF hold them as pixels."""
    lines = [line for part in (ax, *ax.child_axes) for line in part.lines]
    if sum(len(line.get_xdata(orig=False)) for line in lines) > MOST_POINTS:
        for line in lines:
            line.set_rasterized(True)


def _figure_of(ax: Axes) -> Figure:
    """Figure that holds the axes, also those of a part of it."""
    figure = ax.get_figure()
    while figure is not None and not isinstance(figure, Figure):
        figure = figure.figure
    assert figure is not None
    return figure


def _draw(ax: Any, panel: Panel) -> dict[str, Any]:
    """Draw one panel and return what its legend names, by the names."""
    if panel.even:
        ax.set_aspect("equal", adjustable=panel.even)
    for which, axis in (("x", panel.x), ("y", panel.y)):
        if axis.room is not None:
            ax.margins(**{which: axis.room})
        if not axis.sticky:
            ax.use_sticky_edges = False
        if not axis.grid:
            ax.grid(False, axis=which)
    handles: dict[str, Any] = {}
    for item in panel.items:
        artist = _KINDS[item.kind](ax, *item.data, **item.look)
        if item.label:
            artist.set_label(item.label)
            handles.setdefault(item.label, artist)
    ax.autoscale_view()
    for which, axis in (("x", panel.x), ("y", panel.y)):
        _put(ax, which, axis)
    if panel.title:
        ax.set_title(panel.title, fontsize=panel.title_size)
    if panel.bare:
        ax.set_axis_off()
    ax.spines[:].set_visible(False) if not panel.framed else None
    if panel.bar is not None:
        _colorbar(ax, panel.bar)
    return handles


def _wrap_label(ax: Any, height: float) -> None:
    """Break the label of an axis that is longer than the axes are high [pixels]."""
    label = ax.yaxis.label
    letters = height * 72 / _figure_of(ax).dpi / (_LETTER * label.get_fontsize())
    words, bracket, unit = label.get_text().partition(" [")
    if len(words) + len(unit) > letters and "$" not in words:
        joined = unit.replace(" ", "\N{NO-BREAK SPACE}")
        label.set_text(textwrap.fill(f"{words}{bracket}{joined}", max(12, int(letters))))


def _put_legend(ax: Any, lowest: Any, panel: Panel, handles: dict[str, Any]) -> float:
    """Draw a legend, with what one before names, beside the axes, or below if they are narrow.

    Returns the height that it takes from them [pixels].
    """
    if not (handles and panel.legend_at):
        return 0.0
    if (old := ax.get_legend()) is not None:
        texts = (text.get_text() for text in old.get_texts())
        handles = dict(zip(texts, old.legend_handles, strict=True)) | handles
    options: Any = dict(handles=[*handles.values()], labels=[*handles]) | panel.legend
    if panel.legend_at == "best":
        ax.legend(**options)
        return 0.0
    figure = _figure_of(ax)
    whole = figure.bbox.width
    if (place := (ax if ax.get_subplotspec() else lowest.axes).get_subplotspec()) is not None:
        whole *= len(place.colspan) / place.get_gridspec().ncols
    if panel.legend_at == "outside":
        legend = ax.legend(**_OUTSIDE | options)
        texts = [ax.yaxis.get_tightbbox(), legend.get_window_extent()]
        if whole - sum(text.width for text in texts if text) >= (_SHARE + _PADS) * whole:
            return 0.0
    options.pop("bbox_to_anchor", None)
    texts = lowest.xaxis.get_tightbbox()
    room = (lowest.bbox.y0 - texts.y0) * 72 / figure.dpi if texts else 0.0
    options |= {
        "bbox_transform": offset_copy(lowest.transAxes, figure, y=-room - _GAP, units="points")
    }
    for columns in range(len(handles), 0, -1):
        legend = ax.legend(**_BELOW | options, ncols=columns)
        if legend.get_window_extent().width <= whole:
            break
    return ax.get_legend().get_window_extent().height


def _put(ax: Any, which: str, axis: Axis) -> None:
    """Label, scale, limits and ticks of one axis."""
    own: Any = ax.xaxis if which == "x" else ax.yaxis
    if axis.label:
        own.set_label_text(axis.label, fontsize=axis.size)
    if axis.log:
        getattr(ax, f"set_{which}scale")("log")
    if axis.limits is not None:
        getattr(ax, f"set_{which}lim")(*axis.limits)
    if axis.whole:
        own.set_major_locator(MaxNLocator(integer=True))
    if axis.ticks is not None:
        own.set_ticks(*axis.ticks)
    if axis.tick_size is not None:
        own.set_tick_params(labelsize=axis.tick_size)
    if not axis.marks:
        own.set_tick_params(length=0)


def _colorbar(ax: Axes, colours: Colours) -> None:
    """Colour bar beside axes; logarithmic ones show digits within a decade, too."""
    bar = _figure_of(ax).colorbar(colours.scale, ax=ax, label=colours.label)
    axis: Any = bar.ax.yaxis
    if colours.percent:
        axis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
        axis.set_minor_formatter(lambda *_: "")
    elif colours.log:
        axis.set_minor_formatter(LogFormatter(minor_thresholds=(1.5, 0.5)))
    bar.outline.set_visible(False)  # type: ignore[operator]
    bar.ax.grid(False)


def _text(ax: Axes, at: Any, text: str, **look: Any) -> Any:
    offset = look.pop("offset", None)
    if offset is None:
        return ax.text(at[0], at[1], text, **look)
    return ax.annotate(text, at, offset, textcoords="offset points", **look)


def _arrow(ax: Axes, start: Any, end: Any, **look: Any) -> Any:
    ax.update_datalim([start, end])
    return ax.annotate("", end, start, arrowprops=look, zorder=6)


def _entry(_: Axes, **look: Any) -> Any:
    if "facecolor" in look:
        return Patch(color=look["facecolor"])
    return Line2D([], [], **look)


def _dots(ax: Axes, x: FloatArray, y: FloatArray, chosen: np.ndarray, **look: Any) -> Any:
    """Some of several points, of a size that leaves neighbours apart."""
    from scipy.spatial import KDTree  # slow to import

    ax.plot(x, y, linestyle="none")  # limits, which tell how large a dot is
    pixels, dots = ax.transData.transform(np.column_stack([x, y])), 24.0
    if len(x) > 1:
        nearest = KDTree(pixels).query(pixels, 2)[0][:, 1]
        dots = 0.6 * np.median(72 / _figure_of(ax).dpi * nearest)
    size = float(np.clip(dots, 3.0, 24.0) ** 2)
    return ax.scatter(x[chosen], y[chosen], s=size, **look)


def _cells(ax: Axes, x: FloatArray, y: FloatArray, values: FloatArray, colours: Colours) -> Any:
    shown, scale = np.ma.masked_invalid(values), colours.scale
    norm: Any = scale.norm
    return ax.pcolormesh(x, y, shown, norm=norm, cmap=scale.cmap, rasterized=True)


_KINDS: dict[str, Callable[..., Any]] = {
    "line": lambda ax, x, y, **look: ax.plot(x, y, **look)[0],
    "band": Axes.fill_between,
    "bars": lambda ax, x, low, high, **look: ax.bar(x, high - low, bottom=low, **look),
    "cells": _cells,
    "dots": _dots,
    "upright": Axes.axvline,
    "level": Axes.axhline,
    "segments": lambda ax, lines, **look: ax.add_collection(LineCollection([*lines], **look)),
    "areas": lambda ax, areas, **look: ax.add_collection(PolyCollection([*areas], **look)),
    "circle": lambda ax, at, radius, **look: ax.add_patch(Circle(at, radius, **look)),
    "box": lambda ax, *box, **look: ax.add_patch(FancyBboxPatch(*box, **look)),
    "text": _text,
    "arrow": _arrow,
    "entry": _entry,
    "room": Axes.update_datalim,
    "ground": lambda ax, **look: ax.patch.set(**look),
}
"""How each kind of item is drawn."""
