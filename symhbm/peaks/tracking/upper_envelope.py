"""The curve of the largest response over one parameter: which maximum leads where, and its minima.

Where the lead changes hands, where a contact changes its state at the leading maximum and where the
curve is lowest is solved for.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np
import scipy

from symhbm.continuation.between import TIE
from symhbm.numerics import FloatArray
from symhbm.peaks.conditions import Conditions
from symhbm.peaks.maximum import MaximumKind
from symhbm.peaks.tracking.branches import SAME, Branch, Pool, same
from symhbm.peaks.tracking.interpolation import crossing, fill
from symhbm.peaks.tracking.step import height, polished
from symhbm.peaks.tracking.track import TrackStatus

_FINER = 4
"""Parts of every distance between two points over which heights are compared."""
_DEEPEST = 6
_TOUCHING = 1e-5
"""Distance, relative, from where a peak crosses the end of the band within which both are equal."""
_BESIDE = 1e-3
_THIN = 1e-7
"""Lengths below which nothing happens."""
_NEAR = 1e-4
"""Distance from an event, relative, within which a curve needs one other point on either side."""
_JUMP = 1e-6
"""Relative difference of heights where the lead changes that digits do not explain."""
_EQUAL = 1e-12
"""Distance below which two points are one."""
_ONE = 1e-9
"""Distance, relative, below which two minima are one."""


class MinimumKind(StrEnum):
    """What makes a minimum of the curve."""

    SMOOTH = "smooth"
    EXCHANGE = "exchange"
    KINK = "kink"
    END = "end"


class EnvelopeEvent(StrEnum):
    """What happens at an event of the curve."""

    EXCHANGE = "exchange of the dominant peak"
    STICK = "full stick"
    KIND = "change of kind"
    ONSET = "onset of slip at the peak"
    RELEASE = "end of slip at the peak"
    BAND = "peak crosses the end of the band"
    POLE = "peak becomes unbounded"


@dataclass(frozen=True)
class Place:
    """A point of the curve: the maximum that leads there and what it is."""

    value: float
    found: Conditions
    what: str = ""


class UpperEnvelope:
    """The highest of some branches: its ``points``, ``minima`` and ``events``, ascending.

    Within ``unbounded`` ranges there is none. ``unclear`` are places where the lead changes and
    what it passes to could not be solved for, or is not as high.
    """

    def __init__(self, pool: Pool, unbounded: Sequence[tuple[float, float]] = ()):
        self._unbounded = unbounded
        self._pool, self._parameter = pool, pool.parameter
        self.points: list[Place] = []
        self.minima: list[Place] = []
        self.events: list[Place] = []
        self.unclear: list[float] = []
        self._spans: list[tuple[Branch, float, float]] = []
        if pool.branches:
            self._find_spans()
            for span in self._spans:
                self._along(*span)
            self.points.sort(key=lambda place: place.value)
            self._at_ends()
            poles = [p for p in pool.poles if any(low <= p[0] <= high for low, high in unbounded)]
            self.events += [Place(*pole, EnvelopeEvent.POLE) for pole in poles]
        for places in (self.minima, self.events):
            places.sort(key=lambda place: place.value)
        # One at a survey belongs to the stretches on both of its sides.
        told = [-np.inf, *(low.value for low in self.minima)]
        pairs = zip(self.minima, told, strict=False)
        self.minima = [low for low, last in pairs if low.value - last > _ONE * low.value]
        self._thin()

    @property
    def doubtful(self) -> list[float]:
        """Where a maximum that was overlooked would show first: minima, exchanges and jumps."""
        parameter = self._parameter
        sharp = MinimumKind.SMOOTH, MinimumKind.EXCHANGE, EnvelopeEvent.EXCHANGE
        values = {
            *self.unclear,
            *(p.value for p in (*self.minima, *self.events) if p.what in sharp),
        }
        # At a kink a survey need not tell maxima that merge there.
        kinks = [p.value for p in self.minima if p.what == MinimumKind.KINK]
        values |= {share * kink for kink in kinks for share in (1 - _BESIDE, 1 + _BESIDE)}
        return sorted(value for value in values if parameter.low < value < parameter.high)

    def _heights(self, values: FloatArray) -> FloatArray:
        heights = np.array([branch.heights(values) for branch in self._pool.branches])
        for low, high in self._unbounded:
            heights[:, (values > low) & (values < high)] = -np.inf
        return heights

    def _find_spans(self) -> None:
        """Who leads from where to where."""
        measure = self._parameter.measure
        knots = np.unique([v for b in self._pool.branches for v in b.values])
        inner = np.linspace(0, 1, _FINER, endpoint=False)
        lengths = measure(knots)
        fine = (lengths[:-1, None] + inner * np.diff(lengths)[:, None]).ravel()
        grid = np.exp(fine) if self._parameter.logarithmic else fine
        grid = np.unique(np.append(np.clip(grid, knots[0], knots[-1]), knots))
        heights = self._heights(grid)
        leader, start = -1, grid[0]
        for k, column in enumerate(heights.T):
            top = int(np.argmax(column >= (1 - TIE) * column.max()))
            if leader >= 0 and column[leader] >= (1 - TIE) * column[top]:
                continue
            if not np.isfinite(column[top]):
                if leader >= 0:
                    self._add_span(leader, start, grid[k - 1])
                leader = -1
                continue
            if leader < 0:
                start = grid[k]
            else:
                for low, high, one, other in self._changes(grid[k - 1], grid[k], leader, top):
                    change = self._change(low, high, one, other)
                    self._add_span(one, start, change)
                    start = change
            leader = top
        if leader >= 0:
            self._add_span(leader, start, grid[-1])

    def _add_span(self, number: int, start: float, end: float) -> None:
        branch = self._pool.branches[number]
        start, end = max(start, branch.values[0]), min(end, branch.values[-1])
        if end >= start:
            self._spans.append((branch, start, end))

    def _changes(
        self, low: float, high: float, one: int, other: int, depth: int = 0
    ) -> list[tuple[float, float, int, int]]:
        """The changes of the lead from one branch to another, by way of a third perhaps."""
        at = crossing(self._pool.branches[one], self._pool.branches[other], low, high)
        if at is None or depth > _DEEPEST:
            return [(low, high, one, other)]
        column = self._heights(np.array([at]))[:, 0]
        top = int(np.argmax(column))
        if column[top] <= (1 + TIE) * max(column[[one, other]]):
            return [(low, high, one, other)]
        first = self._changes(low, at, one, top, depth + 1)
        return first + self._changes(at, high, top, other, depth + 1)

    def _change(self, low: float, high: float, one: int, other: int) -> float:
        """Where the lead goes over, noted as an event unless both are one maximum."""
        a, b = self._pool.branches[one], self._pool.branches[other]
        at = crossing(a, b, low, high)
        if at is None:
            at = a.values[-1] if low <= a.values[-1] <= high else b.values[0]
            at = float(np.clip(at, low, high))
        before, after = a.at(at), b.at(at)
        if before is None or after is None:
            self.unclear.append(at)
            return at
        # There a maximum and the end of the band are equal to second order.
        gone = a.values[-1] <= at * (1 + _TOUCHING) and a.ends[1] == TrackStatus.LEFT_BAND
        come = b.values[0] >= at * (1 - _TOUCHING) and b.ends[0] == TrackStatus.LEFT_BAND
        if gone or come:
            at = a.values[-1] if gone else b.values[0]
            self.events.append(Place(at, before, EnvelopeEvent.BAND))
        elif not same(before, after):
            fall = height(after.summit, before.summit)
            if abs(fall) > _JUMP:
                # The largest response is continuous: the lower side lacks a maximum.
                self.unclear.append(at * (1 + _BESIDE if fall < 0 else 1 - _BESIDE))
            last = self.events[-1:]
            if not (
                last
                and last[0].what == EnvelopeEvent.EXCHANGE
                and abs(at / last[0].value - 1) < SAME
            ):
                self.events.append(Place(at, before, EnvelopeEvent.EXCHANGE))
            self.points.append(Place(at, before))
            if self._parameter.slope(before) < 0 < self._parameter.slope(after):
                self.minima.append(Place(at, before, MinimumKind.EXCHANGE))
        return at

    def _along(self, branch: Branch, start: float, end: float) -> None:
        """Points, minima and events of one branch where it leads."""
        # Slopes on either side of an event.
        for value in (self._parameter.value(start, end, s) for s in (0.0, _THIN, 1 - _THIN, 1.0)):
            found = branch.at(value)
            if found is not None:
                branch.insert(value, found)
        fill(branch, start, end)
        first, last = bisect_left(branch.values, start), bisect_right(branch.values, end) - 1
        places = [Place(branch.values[i], branch.found[i]) for i in range(first, last + 1)]
        self.points += places
        joints = {i - first: at for i, at in branch.joints.items() if first <= i < last}
        slope = self._parameter.slope
        for i, (here, there) in enumerate(pairwise(places)):
            if i not in joints:
                self._lows(branch, here, there)
                continue
            at = here if here.value == joints[i] else there
            self.events.append(Place(at.value, at.found, _turn(here.found, there.found)))
            left, right = slope(here.found), slope(there.found)
            if left < 0 <= right or left <= 0 < right:
                self.minima.append(Place(at.value, at.found, MinimumKind.KINK))

    def _lows(self, branch: Branch, here: Place, there: Place, depth: int = 0) -> None:
        """Minima between two points of a branch with no event in between."""
        slope = self._parameter.slope
        ends = slope(here.found), slope(there.found)
        if ends[0] < 0 < ends[1]:
            self._low(branch, here, there)
            return
        if ends[0] < 0 == ends[1]:
            self.minima.append(Place(there.value, there.found, MinimumKind.SMOOTH))
        lengths = self._parameter.measure(np.array([here.value, there.value]))
        inside = lengths[0] + np.linspace(0, 1, 6)[1:-1] * (lengths[1] - lengths[0])
        values = np.exp(inside) if self._parameter.logarithmic else inside
        if depth > _DEEPEST or lengths[1] - lengths[0] < _THIN or ends[0] == ends[1] == 0:
            return
        between = np.sign(branch.slopes(values))
        changes = np.flatnonzero(np.diff(np.concatenate([[ends[0]], between, [ends[1]]]) > 0))
        if len(changes) < 1 + (ends[0] * ends[1] < 0):
            return
        value = float(values[min(changes[0], len(values) - 1)])
        found = branch.at(value)
        if found is not None:
            middle = Place(value, found)
            self._lows(branch, here, middle, depth + 1)
            self._lows(branch, middle, there, depth + 1)

    def _low(self, branch: Branch, here: Place, there: Place) -> None:
        known = {place.value: place.found for place in (here, there)}

        def slope(value: float) -> float:
            if value not in known:
                found = branch.at(value)
                if found is None:
                    raise ArithmeticError
                # A slope needs digits that a height does not.
                known[value] = polished(found)
            return self._parameter.slope(known[value])

        try:
            value = float(
                scipy.optimize.brentq(slope, here.value, there.value, xtol=1e-300, rtol=1e-15)
            )  # type: ignore
            slope(value)
        except ArithmeticError:
            self.unclear.append(here.value)
            return
        self.minima.append(Place(value, known[value], MinimumKind.SMOOTH))
        self.points.append(Place(value, known[value]))

    def _at_ends(self) -> None:
        """Minima where the curve falls towards an end of the band."""
        slope, first, last = self._parameter.slope, self.points[0], self.points[-1]
        if first.value == self._parameter.low and slope(first.found) > 0:
            self.minima.append(Place(first.value, first.found, MinimumKind.END))
        if last.value == self._parameter.high and slope(last.found) < 0:
            self.minima.append(Place(last.value, last.found, MinimumKind.END))

    def _thin(self) -> None:
        """Leave out points that others make needless."""
        special = np.array([place.value for place in (*self.events, *self.minima)])
        ends = self._parameter.low, self._parameter.high
        kept: list[Place] = []
        for place, after in zip(self.points, [*self.points[1:], None], strict=True):
            last, value = kept[-1].value if kept else -np.inf, place.value
            if value - last <= _EQUAL * value:
                continue
            near = np.any(np.abs(special - value) < _NEAR * value)
            beside = {last, value, after.value if after else value}
            if not near or value in ends or not beside.isdisjoint(special):
                kept.append(place)
        self.points = kept


def _turn(before: Conditions, after: Conditions) -> EnvelopeEvent:
    """What happens at a joint of a branch."""
    one, other = before.summit, after.summit
    if other.kind == MaximumKind.SMOOTH and not other.slip.any() and one.slip.any():
        return EnvelopeEvent.STICK
    slips = np.count_nonzero(other.slip) - np.count_nonzero(one.slip)
    if one.kind != other.kind or not slips:
        return EnvelopeEvent.KIND
    return EnvelopeEvent.ONSET if slips > 0 else EnvelopeEvent.RELEASE
