"""Upper envelope of branches of maxima over one parameter, with its minima and events.

Exchanges of the lead, changes of contact states at the leading maximum and minima of the envelope
are solved for.
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
from symhbm.peaks.tracking.branches import (
    SAME_MAXIMUM,
    FollowedBranches,
    MaximumBranch,
    is_same_maximum,
)
from symhbm.peaks.tracking.interpolation import crossing, fill
from symhbm.peaks.tracking.step import polished, relative_height
from symhbm.peaks.tracking.track import TrackStatus

_SUBDIVISION = 4
"""Subdivisions of the interval between two solved values for comparing heights."""
_MAX_DEPTH = 6
_CROSSING_DISTANCE = 1e-5
"""Relative distance from where a peak crosses the end of the band within which both are equal."""
_OFFSET = 1e-3
"""Relative distance from a kink or a jump at which a survey verifies the envelope."""
_MIN_LENGTH = 1e-7
"""Length of an interval below which no event is expected."""
_EVENT_DISTANCE = 1e-4
"""Relative distance from an event within which one further point on either side suffices."""
_MAX_JUMP = 1e-6
"""Relative difference of heights at an exchange beyond round-off."""
_SAME_POINT = 1e-12
"""Relative distance below which two points are the same."""
_SAME_MINIMUM = 1e-9
"""Relative distance below which two minima are the same."""


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


class UpperEnvelope:
    """The highest of several branches: its ``points``, ``minima`` and ``events``, ascending.

    It is not defined within ``unbounded`` ranges. ``unresolved`` are values where the lead changes
    and the new leader could not be solved for, or is not as high.
    """

    def __init__(self, followed: FollowedBranches, unbounded: Sequence[tuple[float, float]] = ()):
        self._unbounded = unbounded
        self._followed, self._parameter = followed, followed.parameter
        self.points: list[EnvelopePoint] = []
        self.minima: list[EnvelopePoint] = []
        self.events: list[EnvelopePoint] = []
        self.unresolved: list[float] = []
        self._spans: list[tuple[MaximumBranch, float, float]] = []
        if followed.branches:
            self._find_spans()
            for span in self._spans:
                self._add_span_points(*span)
            self.points.sort(key=lambda point: point.value)
            self._find_end_minima()
            poles = [
                p for p in followed.poles if any(low <= p[0] <= high for low, high in unbounded)
            ]
            self.events += [EnvelopePoint(*pole, EnvelopeEvent.POLE) for pole in poles]
        for points in (self.minima, self.events):
            points.sort(key=lambda point: point.value)
        # A minimum at a surveyed value belongs to the spans on both of its sides.
        previous = [-np.inf, *(minimum.value for minimum in self.minima)]
        pairs = zip(self.minima, previous, strict=False)
        self.minima = [
            minimum
            for minimum, last in pairs
            if minimum.value - last > _SAME_MINIMUM * minimum.value
        ]
        self._drop_redundant_points()

    @property
    def values_to_verify(self) -> list[float]:
        """Values where a missed maximum would show first: minima, exchanges and jumps."""
        parameter = self._parameter
        sharp = MinimumKind.SMOOTH, MinimumKind.EXCHANGE, EnvelopeEvent.EXCHANGE
        values = {
            *self.unresolved,
            *(p.value for p in (*self.minima, *self.events) if p.kind in sharp),
        }
        # At a kink two maxima merge, which a survey may not resolve: it is verified on both sides.
        kinks = [p.value for p in self.minima if p.kind == MinimumKind.KINK]
        values |= {share * kink for kink in kinks for share in (1 - _OFFSET, 1 + _OFFSET)}
        return sorted(value for value in values if parameter.low < value < parameter.high)

    def _heights(self, values: FloatArray) -> FloatArray:
        heights = np.array([branch.heights(values) for branch in self._followed.branches])
        for low, high in self._unbounded:
            heights[:, (values > low) & (values < high)] = -np.inf
        return heights

    def _find_spans(self) -> None:
        """Determine which branch leads over which range."""
        coordinate = self._parameter.coordinate
        solved_values = np.unique([v for b in self._followed.branches for v in b.values])
        inner = np.linspace(0, 1, _SUBDIVISION, endpoint=False)
        coordinates = coordinate(solved_values)
        refined = (coordinates[:-1, None] + inner * np.diff(coordinates)[:, None]).ravel()
        grid = np.exp(refined) if self._parameter.logarithmic else refined
        grid = np.unique(
            np.append(np.clip(grid, solved_values[0], solved_values[-1]), solved_values)
        )
        heights = self._heights(grid)
        leader, start = -1, grid[0]
        for k, column in enumerate(heights.T):
            highest = int(np.argmax(column >= (1 - TIE) * column.max()))
            if leader >= 0 and column[leader] >= (1 - TIE) * column[highest]:
                continue
            if not np.isfinite(column[highest]):
                if leader >= 0:
                    self._add_span(leader, start, grid[k - 1])
                leader = -1
                continue
            if leader < 0:
                start = grid[k]
            else:
                for low, high, first, second in self._exchanges(
                    grid[k - 1], grid[k], leader, highest
                ):
                    exchange = self._exchange(low, high, first, second)
                    self._add_span(first, start, exchange)
                    start = exchange
            leader = highest
        if leader >= 0:
            self._add_span(leader, start, grid[-1])

    def _add_span(self, index: int, start: float, end: float) -> None:
        branch = self._followed.branches[index]
        start, end = max(start, branch.values[0]), min(end, branch.values[-1])
        if end >= start:
            self._spans.append((branch, start, end))

    def _exchanges(
        self, low: float, high: float, first: int, second: int, depth: int = 0
    ) -> list[tuple[float, float, int, int]]:
        """The exchanges of the lead between two branches, possibly by way of a third."""
        value = crossing(self._followed.branches[first], self._followed.branches[second], low, high)
        if value is None or depth > _MAX_DEPTH:
            return [(low, high, first, second)]
        column = self._heights(np.array([value]))[:, 0]
        highest = int(np.argmax(column))
        if column[highest] <= (1 + TIE) * max(column[[first, second]]):
            return [(low, high, first, second)]
        earlier = self._exchanges(low, value, first, highest, depth + 1)
        return earlier + self._exchanges(value, high, highest, second, depth + 1)

    def _exchange(self, low: float, high: float, first: int, second: int) -> float:
        """The value where the lead changes; an event unless both branches share one maximum."""
        a, b = self._followed.branches[first], self._followed.branches[second]
        value = crossing(a, b, low, high)
        if value is None:
            value = a.values[-1] if low <= a.values[-1] <= high else b.values[0]
            value = float(np.clip(value, low, high))
        before, after = a.at(value), b.at(value)
        if before is None or after is None:
            self.unresolved.append(value)
            return value
        # At this crossing peak and edge are equal to second order in the distance.
        leaves_band = (
            a.values[-1] <= value * (1 + _CROSSING_DISTANCE)
            and a.end_status[1] == TrackStatus.LEFT_BAND
        )
        enters_band = (
            b.values[0] >= value * (1 - _CROSSING_DISTANCE)
            and b.end_status[0] == TrackStatus.LEFT_BAND
        )
        if leaves_band or enters_band:
            value = a.values[-1] if leaves_band else b.values[0]
            self.events.append(EnvelopePoint(value, before, EnvelopeEvent.BAND))
        elif not is_same_maximum(before, after):
            difference = relative_height(after.maximum, before.maximum)
            if abs(difference) > _MAX_JUMP:
                # The largest response is continuous: a maximum was missed on the lower side.
                self.unresolved.append(value * (1 + _OFFSET if difference < 0 else 1 - _OFFSET))
            last_event = self.events[-1:]
            if not (
                last_event
                and last_event[0].kind == EnvelopeEvent.EXCHANGE
                and abs(value / last_event[0].value - 1) < SAME_MAXIMUM
            ):
                self.events.append(EnvelopePoint(value, before, EnvelopeEvent.EXCHANGE))
            self.points.append(EnvelopePoint(value, before))
            if self._parameter.slope(before) < 0 < self._parameter.slope(after):
                self.minima.append(EnvelopePoint(value, before, MinimumKind.EXCHANGE))
        return value

    def _add_span_points(self, branch: MaximumBranch, start: float, end: float) -> None:
        """Add points, minima and events of one branch over the range where it leads."""
        # Points on either side of an event, for both of its slopes.
        for value in (
            self._parameter.value(start, end, s) for s in (0.0, _MIN_LENGTH, 1 - _MIN_LENGTH, 1.0)
        ):
            conditions = branch.at(value)
            if conditions is not None:
                branch.insert(value, conditions)
        fill(branch, start, end)
        first, last = bisect_left(branch.values, start), bisect_right(branch.values, end) - 1
        points = [
            EnvelopePoint(branch.values[i], branch.conditions[i]) for i in range(first, last + 1)
        ]
        self.points += points
        events = {i - first: event for i, event in branch.events.items() if first <= i < last}
        slope = self._parameter.slope
        for i, (point, following) in enumerate(pairwise(points)):
            if i not in events:
                self._find_minima(branch, point, following)
                continue
            event = point if point.value == events[i] else following
            self.events.append(
                EnvelopePoint(
                    event.value,
                    event.conditions,
                    _event_kind(point.conditions, following.conditions),
                )
            )
            left, right = slope(point.conditions), slope(following.conditions)
            if left < 0 <= right or left <= 0 < right:
                self.minima.append(EnvelopePoint(event.value, event.conditions, MinimumKind.KINK))

    def _find_minima(
        self, branch: MaximumBranch, point: EnvelopePoint, following: EnvelopePoint, depth: int = 0
    ) -> None:
        """Add the minima between two points of a branch without an event in between."""
        slope = self._parameter.slope
        slopes = slope(point.conditions), slope(following.conditions)
        if slopes[0] < 0 < slopes[1]:
            self._solve_minimum(branch, point, following)
            return
        if slopes[0] < 0 == slopes[1]:
            self.minima.append(
                EnvelopePoint(following.value, following.conditions, MinimumKind.SMOOTH)
            )
        limits = self._parameter.coordinate(np.array([point.value, following.value]))
        coordinates = limits[0] + np.linspace(0, 1, 6)[1:-1] * (limits[1] - limits[0])
        values = np.exp(coordinates) if self._parameter.logarithmic else coordinates
        if depth > _MAX_DEPTH or limits[1] - limits[0] < _MIN_LENGTH or slopes[0] == slopes[1] == 0:
            return
        signs = np.sign(branch.slopes(values))
        candidates = np.flatnonzero(np.diff(np.concatenate([[slopes[0]], signs, [slopes[1]]]) > 0))
        if len(candidates) < 1 + (slopes[0] * slopes[1] < 0):
            return
        value = float(values[min(candidates[0], len(values) - 1)])
        conditions = branch.at(value)
        if conditions is not None:
            middle = EnvelopePoint(value, conditions)
            self._find_minima(branch, point, middle, depth + 1)
            self._find_minima(branch, middle, following, depth + 1)

    def _solve_minimum(
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
            value = float(
                scipy.optimize.brentq(slope, point.value, following.value, xtol=1e-300, rtol=1e-15)
            )  # type: ignore
            slope(value)
        except ArithmeticError:
            self.unresolved.append(point.value)
            return
        self.minima.append(EnvelopePoint(value, solved[value], MinimumKind.SMOOTH))
        self.points.append(EnvelopePoint(value, solved[value]))

    def _find_end_minima(self) -> None:
        """Add minima where the envelope falls towards an end of the band."""
        slope, first, last = self._parameter.slope, self.points[0], self.points[-1]
        if first.value == self._parameter.low and slope(first.conditions) > 0:
            self.minima.append(EnvelopePoint(first.value, first.conditions, MinimumKind.END))
        if last.value == self._parameter.high and slope(last.conditions) < 0:
            self.minima.append(EnvelopePoint(last.value, last.conditions, MinimumKind.END))

    def _drop_redundant_points(self) -> None:
        """Remove duplicate points and those close to an event that its neighbours replace."""
        special = np.array([point.value for point in (*self.events, *self.minima)])
        ends = self._parameter.low, self._parameter.high
        kept: list[EnvelopePoint] = []
        for point, following in zip(self.points, [*self.points[1:], None], strict=True):
            previous, value = kept[-1].value if kept else -np.inf, point.value
            if value - previous <= _SAME_POINT * value:
                continue
            near_event = np.any(np.abs(special - value) < _EVENT_DISTANCE * value)
            neighbours = {previous, value, following.value if following else value}
            if not near_event or value in ends or not neighbours.isdisjoint(special):
                kept.append(point)
        self.points = kept


def _event_kind(before: Conditions, after: Conditions) -> EnvelopeEvent:
    """The kind of event between two points of a branch."""
    first, second = before.maximum, after.maximum
    if second.kind == MaximumKind.SMOOTH and not second.slip.any() and first.slip.any():
        return EnvelopeEvent.STICK
    slips = np.count_nonzero(second.slip) - np.count_nonzero(first.slip)
    if first.kind != second.kind or not slips:
        return EnvelopeEvent.KIND
    return EnvelopeEvent.ONSET if slips > 0 else EnvelopeEvent.RELEASE
