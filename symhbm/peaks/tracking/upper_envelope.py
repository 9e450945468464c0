"""Which of several branches of maxima leads where, and the upper envelope they make."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from symhbm.continuation.between import TIE
from symhbm.numerics import FloatArray
from symhbm.peaks.tracking import tolerances
from symhbm.peaks.tracking.branches import FollowedBranches, MaximumBranch, is_same_maximum
from symhbm.peaks.tracking.envelope import EnvelopeEvent, EnvelopePoint, MinimumKind, UpperEnvelope
from symhbm.peaks.tracking.interpolation import crossing
from symhbm.peaks.tracking.step import relative_height
from symhbm.peaks.tracking.track import TrackStatus


def upper_envelope(
    followed: FollowedBranches, unbounded: Sequence[tuple[float, float]] = ()
) -> UpperEnvelope:
    """The upper envelope of branches, all of it ascending; not defined in ``unbounded`` ranges."""
    envelope = UpperEnvelope(followed.parameter)
    if not followed.branches:
        return envelope
    for span in _Leads(followed.branches, unbounded, envelope).spans():
        envelope.add_span(*span)
    points = sorted(envelope.points, key=_value)
    poles = [p for p in followed.poles if any(low <= p[0] <= high for low, high in unbounded)]
    events = envelope.events + [EnvelopePoint(*pole, EnvelopeEvent.POLE) for pole in poles]
    minima: list[EnvelopePoint] = []
    for minimum in sorted(envelope.minima + _end_minima(envelope, points), key=_value):
        # A minimum at a surveyed value belongs to the spans on both of its sides.
        last = minima[-1].value if minima else -np.inf
        if minimum.value - last > tolerances.SAME_MINIMUM * minimum.value:
            minima.append(minimum)
    envelope = replace(envelope, minima=minima, events=sorted(events, key=_value))
    return replace(envelope, points=_needed(envelope, points))


def _value(point: EnvelopePoint) -> float:
    return point.value


@dataclass
class _Leads:
    """The search for the exchanges of the lead, which it adds to the ``envelope``."""

    branches: list[MaximumBranch]
    unbounded: Sequence[tuple[float, float]]
    envelope: UpperEnvelope

    def spans(self) -> list[tuple[MaximumBranch, float, float]]:
        """The branches that lead, each with the first and last value of a range where it does."""
        parameter = self.envelope.parameter
        solved_values = np.unique([value for branch in self.branches for value in branch.values])
        inner = np.linspace(0, 1, tolerances.SUBDIVISION, endpoint=False)
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
        led = [(self.branches[index], *limits) for index, *limits in ranges if index >= 0]
        spans = [(b, max(start, b.values[0]), min(end, b.values[-1])) for b, start, end in led]
        return [span for span in spans if span[1] <= span[2]]

    def _heights(self, values: FloatArray) -> FloatArray:
        heights = np.array([branch.heights(values) for branch in self.branches])
        for low, high in self.unbounded:
            heights[:, (values > low) & (values < high)] = -np.inf
        return heights

    def _exchanges(
        self, low: float, high: float, first: int, second: int, depth: int = 0
    ) -> list[tuple[float, float, int, int]]:
        """The exchanges of the lead between two branches, possibly by way of a third."""
        value = crossing(self.branches[first], self.branches[second], low, high)
        if value is not None and depth <= tolerances.ENVELOPE_DEPTH:
            column = self._heights(np.array([value]))[:, 0]
            third = int(np.argmax(column))
            if column[third] > (1 + TIE) * max(column[[first, second]]):
                earlier = self._exchanges(low, value, first, third, depth + 1)
                return earlier + self._exchanges(value, high, third, second, depth + 1)
        return [(low, high, first, second)]

    def _add_exchange(self, low: float, high: float, first: int, second: int) -> float:
        """The value where the lead changes; an event unless both branches share one maximum."""
        envelope, a, b = self.envelope, self.branches[first], self.branches[second]
        value = crossing(a, b, low, high)
        if value is None:
            value = a.values[-1] if low <= a.values[-1] <= high else b.values[0]
            value = float(np.clip(value, low, high))
        before, after = a.at(value), b.at(value)
        if before is None or after is None:
            envelope.unresolved.append(value)
            return value
        # At this crossing peak and edge are equal to second order in the distance.
        near, left_band = tolerances.CROSSING_DISTANCE, TrackStatus.LEFT_BAND
        leaves_band = a.values[-1] <= value * (1 + near) and a.end_status[1] == left_band
        enters_band = b.values[0] >= value * (1 - near) and b.end_status[0] == left_band
        if leaves_band or enters_band:
            value = a.values[-1] if leaves_band else b.values[0]
            envelope.events.append(EnvelopePoint(value, before, EnvelopeEvent.BAND))
        elif not is_same_maximum(before, after):
            difference = relative_height(after.maximum, before.maximum)
            if abs(difference) > tolerances.LARGEST_STEP_OF_LEAD:
                # The largest response is continuous: a maximum was missed on the lower side.
                side = 1 if difference < 0 else -1
                envelope.unresolved.append(value * (1 + side * tolerances.SURVEY_OFFSET))
            exchanges = [e for e in envelope.events[-1:] if e.kind == EnvelopeEvent.EXCHANGE]
            if all(abs(value / e.value - 1) >= tolerances.SAME_MAXIMUM for e in exchanges):
                envelope.events.append(EnvelopePoint(value, before, EnvelopeEvent.EXCHANGE))
            envelope.points.append(EnvelopePoint(value, before))
            slope = envelope.parameter.slope
            if slope(before) < 0 < slope(after):
                envelope.minima.append(EnvelopePoint(value, before, MinimumKind.EXCHANGE))
        return value


def _end_minima(envelope: UpperEnvelope, points: list[EnvelopePoint]) -> list[EnvelopePoint]:
    """Minima where the envelope falls towards an end of the band."""
    parameter, first, last = envelope.parameter, points[0], points[-1]
    falls_down = first.value == parameter.low and parameter.slope(first.conditions) > 0
    falls_up = last.value == parameter.high and parameter.slope(last.conditions) < 0
    ends = [first] * falls_down + [last] * falls_up
    return [replace(end, kind=MinimumKind.END) for end in ends]


def _needed(envelope: UpperEnvelope, points: list[EnvelopePoint]) -> list[EnvelopePoint]:
    """The points without duplicates and without those close to an event that others replace."""
    special = np.array([point.value for point in (*envelope.events, *envelope.minima)])
    ends = envelope.parameter.low, envelope.parameter.high
    kept: list[EnvelopePoint] = []
    for point, following in zip(points, [*points[1:], points[-1]], strict=True):
        previous, value = kept[-1].value if kept else -np.inf, point.value
        if value - previous <= tolerances.SAME_POINT * value:
            continue
        near_event = np.any(np.abs(special - value) < tolerances.EVENT_DISTANCE * value)
        neighbours = {previous, value, following.value}
        if not near_event or value in ends or not neighbours.isdisjoint(special):
            kept.append(point)
    return kept
