"""How many samples pass where: shares of an ensemble in the cells of a picture."""

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import ListedColormap

from symhbm.numerics import FloatArray
from symhbm.plot.drawing import Scale
from symhbm.plot.picture import Colours, Panel

_COLUMNS, _ROWS = 300, 200
"""Cells of a picture."""
_GREYS = ListedColormap(colormaps["Greys"](np.linspace(0.18, 0.85, 256)))
_STEP = 0.4
"""Largest step along a curve, in cells: none that a curve passes is missed but at a corner."""

Curve = tuple[FloatArray, FloatArray]


def draw_density(panel: Panel, curves: Sequence[Curve], scale: Scale, *, joined: bool) -> None:
    """Shade each cell by the share of the curves that pass it, each counted once.

    ``curves`` are values (n,) and amplitudes [m], (n,) or (n, n_solutions), whose points are
    ``joined`` by straight lines or not.
    """
    across = np.log if panel.x.log else np.asarray
    upward = np.log if panel.y.log else np.asarray
    shown = [(across(value), upward(scale.of(amplitude))) for value, amplitude in curves]
    x, y = (_edges([curve[i] for curve in shown], n) for i, n in ((0, _COLUMNS), (1, _ROWS)))
    count = np.zeros((_ROWS, _COLUMNS), dtype=int)
    for value, level in shown:
        column = (value - x[0]) / (x[1] - x[0])
        row = (level - y[0]) / (y[1] - y[0])
        passed = np.zeros(count.shape, dtype=bool)
        for one in row.reshape(len(column), -1).T:
            at = _along(column, one) if joined else np.stack([column, one])
            at = at[:, np.isfinite(at).all(axis=0)].astype(int)
            passed[np.clip(at[1], 0, _ROWS - 1), np.clip(at[0], 0, _COLUMNS - 1)] = True
        count += passed
    n = len(curves)
    share = np.where(count > 0, count / n, np.nan)
    ends = min(1 / n, 0.99), 1.0
    panel.bar = Colours(_GREYS, *ends, True, f"share of {n} samples that pass", percent=True)
    edges = np.exp(x) if panel.x.log else x, np.exp(y) if panel.y.log else y
    panel.add("cells", *edges, share, panel.bar)


def _edges(parts: Sequence[FloatArray], number: int) -> FloatArray:
    """Edges (number + 1,) of cells from the smallest to the largest of all finite numbers."""
    every = np.concatenate([part.ravel() for part in parts])
    every = every[np.isfinite(every)]
    low, high = every.min(), every.max()
    room = 1e-9 * max(abs(low), abs(high)) if high == low else 0.0
    return np.linspace(low - room, high + room, number + 1)


def _along(column: FloatArray, row: FloatArray) -> FloatArray:
    """Points (2, n) of a polyline in cells, not farther apart than a step."""
    points = np.stack([column, row])
    step = np.abs(np.diff(points)).max(axis=0)
    pieces = np.where(np.isfinite(step), np.ceil(step / _STEP), 1).astype(int).clip(1)
    segment = np.repeat(np.arange(len(pieces)), pieces)
    inside = np.arange(len(segment)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    share = inside / pieces[segment]
    between = points[:, segment] + share * np.diff(points)[:, segment]
    return np.concatenate([between, points[:, -1:]], axis=1)
