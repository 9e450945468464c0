"""The best value of a parameter, where a curve over it is largest, or the range of such values."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from symhbm.continuation import Status
from symhbm.design.flutter.limits import FlutterLimits, LimitKind, Row
from symhbm.numerics import bracketed_root

LEVEL = 1e-9
"""Difference of two damping ratios, over the largest one, that counts as none."""
_FLAT = 1e-7
"""Slope by the logarithm of the parameter, over the largest damping ratio, that counts as none."""
_WIDE = 1e-3
"""Relative width of a range of equal values that is no maximum's own neighbourhood."""
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
    """Where the flutter limit of the first disturbance is largest, if it is known anywhere."""
    rows = [row for row in limits.sample(bounds) if row.limits]
    if not rows:
        return None
    largest = max(abs(_ratio(row)) for row in rows)
    flat = np.array([_is_flat(row, largest) for row in rows])
    ratios = np.array([_ratio(row) for row in rows])
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
    best = max(candidates, key=lambda candidate: candidate.damping_ratio).value
    return _chosen(candidates, *_range_around(limits, best, bounds, largest))


def _range_around(
    limits: FlutterLimits, best: float, bounds: tuple[float, float], largest: float
) -> tuple[float, float]:
    """First and last value at which the limit is that at the best one, and flat."""
    level, low, high = _ratio(limits.row(best)), min(bounds), max(bounds)
    width = _WIDE * (abs(best) or high - low)
    near = [limits.row(min(max(best + step, low), high)) for step in (-width, width)]
    # Next to a maximum nothing is flat.
    if not any(row.value != best and _is_same(row, level, largest) for row in near):
        return best, best
    ends = []
    for heading in (-1, 1):
        last = limits.row(best)
        beyond = [row for row in limits.rows.values() if heading * (row.value - best) > 0]
        for row in sorted(beyond, key=lambda row: heading * row.value):
            if not _is_same(row, level, largest):
                ends.append(_end_of_range(limits, last, row, level, largest))
                break
            last = row
        else:
            ends.append(last.value)
    return ends[0], ends[1]


def _run(same: NDArray[np.bool_], top: int) -> tuple[int, int]:
    """First and last of the neighbours of one entry that are the same as it."""
    first = last = top
    while first > 0 and same[first - 1]:
        first -= 1
    while last < len(same) - 1 and same[last + 1]:
        last += 1
    return first, last


def _ratio(row: Row) -> float:
    return row.limits[0].damping_ratio


def _slope(row: Row) -> float:
    """Slope of the limit by the parameter relative to itself."""
    return row.limits[0].slope * (abs(row.value) or 1.0)


def _is_flat(row: Row, largest: float) -> bool:
    return abs(_slope(row)) <= _FLAT * largest


def _is_same(row: Row, level: float, largest: float) -> bool:
    """Whether the limit of a row is a ``level``, and flat."""
    known = bool(row.limits) and _is_flat(row, largest)
    return known and abs(_ratio(row) - level) <= LEVEL * largest


def _located(limits: FlutterLimits, rows: list[Row], i: int, largest: float) -> Candidate:
    """The maximum next to a row that is larger than its neighbours."""
    row, slope = rows[i], _slope(rows[i])
    if not np.isfinite(slope):
        return Candidate(row.value, _ratio(row), OptimumKind.CORNER)
    heading = 0 if _is_flat(row, largest) else int(np.sign(slope))
    if not 0 <= i + heading < len(rows) or (not heading and i in (0, len(rows) - 1)):
        return Candidate(row.value, _ratio(row), OptimumKind.BOUND)
    if heading and _slope(rows[i + heading]) * heading < 0:
        row = _turn(limits, row, rows[i + heading])
    kind = OptimumKind.MAXIMUM if _is_flat(row, largest) else OptimumKind.CORNER
    return Candidate(row.value, _ratio(row), kind)


def _turn(limits: FlutterLimits, one: Row, other: Row) -> Row:
    """The row at which the slope of the limit changes its sign, between two others."""

    def slope(value: float) -> float:
        row = limits.row(value)
        if not row.limits:
            raise ArithmeticError
        return row.limits[0].slope

    turn = _root(slope, one.value, other.value)
    return one if turn is None else limits.row(turn)


def _end_of_range(
    limits: FlutterLimits, inside: Row, outside: Row, level: float, largest: float
) -> float:
    """The last value of a range of equal limits, between a row of it and one beyond."""
    places = {LimitKind.DISTURBANCE: 0, LimitKind.LARGEST: -1}
    place = places.get(outside.limits[0].kind) if outside.limits else None
    if place is not None:
        # The maximum leaves the amplitudes there: it is at their end.
        def slope(value: float) -> float:
            ends = limits.row(value).ends
            if not ends:
                raise ArithmeticError
            return ends[place].by_amplitude

        end = _root(slope, inside.value, outside.value)
        if end is not None:
            return end
    good, bad = inside.value, outside.value
    for _ in range(_HALVINGS):
        middle = limits.row((good + bad) / 2)
        is_same = _is_same(middle, level, largest)
        good, bad = (middle.value, bad) if is_same else (good, middle.value)
    return good


def _root(function: Callable[[float], float], first: float, last: float) -> float | None:
    """Where a function is 0 between two values, None where it is not known that it is."""
    with suppress(ArithmeticError):
        if function(first) * function(last) < 0:
            return bracketed_root(function, first, last)
    return None
