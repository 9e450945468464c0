"""The upper envelope of maxima over one parameter: its points, its minima and its events.

Where another branch takes the lead, and, over a range where one branch leads, where contact states
change and where minima are, is solved for.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from itertools import pairwise

import numpy as np

from symhbm.continuation.between import TIE
from symhbm.numerics import FloatArray, bracketed_root
from symhbm.peaks.conditions import Conditions
from symhbm.peaks.maximum import MaximumKind
from symhbm.peaks.tracking.branches import (
    SAME_MAXIMUM,
    FollowedBranches,
    MaximumBranch,
    Parameter,
    is_same_maximum,
)
from symhbm.peaks.tracking.interpolation import SHORTEST_INTERVAL, crossing, fill
from symhbm.peaks.tracking.step import polished, relative_height
from symhbm.peaks.tracking.track import TrackStatus

_SUBDIVISION = 4
"""Subdivisions of the interval between two solved values for comparing heights: two cubics cross
at most three times in it."""
_ENVELOPE_DEPTH = 6
"""Halvings of an interval with several minima or exchanges."""
_CROSSING_DISTANCE = 1e-5
"""Distance from where a peak crosses the end of the band within which both are equal: their
heights differ by its square, which is round-off."""
_LARGEST_STEP_OF_LEAD = 1e-6
"""Difference of heights at an exchange beyond round-off: the largest response is continuous."""
_SURVEY_OFFSET = 1e-3
"""Distance from a kink or a jump at which a survey verifies the envelope: there two maxima that
merge are apart."""
_EVENT_DISTANCE = 1e-4
"""Distance from an event within which one further point on either side suffices."""
_SAME_POINT, _SAME_MINIMUM = 1e-12, 1e-9
"""Distances below which two points, or two minima, are one: round-off of a value, and of the value
at which a slope vanishes."""


class MinimumKind(StrEnum):
    """Kinds of minima of the envelope."""

    SMOOTH = "smooth"
    EXCHANGE = "exchange"
    KINK = "kink"
    END = "end"


class EnvelopeEvent(StrEnum):
    """Events along the envelope."""

    EXCHANGE = "exchange of the dominant peak"
    STICK = "full stick"
    KIND = "change of kind"
    ONSET = "onset of slip at the peak"
    RELEASE = "end of slip at the peak"
    BAND = "peak crosses the end of the band"
    POLE = "peak becomes unbounded"


@dataclass(frozen=True)
class EnvelopePoint:
    """A point of the envelope: the leading maximum, and the kind of minimum or event."""

    value: float
    conditions: Conditions
    kind: str = ""


@dataclass
class UpperEnvelope:
    """The highest of several branches: its ``points``, ``minima`` and ``events``, all ascending.

    It is not defined in ``unbounded`` ranges. ``unresolved`` are values where the lead changes and
    the new leader could not be solved for, or is not as high.
    """

    followed: FollowedBranches
    unbounded: Sequence[tuple[float, float]] = ()
    points: list[EnvelopePoint] = field(default_factory=list)
    minima: list[EnvelopePoint] = field(default_factory=list)
    events: list[EnvelopePoint] = field(default_factory=list)
    unresolved: list[float] = field(default_factory=list)

    @classmethod
    def of(
        cls, followed: FollowedBranches, unbounded: Sequence[tuple[float, float]] = ()
    ) -> "UpperEnvelope":
        """The upper envelope of branches."""
        envelope = cls(followed, unbounded)
        if not followed.branches:
            return envelope
        for span in envelope._spans():
            envelope._add_span(*span)
        points = sorted(envelope.points, key=_value)
        for pole in followed.poles:
            if any(low <= pole[0] <= high for low, high in unbounded):
                envelope.events.append(EnvelopePoint(*pole, EnvelopeEvent.POLE))
        envelope.events.sort(key=_value)
        minima = sorted(envelope.minima + envelope._end_minima(points), key=_value)
        # A minimum at a surveyed value belongs to the spans on both of its sides.
        envelope.minima = []
        for minimum in minima:
            last = envelope.minima[-1].value if envelope.minima else -np.inf
            if minimum.value - last > _SAME_MINIMUM * minimum.value:
                envelope.minima.append(minimum)
        envelope.points = envelope._needed(points)
        return envelope

    @property
    def _parameter(self) -> Parameter:
        return self.followed.parameter

    @property
    def values_to_verify(self) -> list[float]:
        """Values where a missed maximum would show first: minima, exchanges and jumps."""
        sharp = MinimumKind.SMOOTH, MinimumKind.EXCHANGE, EnvelopeEvent.EXCHANGE
        values = {p.value for p in (*self.minima, *self.events) if p.kind in sharp}
        # At a kink two maxima merge, which a survey may not resolve: it is verified on both sides.
        kinks = [p.value for p in self.minima if p.kind == MinimumKind.KINK]
        values |= {kink * (1 + side * _SURVEY_OFFSET) for kink in kinks for side in (-1, 1)}
        low, high = self._parameter.low, self._parameter.high
        return sorted(value for value in {*self.unresolved, *values} if low < value < high)

    def _spans(self) -> list[tuple[MaximumBranch, float, float]]:
        """The branches that lead, each with the first and last value of a range where it does."""
        parameter, branches = self._parameter, self.followed.branches
        solved_values = np.unique([value for branch in branches for value in branch.values])
        inner = np.linspace(0, 1, _SUBDIVISION, endpoint=False)
        coordinates = parameter.coordinate(solved_values)
        refined = (coordinates[:-1, None] + inner * np.diff(coordinates)[:, None]).ravel()
        grid = np.clip(parameter.at_coordinate(refined), solved_values[0], solved_values[-1])
        grid = np.unique(np.append(grid, solved_values))
        ranges: list[tuple[int, float, float]] = []
        leader, start = -1, grid[0]
        for k, column in enumerate(self._heights(grid).T):
            highest = int(np.argmax(column >= (1 - TIE) * column.max()))
            if leader >= 0 and column[leader] >= (1 - TIE) * column[highest]:
                continue
            if not np.isfinite(column[highest]):
                ranges.append((leader, start, grid[k - 1]))
                leader = -1
                continue
            if leader < 0:
                start = grid[k]
            else:
                for exchange in self._exchanges(grid[k - 1], grid[k], leader, highest):
                    ranges.append((exchange[2], start, self._add_exchange(*exchange)))
                    start = ranges[-1][2]
            leader = highest
        ranges.append((leader, start, grid[-1]))
        led = [(branches[index], *limits) for index, *limits in ranges if index >= 0]
        spans = [(b, max(start, b.values[0]), min(end, b.values[-1])) for b, start, end in led]
        return [span for span in spans if span[1] <= span[2]]

    def _heights(self, values: FloatArray) -> FloatArray:
        heights = np.array([branch.heights(values) for branch in self.followed.branches])
        for low, high in self.unbounded:
            heights[:, (values > low) & (values < high)] = -np.inf
        return heights

    def _exchanges(
        self, low: float, high: float, first: int, second: int, depth: int = 0
    ) -> list[tuple[float, float, int, int]]:
        """The exchanges of the lead between two branches, possibly by way of a third."""
        branches = self.followed.branches
        value = crossing(branches[first], branches[second], low, high)
        if value is not None and depth <= _ENVELOPE_DEPTH:
            column = self._heights(np.array([value]))[:, 0]
            third = int(np.argmax(column))
            if column[third] > (1 + TIE) * max(column[[first, second]]):
                earlier = self._exchanges(low, value, first, third, depth + 1)
                return earlier + self._exchanges(value, high, third, second, depth + 1)
        return [(low, high, first, second)]

    def _add_exchange(self, low: float, high: float, first: int, second: int) -> float:
        """The value where the lead changes; an event unless both branches share one maximum."""
        a, b = self.followed.branches[first], self.followed.branches[second]
        value = crossing(a, b, low, high)
        if value is None:
            value = a.values[-1] if low <= a.values[-1] <= high else b.values[0]
            value = float(np.clip(value, low, high))
        before, after = a.at(value), b.at(value)
        if before is None or after is None:
            self.unresolved.append(value)
            return value
        # At this crossing peak and edge are equal to second order in the distance.
        near, left_band = _CROSSING_DISTANCE, TrackStatus.LEFT_BAND
        leaves_band = a.values[-1] <= value * (1 + near) and a.end_status[1] == left_band
        enters_band = b.values[0] >= value * (1 - near) and b.end_status[0] == left_band
        if leaves_band or enters_band:
            value = a.values[-1] if leaves_band else b.values[0]
            self.events.append(EnvelopePoint(value, before, EnvelopeEvent.BAND))
        elif not is_same_maximum(before, after):
            difference = relative_height(after.maximum, before.maximum)
            if abs(difference) > _LARGEST_STEP_OF_LEAD:
                # The largest response is continuous: a maximum was missed on the lower side.
                side = 1 if difference < 0 else -1
                self.unresolved.append(value * (1 + side * _SURVEY_OFFSET))
            exchanges = [e for e in self.events[-1:] if e.kind == EnvelopeEvent.EXCHANGE]
            if all(abs(value / e.value - 1) >= SAME_MAXIMUM for e in exchanges):
                self.events.append(EnvelopePoint(value, before, EnvelopeEvent.EXCHANGE))
            self.points.append(EnvelopePoint(value, before))
            if self._parameter.slope(before) < 0 < self._parameter.slope(after):
                self.minima.append(EnvelopePoint(value, before, MinimumKind.EXCHANGE))
        return value

    def _add_span(self, branch: MaximumBranch, start: float, end: float) -> None:
        """Add points, minima and events of one branch over the range where it leads."""
        # Points on either side of an event, for both of its slopes.
        for share in (0.0, SHORTEST_INTERVAL, 1 - SHORTEST_INTERVAL, 1.0):
            value = self._parameter.value(start, end, share)
            conditions = branch.at(value)
            if conditions is not None:
                branch.insert(value, conditions)
        fill(branch, start, end)
        first, last = bisect_left(branch.values, start), bisect_right(branch.values, end) - 1
        pairs = zip(branch.values, branch.conditions, strict=True)
        points = [EnvelopePoint(*pair) for pair in pairs][first : last + 1]
        self.points.extend(points)
        for i, (point, following) in enumerate(pairwise(points), first):
            event = branch.event_after(i)
            if event is None:
                self._add_minima(branch, point, following)
                continue
            at_event = point if point.value == event else following
            kind = _event_kind(point.conditions, following.conditions)
            self.events.append(replace(at_event, kind=kind))
            left, right = map(self._slope, (point, following))
            if left < 0 <= right or left <= 0 < right:
                self.minima.append(replace(at_event, kind=MinimumKind.KINK))

    def _slope(self, point: EnvelopePoint) -> float:
        return self._parameter.slope(point.conditions)

    def _add_minima(
        self, branch: MaximumBranch, point: EnvelopePoint, following: EnvelopePoint, depth: int = 0
    ) -> None:
        """Add the minima between two points of a branch without an event in between."""
        left, right = map(self._slope, (point, following))
        if left < 0 < right:
            self._add_smooth_minimum(branch, point, following)
            return
        if left < 0 == right:
            self.minima.append(replace(following, kind=MinimumKind.SMOOTH))
        low, high = self._parameter.coordinate(np.array([point.value, following.value]))
        short = high - low < SHORTEST_INTERVAL
        if depth > _ENVELOPE_DEPTH or short or left == right == 0:
            return
        values = self._parameter.at_coordinate(low + np.linspace(0, 1, 6)[1:-1] * (high - low))
        signs = np.sign(branch.slopes(values))
        rises = np.flatnonzero(np.diff(np.concatenate([[left], signs, [right]]) > 0))
        if len(rises) < 1 + (left * right < 0):
            return
        value = float(values[min(rises[0], len(values) - 1)])
        conditions = branch.at(value)
        if conditions is not None:
            middle = EnvelopePoint(value, conditions)
            self._add_minima(branch, point, middle, depth + 1)
            self._add_minima(branch, middle, following, depth + 1)

    def _add_smooth_minimum(
        self, branch: MaximumBranch, point: EnvelopePoint, following: EnvelopePoint
    ) -> None:
        """Add the minimum where the slope changes its sign."""
        solved = {end.value: end.conditions for end in (point, following)}

        def slope(value: float) -> float:
            if value not in solved:
                conditions = branch.at(value)
                if conditions is None:
                    raise ArithmeticError
                # The slope needs a more accurate solution than the height, which is stationary.
                solved[value] = polished(conditions)
            return self._parameter.slope(solved[value])

        try:
            value = bracketed_root(slope, point.value, following.value, precision=1e-15)
            slope(value)
        except ArithmeticError:
            self.unresolved.append(point.value)
            return
        self.minima.append(EnvelopePoint(value, solved[value], MinimumKind.SMOOTH))
        self.points.append(EnvelopePoint(value, solved[value]))

    def _end_minima(self, points: list[EnvelopePoint]) -> list[EnvelopePoint]:
        """Minima where the envelope falls towards an end of the band."""
        first, last = points[0], points[-1]
        falls_down = first.value == self._parameter.low and self._slope(first) > 0
        falls_up = last.value == self._parameter.high and self._slope(last) < 0
        ends = [first] * falls_down + [last] * falls_up
        return [replace(end, kind=MinimumKind.END) for end in ends]

    def _needed(self, points: list[EnvelopePoint]) -> list[EnvelopePoint]:
        """Points without duplicates and without those close to an event that others replace."""
        special = np.array([point.value for point in (*self.events, *self.minima)])
        ends = self._parameter.low, self._parameter.high
        kept: list[EnvelopePoint] = []
        for point, following in zip(points, [*points[1:], points[-1]], strict=True):
            previous, value = kept[-1].value if kept else -np.inf, point.value
            if value - previous <= _SAME_POINT * value:
                continue
            near_event = np.any(np.abs(special - value) < _EVENT_DISTANCE * value)
            neighbours = {previous, value, following.value}
            if not near_event or value in ends or not neighbours.isdisjoint(special):
                kept.append(point)
        return kept


def _value(point: EnvelopePoint) -> float:
    return point.value


def _event_kind(before: Conditions, after: Conditions) -> EnvelopeEvent:
    """The kind of event between two points of a branch."""
    first, second = before.maximum, after.maximum
    if second.kind == MaximumKind.SMOOTH and not second.switches.any() and first.switches.any():
        return EnvelopeEvent.STICK
    slips = np.count_nonzero(second.switches) - np.count_nonzero(first.switches)
    if first.kind != second.kind or not slips:
        return EnvelopeEvent.KIND
    return EnvelopeEvent.ONSET if slips > 0 else EnvelopeEvent.RELEASE
