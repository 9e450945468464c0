"""The best value of a parameter, where a curve over it is largest, or the range of such values."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from symhbm.continuation import Status
from symhbm.design.flutter.limits import FlutterLimits, LimitKind, Row

LEVEL = 1e-9
"""Difference of two damping ratios, over the largest one, that counts as none."""
_FLAT = 1e-7
"""Slope by the logarithm of the parameter, over the largest damping ratio, that counts as none."""
_WIDE = 1e-3
"""Relative width of a range of equal values that is no maximum's own neighbourhood."""
_PRECISION = 1e-13
"""Error of a located value, relative."""
_HALVINGS = 40
"""Bisections that find the end of a range of equal values."""


class OptimumKind(StrEnum):
    """What makes a value the best one."""

    MAXIMUM = "maximum"
    CORNER = "corner"
    BOUND = "bound"
    RANGE = "range"


@dataclass(frozen=True)
class Candidate:
    """A value of the parameter where a curve is as large as nowhere next to it."""

    value: float
    damping_ratio: float
    kind: OptimumKind


@dataclass(frozen=True)
class Optimum:
    """The best of some ``candidates``; values from ``first`` to ``last`` are as good."""

    best: Candidate
    first: float
    last: float
    candidates: tuple[Candidate, ...]

    def status(self, bounds: tuple[float, float]) -> Status:
        """What the best value is."""
        if self.best.kind != OptimumKind.RANGE:
            at_bound = self.best.kind == OptimumKind.BOUND
            return Status.DAMPING_AT_BOUND if at_bound else Status.DAMPING_LARGEST
        everywhere = (self.first, self.last) == (min(bounds), max(bounds))
        return Status.DAMPING_WITHOUT_EFFECT if everywhere else Status.DAMPING_ON_RANGE


def _chosen(candidates: Sequence[Candidate], first: float, last: float) -> Optimum:
    best = max(candidates, key=lambda candidate: candidate.damping_ratio)
    if first == last:
        return Optimum(best, best.value, best.value, (*candidates,))
    best = Candidate(first, best.damping_ratio, OptimumKind.RANGE)
    outside = [other for other in candidates if not first <= other.value <= last]
    return Optimum(best, first, last, (best, *outside))


def best_on_path(found: xr.Dataset, name: str) -> Optimum | None:
    """Where the damping ratio of a mode is largest along its path over a parameter, if anywhere.

    Maxima, corners and both ends are points of the path, so that none between points is larger.
    """
    known = np.isfinite(found["damping_ratio"].values)
    values, ratios = found[name].values[known], found["damping_ratio"].values[known]
    if not len(values):
        return None
    events = found["event_kind"].values.astype(str)
    at, turns = found[f"event_{name}"].values, events == "damping turns"
    others = at[~turns & (events != "")]
    around = np.concatenate([[-np.inf], ratios, [-np.inf]])
    candidates = []
    for i in np.flatnonzero((ratios >= around[:-2]) & (ratios >= around[2:])).tolist():
        if i in (0, len(values) - 1):
            candidates.append(Candidate(values[i], ratios[i], OptimumKind.BOUND))
        elif values[i] in at[turns]:
            kind = OptimumKind.CORNER if values[i] in others else OptimumKind.MAXIMUM
            candidates.append(Candidate(values[i], ratios[i], kind))
    top = int(np.argmax(ratios))
    same = np.abs(ratios - ratios[top]) <= LEVEL * np.abs(ratios).max()
    first, last = _run(same, top)
    ends = sorted((float(values[first]), float(values[last])))
    if ends[1] - ends[0] <= _WIDE * max(map(abs, ends)):
        ends[1] = ends[0]
    return _chosen(candidates, *ends)


def best_limit(limits: FlutterLimits, bounds: tuple[float, float]) -> Optimum | None:
    """Where the flutter limit of the first disturbance is largest, if it is told anywhere."""
    rows = [row for row in limits.sample(bounds) if row.limits]
    if not rows:
        return None
    ratios = np.array([row.limits[0].damping_ratio for row in rows])
    largest = float(np.abs(ratios).max())
    flat = np.array([_is_flat(row, largest) for row in rows])
    top = int(np.argmax(ratios))
    same = flat & (np.abs(ratios - ratios[top]) <= LEVEL * largest)
    first = last = rows[top].value
    begin, end = _run(same, top)
    if same[top] and end > begin:
        first = _end_of_range(limits, rows, begin, -1, largest)
        last = _end_of_range(limits, rows, end, 1, largest)
    candidates, after = [], -1
    for i in range(len(rows)):
        # Of a range of equal values, all of them or none are candidates.
        begin, end = _run(flat & (np.abs(ratios - ratios[i]) <= LEVEL * largest), i)
        around = ratios[max(begin - 1, 0) : end + 2]
        if i <= after or not ratios[i] >= around.max() - LEVEL * largest * (end > begin):
            continue
        after = end
        candidates.append(
            Candidate(rows[i].value, float(ratios[i]), OptimumKind.RANGE)
            if end > begin
            else _located(limits, rows, i, largest)
        )
    return _chosen(candidates, first, last)


def _run(same: NDArray[np.bool_], top: int) -> tuple[int, int]:
    """First and last of the neighbours of one entry that are the same as it."""
    first = last = top
    while first > 0 and same[first - 1]:
        first -= 1
    while last < len(same) - 1 and same[last + 1]:
        last += 1
    return first, last


def _slope(row: Row) -> float:
    """Slope of the limit by the parameter relative to itself."""
    return row.limits[0].slope * (abs(row.value) or 1.0)


def _is_flat(row: Row, largest: float) -> bool:
    return abs(_slope(row)) <= _FLAT * largest


def _located(limits: FlutterLimits, rows: list[Row], i: int, largest: float) -> Candidate:
    """The maximum next to a row that is larger than its neighbours."""
    row, heading = rows[i], int(np.sign(_slope(rows[i])))
    kind = OptimumKind.BOUND if i in (0, len(rows) - 1) else OptimumKind.MAXIMUM
    if not (_is_flat(row, largest) or not 0 <= i + heading < len(rows)):
        other = rows[i + heading]
        if _slope(other) * heading < 0:
            row = _turn(limits, row, other)
        kind = OptimumKind.MAXIMUM if _is_flat(row, largest) else OptimumKind.CORNER
    return Candidate(row.value, row.limits[0].damping_ratio, kind)


def _turn(limits: FlutterLimits, one: Row, other: Row) -> Row:
    """The row at which the slope of the limit changes its sign, between two others."""
    tried: list[Row] = [one]

    def slope(value: float) -> float:
        row = limits.row(value)
        if not row.limits:
            raise ArithmeticError
        tried.append(row)
        return row.limits[0].slope

    precision = _PRECISION * max(abs(one.value), abs(other.value))
    with suppress(ArithmeticError):
        scipy.optimize.brentq(slope, one.value, other.value, xtol=precision)  # type: ignore
    return max(tried, key=lambda row: row.limits[0].damping_ratio)


def _end_of_range(
    limits: FlutterLimits, rows: list[Row], i: int, heading: int, largest: float
) -> float:
    """The last value of a range of equal limits towards one side of its outermost row."""
    if not 0 <= i + heading < len(rows):
        return rows[i].value
    inside, outside = rows[i], rows[i + heading]
    places = {LimitKind.DISTURBANCE: 0, LimitKind.LARGEST: -1}
    place = places.get(outside.limits[0].kind)
    if place is not None:
        # The maximum leaves the amplitudes there: it is at their end.
        def slope(value: float) -> float:
            ends = limits.row(value).ends
            if not ends:
                raise ArithmeticError
            return ends[place].by_amplitude

        ends = [slope(row.value) for row in (inside, outside)]
        if ends[0] * ends[1] < 0:
            precision = _PRECISION * max(abs(inside.value), abs(outside.value))
            with suppress(ArithmeticError):
                both = inside.value, outside.value
                return float(scipy.optimize.brentq(slope, *both, xtol=precision))  # type: ignore
    good, bad, level = inside.value, outside.value, inside.limits[0].damping_ratio
    for _ in range(_HALVINGS):
        middle = limits.row((good + bad) / 2)
        is_same = middle.limits and abs(middle.limits[0].damping_ratio - level) <= LEVEL * largest
        good, bad = (middle.value, bad) if is_same else (good, middle.value)
    return good
