"""The upper envelope of maxima over one parameter: its points, its minima and its events.

Over a range where one branch leads, changes of contact states and minima are solved for.
"""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import pairwise

import numpy as np

from symhbm.numerics import bracketed_root
from symhbm.peaks.conditions import Conditions
from symhbm.peaks.maximum import MaximumKind
from symhbm.peaks.tracking.branches import MaximumBranch, Parameter
from symhbm.peaks.tracking.interpolation import fill
from symhbm.peaks.tracking.step import polished
from symhbm.peaks.tracking.tolerances import ENVELOPE_DEPTH, SHORTEST_INTERVAL, SURVEY_OFFSET


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


@dataclass(frozen=True)
class UpperEnvelope:
    """The highest of several branches: its ``points``, ``minima`` and ``events``.

    ``unresolved`` are values where the lead changes and the new leader could not be solved for, or
    is not as high.
    """

    parameter: Parameter
    points: list[EnvelopePoint] = field(default_factory=list)
    minima: list[EnvelopePoint] = field(default_factory=list)
    events: list[EnvelopePoint] = field(default_factory=list)
    unresolved: list[float] = field(default_factory=list)

    @property
    def values_to_verify(self) -> list[float]:
        """Values where a missed maximum would show first: minima, exchanges and jumps."""
        sharp = MinimumKind.SMOOTH, MinimumKind.EXCHANGE, EnvelopeEvent.EXCHANGE
        values = {p.value for p in (*self.minima, *self.events) if p.kind in sharp}
        # At a kink two maxima merge, which a survey may not resolve: it is verified on both sides.
        kinks = [p.value for p in self.minima if p.kind == MinimumKind.KINK]
        values |= {kink * (1 + side * SURVEY_OFFSET) for kink in kinks for side in (-1, 1)}
        low, high = self.parameter.low, self.parameter.high
        return sorted(value for value in {*self.unresolved, *values} if low < value < high)

    def add_span(self, branch: MaximumBranch, start: float, end: float) -> None:
        """Add points, minima and events of one branch over the range where it leads."""
        # Points on either side of an event, for both of its slopes.
        for share in (0.0, SHORTEST_INTERVAL, 1 - SHORTEST_INTERVAL, 1.0):
            value = self.parameter.value(start, end, share)
            conditions = branch.at(value)
            if conditions is not None:
                branch.insert(value, conditions)
        fill(branch, start, end)
        first, last = bisect_left(branch.values, start), bisect_right(branch.values, end) - 1
        pairs = zip(branch.values, branch.conditions, strict=True)
        points = [EnvelopePoint(*pair) for pair in pairs][first : last + 1]
        self.points.extend(points)
        slope = self.parameter.slope
        for i, (point, following) in enumerate(pairwise(points), first):
            if i not in branch.events:
                self._add_minima(branch, point, following)
                continue
            event = point if point.value == branch.events[i] else following
            kind = _event_kind(point.conditions, following.conditions)
            self.events.append(EnvelopePoint(event.value, event.conditions, kind))
            left, right = slope(point.conditions), slope(following.conditions)
            if left < 0 <= right or left <= 0 < right:
                self.minima.append(EnvelopePoint(event.value, event.conditions, MinimumKind.KINK))

    def _add_minima(
        self, branch: MaximumBranch, point: EnvelopePoint, following: EnvelopePoint, depth: int = 0
    ) -> None:
        """Add the minima between two points of a branch without an event in between."""
        left, right = map(self.parameter.slope, (point.conditions, following.conditions))
        if left < 0 < right:
            self._add_smooth_minimum(branch, point, following)
            return
        if left < 0 == right:
            self.minima.append(
                EnvelopePoint(following.value, following.conditions, MinimumKind.SMOOTH)
            )
        low, high = self.parameter.coordinate(np.array([point.value, following.value]))
        if depth > ENVELOPE_DEPTH or high - low < SHORTEST_INTERVAL or left == right == 0:
            return
        values = self.parameter.at_coordinate(low + np.linspace(0, 1, 6)[1:-1] * (high - low))
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
            return self.parameter.slope(solved[value])

        try:
            value = bracketed_root(slope, point.value, following.value, precision=1e-15)
            slope(value)
        except ArithmeticError:
            self.unresolved.append(point.value)
            return
        self.minima.append(EnvelopePoint(value, solved[value], MinimumKind.SMOOTH))
        self.points.append(EnvelopePoint(value, solved[value]))


def _event_kind(before: Conditions, after: Conditions) -> EnvelopeEvent:
    """The kind of event between two points of a branch."""
    first, second = before.maximum, after.maximum
    if second.kind == MaximumKind.SMOOTH and not second.switches.any() and first.switches.any():
        return EnvelopeEvent.STICK
    slips = np.count_nonzero(second.switches) - np.count_nonzero(first.switches)
    if first.kind != second.kind or not slips:
        return EnvelopeEvent.KIND
    return EnvelopeEvent.ONSET if slips > 0 else EnvelopeEvent.RELEASE
