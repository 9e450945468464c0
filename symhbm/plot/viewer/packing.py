"""What a page holds: numbers as base64, short texts without controls, pictures, few points.

Curves are thinned so that straight lines between the points that are left stay close to them.
"""

import base64
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.colors import to_hex
from numpy.typing import ArrayLike, NDArray

from symhbm.numerics import FloatArray
from symhbm.plot.picture import Axis, Item, Panel
from symhbm.results.reading import printable

DIGITS = 8
"""Significant digits of every number that a page shows of an archive."""
_LONGEST = 160
"""Most characters of a text that comes from an archive."""


def packed(values: ArrayLike, kind: str = "f8") -> str:
    """An array as text, with its type: ``f8``, ``f4``, ``i4`` or ``i1``."""
    array = np.ascontiguousarray(values, dtype=f"<{kind}")
    return f"{kind}:{base64.b64encode(array.tobytes()).decode('ascii')}"


def plain(value: Any, longest: int = _LONGEST) -> str:
    """A text in one line, without control characters and not too long."""
    text = value if isinstance(value, str) else str(value)
    line = " ".join(printable(text[: 4 * longest]).split())
    more = len(line) > longest or len(text) > 4 * longest
    return f"{line[:longest]} ..." if more else line


def number(value: Any) -> str:
    """A number to as many digits as a page shows, other things as text."""
    if isinstance(value, (float, np.floating)):
        return f"{float(value):.{DIGITS}g}"
    return plain(value)


def with_units(value: Any, units: Any) -> str:
    """A number and its unit."""
    return number(value) if units in ("1", "", None) else f"{number(value)} {plain(units, 40)}"


_DRAWN = ("line", "band", "entry")
"""Kinds of items that scripts of a page draw."""
_DASHES = {"-": "solid", "--": "dash", ":": "dot", "": ""}
_LONGEST_LABEL = 300


def as_json(panel: Panel, names: Sequence[str] = ()) -> dict[str, Any]:
    """A panel for the scripts of a page; ``names`` are those of the points of its first item."""
    items = [_item(item) for item in panel.items if item.kind in _DRAWN]
    if names:
        items[0]["names"] = [*names]
    return {"x": _axis(panel.x), "y": _axis(panel.y), "items": items}


def _axis(axis: Axis) -> dict[str, Any]:
    # Symbols are set by Matplotlib alone.
    label = re.sub(r" ?\$[^$]*\$", "", plain(axis.label, _LONGEST_LABEL))
    return {"label": label, "log": axis.log, "limits": axis.limits}


def _item(item: Item) -> dict[str, Any]:
    look, style = item.look, item.look.get("linestyle", "-")
    dash = _DASHES.get(style, "dash") if isinstance(style, str) else "dash"
    found = {"kind": item.kind, "label": plain(item.label, _LONGEST_LABEL), "dash": dash}
    found |= {key: look[key] for key in ("marker", "linewidth", "drawstyle") if key in look}
    color = look.get("color", "black")
    # Black and greys are those of the page, by day and by night.
    is_grey = isinstance(color, str) and (color == "black" or color[:2] == "0.")
    found["color"] = color if is_grey else to_hex(color)
    parts = np.broadcast_arrays(*(np.asarray(part, dtype=float).T for part in item.data))
    return found | {"data": [packed(part.ravel()) for part in parts]}


_FIRST = 1e-3
"""The distance that a point may have from the line of its neighbours to be left out first [dB]."""


def thinned(
    value: FloatArray, level: FloatArray, kept: NDArray[np.bool_], most: int, tolerance: float = 0.0
) -> NDArray[np.intp]:
    """Numbers of the points that stay, in order: the ends, those ``kept``, and what bends the most.

    ``value`` (n,) along the curve, ``level`` (n, m) [dB] over it. Points that lie the closest to
    the straight line of their neighbours go first, until no more than ``most`` stay; beyond that,
    as many go as leave the line within about the ``tolerance`` of the curve. Those kept stay,
    however many they are, and so do the neighbours of gaps.
    """
    points = np.arange(len(value))
    stay = kept.copy()
    stay[:1] = stay[-1:] = True
    distance, left_over = min(_FIRST, tolerance or _FIRST) / 2, tolerance
    odd = 1
    idle = 0
    while idle < 2 and (len(points) > most or distance <= left_over):
        inner = points[1:-1]
        before, after = points[:-2], points[2:]
        width = value[after] - value[before]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(width != 0, (value[inner] - value[before]) / width, 0.5)
            straight = level[before] + share[:, None] * (level[after] - level[before])
            away = np.abs(level[inner] - straight).max(axis=1, initial=0.0)
        # Of two neighbours one stays, so that distances do not add up within a pass.
        gone = (away <= distance) & ~stay[inner] & (np.arange(len(inner)) % 2 == odd)
        odd = 1 - odd
        removable = (~stay[inner] & np.isfinite(away)).any()
        idle = 0 if removable else idle + 1
        points = points[np.concatenate([[True], ~gone, [True]])] if len(points) > 2 else points
        if not odd:
            left_over -= distance
            distance *= 1.5
    return points
