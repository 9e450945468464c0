"""Marks of peaks and events along curves, and of where curves end before they are complete."""

from typing import Any

import numpy as np
import xarray as xr

from symhbm.numerics import FloatArray
from symhbm.plot.picture import Panel
from symhbm.results import Description
from symhbm.results.reading import COMPLETE

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
_NEAR = 1e-6
"""Relative distance from an end of a band within which a path has reached it."""
_END: Any = dict(linestyle="", marker="x", color="tab:red", markersize=7, markeredgewidth=1.6)


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


def mark_ends(panel: Panel, curve: xr.Dataset, name: str, shown: FloatArray) -> None:
    """Mark the points beside which a curve over the parameter ``name`` is missing.

    ``shown`` (n,) is what is drawn at its points, NaN where there is nothing. Of a path that is the
    last one, unless it is at an end of the band; on a grid those beside values without a solution.
    """
    value = curve[name].values
    found = np.isfinite(value) & np.isfinite(shown)
    if is_complete(curve) or not found.any():
        return
    if "point" in curve[name].dims:
        last = np.flatnonzero(found)[-1:]
        ends = last[~at_an_end(value[last], Description(curve).band)]
    else:
        ends = beside_missing(found)
    draw_ends(panel, value[ends], shown[ends])


def draw_ends(panel: Panel, value: FloatArray, shown: FloatArray) -> None:
    """Mark points (n,) at which something ends that is not complete."""
    if len(value):
        panel.line(value, shown, "incomplete, ends here", zorder=4, clip_on=False, **_END)


def is_complete(curve: xr.Dataset) -> bool:
    """Whether nothing is missing of a curve, as its status says, or it has none."""
    known = "status" in curve.variables and not curve["status"].ndim
    return not known or str(curve["status"].values) in [*map(str, COMPLETE)]


def beside_missing(found: np.ndarray) -> np.ndarray:
    """Numbers of the points that are found and have a neighbour that is not."""
    padded = np.concatenate([[True], found, [True]])
    return np.flatnonzero(found & ~(padded[:-2] & padded[2:]))


def at_an_end(value: FloatArray, band: Any) -> np.ndarray:
    """Whether values (n,) are ends of a band; False where the band is unknown."""
    ends = np.array(band if band is not None else (np.nan, np.nan), dtype=float)
    return (np.abs(value[:, None] - ends) <= _NEAR * np.abs(ends).max()).any(axis=1)
