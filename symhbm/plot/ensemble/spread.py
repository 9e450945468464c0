"""The curves of many samples on common values, and how many of them pass where."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.colors import ListedColormap

from symhbm.numerics import FloatArray
from symhbm.plot.curves import shown_amplitude, traced
from symhbm.plot.drawing import Moving, Scale, is_wide
from symhbm.plot.picture import Colours, Panel
from symhbm.plot.places import Chosen

N_VALUES = 1201
"""Values of the common grid of paths: more than a figure has pixels."""
_SEVERAL = 1e-9
"""Relative distance from which two responses at a value are two."""


class Spread(NamedTuple):
    """Responses of samples on common values (n,).

    ``low`` and ``high`` (n_samples, n) are the smallest and the largest response [m] of each sample
    at each value, which differ where it has several, NaN where it has none. ``curves`` are the
    values and amplitudes [m] of each sample along its curve, or of all its solutions.
    """

    value: FloatArray
    low: FloatArray
    high: FloatArray
    curves: list[tuple[FloatArray, FloatArray]]

    @property
    def several(self) -> np.ndarray:
        """Which samples have several responses at which values, (n_samples, n)."""
        return self.high > (1 + _SEVERAL) * self.low


def spread_of(dataset: xr.Dataset, parameter: Moving, where: Chosen) -> Spread:
    """The responses of an ensemble: at the values of its grid, or its paths read off a fine one."""
    if parameter.along != "point":
        return _of_grid(dataset, parameter, where)
    every = dataset[parameter.name].values
    ends = np.nanmin(every), np.nanmax(every)
    wide = parameter.name != "frequency" and is_wide(every[np.isfinite(every)])
    value = (np.geomspace if wide else np.linspace)(*ends, N_VALUES)
    low, high = (np.full((dataset.sizes["sample"], N_VALUES), np.nan) for _ in range(2))
    curves = []
    for i in range(dataset.sizes["sample"]):
        line = traced(dataset.isel(sample=i), parameter, where).line
        if line.is_function:
            low[i] = high[i] = line.read(value)
            curves.append((value, high[i]))
        else:
            along, level, _ = line.polyline()
            low[i], high[i] = _extremes(along, level, value)
            curves.append((along, 10 ** (level / 20)))
    return Spread(value, low, high, curves)


def _of_grid(dataset: xr.Dataset, parameter: Moving, where: Chosen) -> Spread:
    amplitude = shown_amplitude(dataset, where)
    if "solution" not in amplitude.dims:
        amplitude = amplitude.expand_dims("solution")
    values = amplitude.transpose("sample", parameter.along, "solution").values
    unknown = np.isnan(values)
    low = np.where(unknown, np.inf, values).min(axis=2)
    high = np.where(unknown, -np.inf, values).max(axis=2)
    low, high = (np.where(unknown.all(axis=2), np.nan, one) for one in (low, high))
    value = dataset[parameter.name].values
    rows = values if values.shape[2] > 1 else values[:, :, 0]
    curves = [(value, row) for row in rows]
    return Spread(value, low, high, curves)


def _extremes(
    along: FloatArray, level: FloatArray, value: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The smallest and the largest amplitude [m] of a polyline at ascending values."""
    low, high = np.full(len(value), np.inf), np.full(len(value), -np.inf)
    begin, end = along[:-1], along[1:]
    first = np.searchsorted(value, np.minimum(begin, end))
    count = np.searchsorted(value, np.maximum(begin, end), "right") - first
    count[np.isnan(level[:-1]) | np.isnan(level[1:])] = 0
    segment = np.repeat(np.arange(len(count)), count)
    at = first[segment] + np.arange(len(segment)) - np.repeat(np.cumsum(count) - count, count)
    width = end[segment] - begin[segment]
    share = (value[at] - begin[segment]) / np.where(width == 0, 1.0, width)
    between = level[segment] + share * (level[segment + 1] - level[segment])
    np.minimum.at(low, at, between)
    np.maximum.at(high, at, between)
    none = high < low
    low, high = (np.where(none, np.nan, 10 ** (one / 20)) for one in (low, high))
    return low, high


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
