"""Lines of response curves through corners and peaks, and marks of events and ends along them."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import Akima1DInterpolator, PchipInterpolator

from symhbm.numerics import FloatArray, largest_displacement
from symhbm.numerics.loops import interpolation
from symhbm.plot.drawing import Moving, decibel, motions_of
from symhbm.plot.picture import Panel
from symhbm.results import Description
from symhbm.results.reading import COMPLETE, curve_status

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
_HIGHER = 1e-3
"""Share by which a curve may exceed its points and peaks where these are all that are there."""
_SHARES = np.arange(1, 16) / 16
"""Where a segment is searched for what exceeds them."""


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
    ``unstable`` (n,); ``straight`` (n - 1,) tells where slopes are not followed, or is empty.
    """

    value: FloatArray
    amplitude: FloatArray
    before: FloatArray
    after: FloatArray
    unstable: np.ndarray
    straight: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=bool))

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

        It rises to corners and falls behind them. ``dof`` of the peaks are columns of the line.
        """
        line, finite = self, [peak for peak in peaks if np.isfinite(peak.amplitude)]
        for value, together in groupby(sorted(finite, key=lambda p: p.value), lambda p: p.value):
            i = int(np.searchsorted(line.value, value))
            present = np.flatnonzero(np.abs(line.value - value) <= _SAME * np.abs(value))
            if len(present):
                line = line._turning(present, [p.dof for p in together if p.kind != "smooth"])
            elif 0 < i < len(line.value):
                line = line._with(i, value, [*together])
        return line

    def _turning(self, points: np.ndarray, dofs: list[int]) -> "Line":
        """Without slopes at corners that are of the other side, where another instant leads."""
        before, after = self.before.copy(), self.after.copy()
        at = np.ix_(points, np.array(dofs, dtype=int))
        before[at] = np.where(before[at] < 0, np.nan, before[at])
        after[at] = np.where(after[at] > 0, np.nan, after[at])
        return replace(self, before=before, after=after)

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
        own = self.value, self.amplitude, self.before, self.after, self.unstable
        parts = zip(own, (value, amplitude, slope, slope, unstable), strict=True)
        return Line(*(np.insert(part, i, new, axis=0) for part, new in parts))

    def held(self, value: FloatArray, amplitude: FloatArray) -> "Line":
        """An ascending line, straight where its slopes promise more than there is.

        ``amplitude`` (m,) [m] at ``value`` (m,) are all points and all peaks, NaN where unknown.
        """
        if len(self.value) < 2:
            return self
        bound = np.full(len(self.value) - 1, -np.inf)
        for side in ("left", "right"):
            segment = np.searchsorted(self.value, value, side) - 1
            np.fmax.at(bound, np.clip(segment, 0, len(bound) - 1), amplitude)
        segment = np.repeat(np.arange(len(bound)), len(_SHARES))
        inside = self._between(segment, np.tile(_SHARES, len(bound)))
        highest = inside.max(axis=1).reshape(len(bound), -1).max(axis=1)
        return replace(self, straight=highest > bound * (1 + _HIGHER))

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
        result = interpolation.amplitude_between(left, right, (first, last), share[:, None])
        if self.straight.any():
            # Powers, whose logarithms are straight, are right where nothing moves, too.
            straight = left ** (1 - share[:, None]) * right ** share[:, None]
            result = np.where(self.straight[segment][:, None], straight, result)
        return result

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


def knows_peaks(curve: xr.Dataset, parameter: Moving) -> bool:
    """Whether the peaks of the amplitudes of a curve are stored."""
    keys = [f"peak_{key}" for key in ("kind", parameter.name, "amplitude", "dof")]
    stored = all(key in curve.variables and "peak" in curve[key].dims for key in keys)
    return stored and Description(curve).peaks_of_amplitude


def located_peaks(curve: xr.Dataset, parameter: Moving) -> list[Peak]:
    """The located peaks of a curve, one for each degree of freedom where several peak together."""
    if not knows_peaks(curve, parameter):
        return []
    keys = [f"peak_{key}" for key in ("kind", parameter.name, "amplitude", "dof")]
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


_PIECES = 8
"""Straight pieces of a curve between two of its points."""


def curved(
    x: Any, y: Any, log: Sequence[bool] = (False, False), closed: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Points of a smooth line through points (n,), which does not overshoot; broken at NaN.

    ``log`` tells the axes that are logarithmic; a ``closed`` curve, such as a circle, is rounder,
    and may overshoot a little.
    """
    points = np.array([x, y], dtype=float)
    points[[*log]] = np.log(points[[*log]])
    known = np.flatnonzero(np.isfinite(points).all(axis=0))
    if not len(known):
        return points[0], points[1]
    pieces = [np.full((2, 1), np.nan)]
    for run in np.split(known, np.flatnonzero(np.diff(known) > 1) + 1):
        part = points[:, run]
        width = np.ptp(points[:, known], axis=1, keepdims=True)
        length = np.hypot(*np.diff(part / np.where(width > 0, width, 1.0)))
        part = part[:, np.append(True, length > _SAME)]
        along = np.append(0.0, np.cumsum(length[length > _SAME]))
        if part.shape[1] > 2:
            place = np.arange(_PIECES * (len(along) - 1) + 1) / _PIECES
            fine = np.interp(place, np.arange(len(along)), along)
            kind = Akima1DInterpolator if closed else PchipInterpolator
            part = kind(along, part, axis=1)(fine)
        pieces += [part, np.full((2, 1), np.nan)]
    joined = np.concatenate(pieces[1:-1], axis=1)
    joined[[*log]] = np.exp(joined[[*log]])
    return joined[0], joined[1]


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
    status = curve_status(curve)
    return status is None or bool(status.ndim) or str(status.values) in COMPLETE


def beside_missing(found: np.ndarray) -> np.ndarray:
    """Numbers of the points that are found and have a neighbour that is not."""
    padded = np.concatenate([[True], found, [True]])
    return np.flatnonzero(found & ~(padded[:-2] & padded[2:]))


def at_an_end(value: FloatArray, band: Any) -> np.ndarray:
    """Whether values (n,) are ends of a band; False where the band is unknown."""
    ends = np.array(band if band is not None else (np.nan, np.nan), dtype=float)
    return (np.abs(value[:, None] - ends) <= _NEAR * np.abs(ends).max()).any(axis=1)
