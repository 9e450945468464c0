"""Peaks of a goal along a path: where its slope falls through zero, or from one side to another.

Values and slopes at two points of the path give a cubic. Where the goal half way is another than
that of the cubic, points are added, until slopes tell where it turns.
"""

from collections.abc import Collection
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from symhbm.balance import ValueOf
from symhbm.balance.goals import Goal
from symhbm.continuation.between.slopes import Peak, PeakKind
from symhbm.continuation.correctors import Corrector
from symhbm.continuation.point import PathPoint
from symhbm.continuation.segment import Segment
from symhbm.numerics import FloatArray, bracketed_root

_CUBIC = 1e-3
"""Error of a cubic half way, over the larger of both values, up to which it tells slopes."""
_MAX_HALVINGS = 8
_SHARES = np.linspace(0, 1, 9)
_NONE = 1e-7
"""Slope at an end, over the largest of a segment, that is 0: a path has a point at each peak."""
_CONSTANT = 1e-9
"""Change along a segment, over the goal, that is none."""


class _At(NamedTuple):
    """The goal at a share of a segment: ``slope`` by that share."""

    state: FloatArray
    value: float
    slope: float


def goal_peaks(
    goal: Goal, points: list[PathPoint], corrector: Corrector, left_out: Collection[int]
) -> tuple[list[Peak], int]:
    """The peaks of a goal between points of a frequency response, corners at points among them.

    Segments whose first points are ``left_out`` have none. With it, in how many it is not known.
    """
    peaks: list[Peak] = []
    before: _At | None = None
    lost = 0
    for number, (left, right) in enumerate(pairwise(points)):
        along = _Along(Segment.of(corrector, left, right), goal)
        if not along.segment.length > 0:
            continue
        first, last = along.at(0.0), along.at(1.0)
        if left.events and before and before.slope > _CONSTANT * before.value and first.slope < 0:
            along.add(first, PeakKind.CORNER)
        try:
            if number not in left_out:
                along.search(0.0, 1.0, _MAX_HALVINGS)
        except ArithmeticError:
            lost += 1
        peaks += along.peaks
        before = last
    return peaks, lost


@dataclass
class _Along:
    """A goal along a segment, where it is ``known``, and its ``peaks`` that were found."""

    segment: Segment
    goal: Goal
    known: dict[float, _At] = field(default_factory=dict)
    peaks: list[Peak] = field(default_factory=list)

    def at(self, share: float) -> _At:
        """The goal at a share of the segment; ArithmeticError where there is no solution."""
        if share not in self.known:
            segment, problem = self.segment, self.segment.curve.problem
            ends = {0.0: segment.left, 1.0: segment.right}
            path_state = ends.get(share) or segment.solve(share) or segment.solve_between(share)
            if path_state is None:
                raise ArithmeticError("a solution between two points of the path is not known")
            state, direction = path_state.state, path_state.direction
            solution = state[:-1], float(state[-1])
            # A contact may be in another state for a moment between two points of the path.
            states = problem.locate(*solution, segment.switches if share in ends else None)
            found = ValueOf.at(self.goal, problem, *solution, states)
            found = found.checked(self.goal, solution[1])
            ahead = segment.normal @ (direction / segment.scale)
            slope = float(found.slope @ direction * segment.length / ahead)
            self.known[share] = _At(state, found.value, slope)
        return self.known[share]

    def search(self, low: float, high: float, halvings: int) -> None:
        """Find the peaks between two shares."""
        first, last, width = self.at(low), self.at(high), high - low
        rise, t = last.value - first.value, _SHARES
        slopes = 6 * t * (1 - t) * rise / width
        slopes += first.slope * (1 - t) * (1 - 3 * t) + last.slope * t * (3 * t - 2)
        size, largest = np.abs(slopes).max(), max(first.value, last.value)
        falls = np.where(np.abs(slopes) <= _NONE * size, True, slopes < 0)
        turns = np.count_nonzero(np.diff(falls))
        if width * size <= _CONSTANT * largest:
            return
        if halvings:
            middle = self.at((low + high) / 2)
            cubic = (first.value + last.value) / 2 + width * (first.slope - last.slope) / 8
            if turns > 1 or abs(middle.value - cubic) > _CUBIC * largest:
                self.search(low, (low + high) / 2, halvings - 1)
                self.search((low + high) / 2, high, halvings - 1)
                return
        if falls[-1] and not falls[0]:
            self.add(self._turn(low, high), PeakKind.SMOOTH)

    def add(self, at: _At, kind: PeakKind) -> None:
        """Add a peak."""
        unknowns, value = at.state[:-1], float(at.state[-1])
        norm = self.segment.curve.evaluate(unknowns, value).norm
        self.peaks.append(Peak(value, at.value, -1, kind, unknowns, norm))

    def _turn(self, low: float, high: float) -> _At:
        """Where the slope falls through 0 between two shares."""
        first, last = self.at(low), self.at(high)
        if last.slope >= 0:
            return last
        start = low + (high - low) * first.slope / (first.slope - last.slope)
        return self.at(bracketed_root(lambda share: self.at(share).slope, low, high, start))
