"""Marks of events along curves."""

from typing import Any

import numpy as np
import xarray as xr

from symhbm.plot.picture import Panel
from symhbm.results import Description

OF_EVENTS = {
    "fold": "s",
    "branch point": "D",
    "damping turns": "D",
    "phase resonance": "<",
    "period doubling": "v",
    "Neimark-Sacker": "P",
    "symmetry breaking": "X",
    "change of stability": "X",
}
MARKERS = {"smooth": "o", "corner": "^"} | OF_EVENTS
"""Marks of peaks and events of curves; those of contacts are circles."""
MARK: Any = dict(linestyle="", markeredgecolor="black", markeredgewidth=0.6, markersize=4.5)
"""Look of all marks."""
FIRST_HARMONIC = "amplitude of the first harmonic [m]"


def mark_events(panel: Panel, curve: xr.Dataset, name: str, color: Any) -> None:
    """Mark the events of one curve over what moves."""
    moves = Description(curve).moving
    if "event_kind" not in curve.variables or f"event_{name}" not in curve.variables:
        return
    kinds = curve["event_kind"].values.astype(str)
    for kind in np.unique(kinds[kinds != ""]):
        x, y = (curve[f"event_{of}"].values[kinds == kind] for of in (moves, name))
        look = MARK | dict(markerfacecolor=color, marker=OF_EVENTS.get(kind, "o"), zorder=3)
        panel.line(x, y, **look)
