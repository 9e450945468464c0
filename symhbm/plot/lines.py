"""Lines of response curves: amplitudes with their slopes, through corners and located peaks."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

from symhbm.numerics import FloatArray, amplitude_between, largest_displacement
from symhbm.plot.drawing import Moving, decibel, motions_of
from symhbm.results import Description

_STRAIGHT = 0.002
"""Distance [dB] of the curve from a straight line from which the line is halved."""
_STRAIGHT_SHARE = 2e-4
"""The same on a linear scale, as a share of the largest amplitude."""
_MAX_HALVINGS = 8
"""Most halvings of a segment."""
_SAME = 1e-12
"""Relative distance at which two values are one."""
_TIED = 1e-9
"""Relative difference of amplitudes that peak together."""
_BESIDE = 1e-3
"""Share of a segment over which a slope is read off."""


class Peak(NamedTuple):
    """A located peak: its kind, value, amplitude [m], and the degree of freedom that peaks."""

    kind: str
    value: float
    amplitude: float
    dof: int


@dataclass(frozen=True)
class Line:
    """A curve as it is drawn, point by point in the order of its path.

    ``value`` (n,); ``amplitude`` (n, n_dof) [m], of which the largest is drawn; its derivatives by
    the value ``before`` and ``after`` each point, infinite at folds and NaN where unknown;
    ``unstable`` (n,).
    """

    value: FloatArray
    amplitude: FloatArray
    before: FloatArray
    after: FloatArray
    unstable: np.ndarray

    @property
    def is_function(self) -> bool:
        """Whether the points run one way."""
        step = np.diff(self.value)
        return bool(np.all(step >= 0) or np.all(step <= 0))

    def ascending(self) -> "Line":
        """The points of a function in ascending order, each value once."""
        line = self
        if len(self.value) and self.value[0] > self.value[-1]:
            parts = self.value, self.amplitude, self.after, self.before, self.unstable
            line = Line(*(part[::-1] for part in parts))
        value, first, count = np.unique(line.value, return_index=True, return_counts=True)
        last = first + count - 1
        sides = line.before[first], line.after[last]
        return Line(value, line.amplitude[first], *sides, line.unstable[first])

    def through(self, peaks: list[Peak]) -> "Line":
        """An ascending line with a point at each peak that lies between two of its points.

        ``dof`` of the peaks are columns of the line.
        """
        line, finite = self, [peak for peak in peaks if np.isfinite(peak.amplitude)]
        for value, together in groupby(sorted(finite, key=lambda p: p.value), lambda p: p.value):
            i = int(np.searchsorted(line.value, value))
            present = np.any(np.abs(line.value - value) <= _SAME * np.abs(value))
            if 0 < i < len(line.value) and not present:
                line = line._with(i, value, [*together])
        return line

    def _with(self, i: int, value: float, peaks: list[Peak]) -> "Line":
        """The line with a point before its point ``i``, interpolated where no peak is located."""
        width = self.value[i] - self.value[i - 1]
        share = (value - self.value[i - 1]) / width
        shares = np.clip(share + np.array([-_BESIDE, 0.0, _BESIDE]), 0.0, 1.0)
        low, amplitude, high = self._between(np.full(3, i - 1), shares)
        slope = (high - low) / ((shares[2] - shares[0]) * width)
        for peak in peaks:
            amplitude[peak.dof] = peak.amplitude
            slope[peak.dof] = 0.0 if peak.kind == "smooth" else np.nan
        unstable = self.unstable[i - 1] | self.unstable[i]
        added = value, amplitude, slope, slope, unstable
        parts = zip(vars(self).values(), added, strict=True)
        return Line(*(np.insert(part, i, new, axis=0) for part, new in parts))

    def _between(self, segment: np.ndarray, share: FloatArray) -> FloatArray:
        """Amplitudes (n, n_dof) at shares (n,) of segments (n,), numbered by their first points."""
        width = (self.value[segment + 1] - self.value[segment])[:, None]
        left, right = self.amplitude[segment], self.amplitude[segment + 1]
        first, last = width * self.after[segment], width * self.before[segment + 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            rise = np.log(right / left)
            beyond = np.where(np.isfinite(last), last / right, rise)
            first = np.where(np.isnan(first), left * _other_slope(rise, beyond), first)
            last = np.where(np.isnan(last), right * _other_slope(rise, first / left), last)
        return amplitude_between(left, right, (first, last), share[:, None])

    def read(self, value: FloatArray) -> FloatArray:
        """The largest amplitude [m] of an ascending line at other values, NaN outside of it."""
        result = np.full(len(value), np.nan)
        if len(self.value) > 1:
            inside = np.flatnonzero((value >= self.value[0]) & (value <= self.value[-1]))
            segment = np.searchsorted(self.value, value[inside], "right") - 1
            segment = np.minimum(segment, len(self.value) - 2)
            width = self.value[segment + 1] - self.value[segment]
            share = (value[inside] - self.value[segment]) / width
            result[inside] = self._between(segment, share).max(axis=1)
        return result

    def polyline(self, linear: bool = False) -> tuple[FloatArray, FloatArray, np.ndarray]:
        """Values (n,) and levels (n,) [dB] of straight lines, and which (n - 1,) are unstable.

        With ``linear``, amplitudes [m] in place of levels, straight on a linear scale.
        """
        n_segments = max(len(self.value) - 1, 0)
        shown, straight_enough = decibel, _STRAIGHT
        if linear:
            top = np.max(self.amplitude, initial=0.0, where=np.isfinite(self.amplitude))
            shown, straight_enough = np.asarray, _STRAIGHT_SHARE * top

        def level_at(segment: np.ndarray, share: FloatArray) -> FloatArray:
            return shown(self._between(segment, share).max(axis=1))

        segment = np.repeat(np.arange(n_segments), 2)
        begin = np.tile([0.0, 0.5], n_segments)
        low, high = level_at(segment, begin), level_at(segment, begin + 0.5)
        straight, length = [], 0.5
        for halving in range(_MAX_HALVINGS + 1):
            length /= 2
            middle = level_at(segment, begin + length)
            with np.errstate(invalid="ignore"):
                bent = np.abs(middle - (low + high) / 2) > straight_enough
            bent &= halving < _MAX_HALVINGS
            straight.append((segment[~bent], begin[~bent], low[~bent]))
            segment, low, middle, high = (part[bent] for part in (segment, low, middle, high))
            begin = np.concatenate([begin[bent], begin[bent] + length])
            segment, low = np.concatenate([segment, segment]), np.concatenate([low, middle])
            high = np.concatenate([middle, high])
        segment, begin, low = (np.concatenate(part) for part in zip(*straight, strict=True))
        order = np.lexsort((begin, segment))
        segment, begin, low = segment[order], begin[order], low[order]
        value = self.value[segment] + begin * (self.value[segment + 1] - self.value[segment])
        end = shown(self.amplitude[-1:].max(axis=1, initial=0.0))
        unstable = self.unstable[segment] | self.unstable[segment + 1]
        return np.append(value, self.value[-1:]), np.append(low, end), unstable


def _other_slope(rise: FloatArray, slope: FloatArray) -> FloatArray:
    """Slope at one end of a segment from that at the other: of a parabola, if it is monotone."""
    return rise * np.clip(2 - slope / np.where(rise == 0, 1.0, rise), 0.0, 2.0)


def line_of(curve: xr.Dataset, parameter: Moving, dofs: Sequence[int]) -> Line:
    """The line of one curve, of the largest of some degrees of freedom, without padding."""
    value = curve[parameter.name].values
    inside = np.isfinite(value)

    def of_points(name: str) -> FloatArray:
        values = curve[name].transpose(parameter.along, "dof").values
        return values[inside][:, [*dofs]].astype(float)

    unstable = np.zeros(int(inside.sum()), dtype=bool)
    if "stability" in curve.variables:
        unstable = curve["stability"].values[inside] == 0
    amplitude = of_points("amplitude")
    if "amplitude_slope" in curve.variables and curve["amplitude_slope"].notnull().any():
        sides = "amplitude_slope_before", "amplitude_slope"
        before, after = (of_points(name if name in curve else sides[1]) for name in sides)
        return Line(value[inside], amplitude, before, after, unstable)
    unknown = np.full(amplitude.shape, np.nan)
    line = Line(value[inside], amplitude, unknown, unknown, unstable)
    return _monotone(line.ascending()) if line.is_function else line


def _monotone(line: Line) -> Line:
    """An ascending line with the slopes that keep it monotone between its points."""
    slope = np.full(line.amplitude.shape, np.nan)
    for column, amplitude in zip(slope.T, line.amplitude.T, strict=True):
        positive = amplitude > 0
        if positive.sum() > 1:
            level = PchipInterpolator(line.value[positive], np.log(amplitude[positive]))
            column[positive] = level.derivative()(line.value[positive]) * amplitude[positive]
    return replace(line, before=slope, after=slope)


def located_peaks(curve: xr.Dataset, parameter: Moving) -> list[Peak]:
    """The located peaks of a curve, one for each degree of freedom where several peak together."""
    keys = [f"peak_{key}" for key in ("kind", parameter.name, "amplitude", "dof")]
    if not all(key in curve.variables and "peak" in curve[key].dims for key in keys):
        return []
    if not Description(curve).peaks_of_amplitude:
        return []
    rows = [*zip(*(curve[key].values for key in keys), strict=True)]
    peaks = [
        (i, Peak(str(kind), float(at), float(top), int(dof)))
        for i, (kind, at, top, dof) in enumerate(rows)
        if kind
    ]
    if parameter.per_dof or "peak_coefficient" not in curve.variables:
        return [peak for _, peak in peaks]
    coefficient = curve["peak_coefficient"].transpose("peak", "dof", "harmonic", "component").values
    result = []
    for i, peak in peaks:
        tied = [peak.dof]
        if np.isfinite(coefficient[i]).all():
            amplitude = largest_displacement(*motions_of(curve, coefficient[i]))[0]
            tied = np.flatnonzero(amplitude >= (1 - _TIED) * peak.amplitude).tolist() or tied
        result += [peak._replace(dof=dof) for dof in tied]
    return result
