"""Pictures as pages hold them: axes and items of a panel, with packed numbers."""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.colors import to_hex

from symhbm.plot.picture import Axis, Item, Panel
from symhbm.plot.viewer.packing import packed, plain

_DRAWN = ("line", "band", "entry")
"""Kinds of items that scripts of a page draw."""
_DASHES = {"-": "solid", "--": "dash", ":": "dot", "": ""}
_LONGEST = 300


def as_json(panel: Panel, names: Sequence[str] = ()) -> dict[str, Any]:
    """A panel for the scripts of a page; ``names`` are those of the points of its first item."""
    items = [_item(item) for item in panel.items if item.kind in _DRAWN]
    if names:
        items[0]["names"] = [*names]
    return {"x": _axis(panel.x), "y": _axis(panel.y), "items": items}


def _axis(axis: Axis) -> dict[str, Any]:
    # Symbols are set by Matplotlib alone.
    label = re.sub(r" ?\$[^$]*\$", "", plain(axis.label, _LONGEST))
    return {"label": label, "log": axis.log, "limits": axis.limits}


def _item(item: Item) -> dict[str, Any]:
    look, style = item.look, item.look.get("linestyle", "-")
    dash = _DASHES.get(style, "dash") if isinstance(style, str) else "dash"
    found = {"kind": item.kind, "label": plain(item.label, _LONGEST), "dash": dash}
    found |= {key: look[key] for key in ("marker", "linewidth", "drawstyle") if key in look}
    color = look.get("color", "black")
    # Black and greys are those of the page, by day and by night.
    is_grey = isinstance(color, str) and (color == "black" or color[:2] == "0.")
    found["color"] = color if is_grey else to_hex(color)
    parts = np.broadcast_arrays(*(np.asarray(part, dtype=float).T for part in item.data))
    return found | {"data": [packed(part.ravel()) for part in parts]}
