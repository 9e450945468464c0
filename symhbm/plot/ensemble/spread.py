"""The curves of many samples on common values, also where a sample has several responses."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

from symhbm.numerics import FloatArray
from symhbm.plot.curves import shown_amplitude, traced
from symhbm.plot.drawing import Moving, is_wide
from symhbm.plot.lines import Line
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
    for i, line in enumerate(_lines(dataset, parameter, where)):
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


def _lines(dataset: xr.Dataset, parameter: Moving, where: Chosen) -> Iterator[Line]:
    for i in range(dataset.sizes["sample"]):
        yield traced(dataset.isel(sample=i), parameter, where).line


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
