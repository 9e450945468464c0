"""What all pictures take: names of several results, a legend or none, a size, axes."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from typing import Any, Concatenate, ParamSpec, Protocol, TypedDict, get_type_hints

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.figure import Figure

from symhbm.numerics import check
from symhbm.plot.drawing import LINE_STYLES
from symhbm.plot.figures import Size
from symhbm.plot.picture import FAMILY, Axis, Panel, Picture
from symhbm.plot.rendering import drawn, n_results
from symhbm.results.telling import differences

Results = xr.Dataset | Mapping[str, xr.Dataset] | Sequence[xr.Dataset]
"""A result, several by their names, or a sequence of them."""
HUES = ("#000000", "#d55e00", "#0072b2", "#009e73", "#cc79a7", "#8c6d1f")
"""Colours of results, one after the other."""
_LIGHTEST = 0.65
"""Share of white in the lightest colour of a family."""
_LONGEST_TITLE = 80
_P = ParamSpec("_P")


class Look(TypedDict, total=False):
    """What all pictures take."""

    legend: bool
    size: Size | None
    ax: Axes | None


class Named(Look, total=False):
    """What pictures of one result or several take."""

    label: str | Sequence[str] | None


_DEFAULTS: dict[str, Any] = {"label": None, "legend": True, "size": None, "ax": None}
_TOLD = {
    "label": "Name of the result in the legend, or names of a sequence of results. Several results"
    "\n        may also come by their names, ``{name: result}``; what is drawn into the same axes "
    "later\n        goes on with colours and styles.",
    "legend": "Whether there is a legend.",
    "size": 'Width and height of a new figure [inch], or ``"column"`` or ``"page"``, as wide as a'
    "\n        column or a page of a journal.",
    "ax": "Axes to draw into, of several panels without another picture; by default a new figure.",
}
"""What they are, for docstrings, which have them where it says common."""


class Drawing(Protocol[_P]):
    """A function that draws pictures; ``picture`` makes the same as data."""

    picture: Callable[_P, Picture]

    def __call__(self, *args: _P.args, **options: _P.kwargs) -> Figure:
        """Draw into ``ax``, by default into a new figure."""
        ...


def pictured(make: Callable[_P, Picture], look: type = Look) -> Drawing[_P]:
    """Draw the picture that a function makes into its ``ax``, by default into a new figure."""
    signature, hints = inspect.signature(make), get_type_hints(look)
    named = [name for name in _DEFAULTS if name in hints]
    every = signature.parameters.values()
    takes_all = any(one.kind is one.VAR_KEYWORD for one in every)
    own = [one for one in every if one.kind is not one.VAR_KEYWORD and one.name not in named]
    keyword = inspect.Parameter.KEYWORD_ONLY
    own += [
        inspect.Parameter(name, keyword, default=_DEFAULTS[name], annotation=hints[name])
        for name in named
    ]
    whole = signature.replace(parameters=own, return_annotation=Figure)

    @wraps(make)
    def draw(*args: _P.args, **options: _P.kwargs) -> Figure:
        check.keywords(options, whole.parameters, make.__name__)
        whole.bind(*args, **options)
        given: dict[str, Any] = _DEFAULTS | options
        known: Any = [n for n in options if takes_all or n in signature.parameters]
        picture = make(*args, **{name: options[name] for name in known})  # type: ignore
        if not check.flag("legend", given["legend"]):
            for panel in picture.panels:
                panel.legend_at = ""
        return drawn(picture, given["ax"], given["size"])

    drawing: Any = draw
    drawing.picture = make
    drawing.__signature__ = whole
    told = "".join(f"    {name}\n        {_TOLD[name]}\n" for name in named)
    drawing.__doc__ = (make.__doc__ or "").replace(
        "    common\n        As of all pictures.\n", told
    )
    return drawing


def compared(
    make: Callable[Concatenate[xr.Dataset, _P], Picture],
) -> Drawing[Concatenate[Results, _P]]:
    """The same of a function whose pictures of several results are one."""

    @wraps(make)
    def of_several(results: Results, *args: _P.args, **options: _P.kwargs) -> Picture:
        given: dict[str, Any] = _DEFAULTS | options
        of = _named(results, given["label"])
        pictures = [(name, make(one, *args, **options)) for name, one in of]
        before = n_results(given["ax"])
        if len(of) == 1 and not before and not of[0][0]:
            return pictures[0][1]
        picture = _together(pictures, before)
        if len(of) == 2:
            title = picture.panels[0].title
            told = "; ".join(filter(None, [title, *differences(*(one for _, one in of))]))
            picture.panels[0].title = told if len(told) <= _LONGEST_TITLE else title
        return picture

    of: Any = of_several
    signature = inspect.signature(make)
    first, *others = signature.parameters.values()
    of.__signature__ = signature.replace(parameters=[first.replace(annotation=Results), *others])
    return pictured(of, Named)


def _named(results: Any, label: Any) -> list[tuple[str, xr.Dataset]]:
    """Results and their names, of which one alone may have none."""
    if isinstance(results, Mapping) and not isinstance(results, xr.Dataset):
        if label is not None:
            raise ValueError(f"label={check.shown(label)}: expected None, the results have names")
        found = [(str(name), one) for name, one in results.items()]
    elif isinstance(results, (list, tuple)):
        names = [*map(str, range(1, len(results) + 1))] if label is None else label
        if isinstance(names, str) or len(names) != len(results):
            raise ValueError(
                f"label={check.shown(label)}: expected {len(results)} names, one per result"
            )
        found = [*zip(map(str, names), results, strict=True)]
    else:
        found = [("" if label is None else check.text("label", label), results)]
    if not found:
        raise ValueError("dataset: expected at least one result, got none")
    return found


def _together(pictures: list[tuple[str, Picture]], before: int) -> Picture:
    """One picture of several, each in colours of its own, after so many in the same axes."""
    several = len(pictures) > 1
    for number, (name, picture) in enumerate(pictures, before):
        for panel in picture.panels:
            if number or several:
                _repaint(panel, number)
        _name(picture.panels[0], name, number)
    (_, whole), *others = pictures
    for _, other in others:
        for panel, more in zip(whole.panels, other.panels, strict=True):
            for axis, of in ((panel.x, more.x), (panel.y, more.y)):
                _join(axis, of)
            if panel.bar is not None and more.bar is not None and panel.bar[1:] != more.bar[1:]:
                raise ValueError(
                    "dataset: expected sweeps over the same values, as their colours tell them; "
                    "select the same ones, or fewer than a legend names"
                )
            panel.bar = panel.bar or more.bar
            panel.items += more.items
            if more.legend_at == "outside":
                panel.legend_at, panel.legend = more.legend_at, more.legend
    whole.results = len(pictures)
    return whole


def _repaint(panel: Panel, number: int) -> None:
    """Give a panel the colours of a result, and a line without others the next style."""
    hue = np.array(to_rgb(HUES[number % len(HUES)]))

    def painted(color: Any) -> Any:
        if isinstance(color, str) or np.shape(color) != (4,):
            return color
        if not np.any(color[:3]):
            return tuple(hue)
        shades = FAMILY(np.linspace(0, 1, 256))
        nearest = int(np.abs(shades - np.asarray(color)).sum(axis=1).argmin())
        return tuple(hue + (1 - hue) * _LIGHTEST * (1 - nearest / 255))

    alone = panel.bar is None and not any(item.kind == "entry" for item in panel.items)
    for item in panel.items:
        for key in ("color", "markerfacecolor"):
            if key in item.look:
                item.look[key] = painted(item.look[key])
        if alone and item.look.get("linestyle") == LINE_STYLES[0]:
            item.look["linestyle"] = LINE_STYLES[number % len(LINE_STYLES)]
    if panel.bar is not None:
        greys = np.linspace(_LIGHTEST, 0, 256)
        panel.bar = panel.bar._replace(map=ListedColormap(np.stack([greys] * 3, axis=1)))


def _name(panel: Panel, name: str, number: int) -> None:
    """Entries of the legend that tell the name of a result."""
    if not name:
        return
    entries = [item for item in panel.items if item.kind == "entry" and item.label]
    own = [item for item in entries if not isinstance(item.look.get("color", ""), str)]
    for item in own:
        panel.items[panel.items.index(item)] = item._replace(label=f"{name}, {item.label}")
    if not own:
        style = {"linestyle": LINE_STYLES[number % len(LINE_STYLES)]} if not entries else {}
        panel.entry(name, color=HUES[number % len(HUES)], **style)
    if panel.bar is None:
        panel.legend_at, panel.legend = "outside", {"handlelength": 2.8}


def _join(axis: Axis, other: Axis) -> None:
    """One axis for what is drawn over two, of the same unit."""
    units = [one.label.partition("[")[2] for one in (axis, other)]
    if units[0] != units[1] or (axis.log != other.log and axis.label != other.label):
        raise ValueError(
            f"dataset: expected results over the same axes, got {axis.label!r} and {other.label!r}"
        )
    if axis.label != other.label and units[0]:
        axis.label = f"{axis.label.partition(' [')[0]}; {other.label}"
    axis.log |= other.log
    if axis.limits is not None and other.limits is not None:
        (low, high), (other_low, other_high) = axis.limits, other.limits
        low = None if low is None or other_low is None else min(low, other_low)
        high = None if high is None or other_high is None else max(high, other_high)
        axis.limits = low, high
