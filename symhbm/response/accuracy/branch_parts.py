"""Solutions with an error estimate, and branch parts of different levels that make a curve."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from symhbm.continuation import Branch, Event, PathPoint, PathState, Status
from symhbm.continuation.between import Peak, amplitude_and_slope, leading
from symhbm.numerics import FloatArray
from symhbm.response.accuracy.truncation import SMALLEST, Truncation

_MARGIN = 2
"""Points that a refined part adds at both ends, so that it agrees with its neighbours there."""

Span = tuple[int, int]
"""First and last of consecutive points."""


class Solution(NamedTuple):
    """A response (n_unknowns,) [m] at a value of the moving parameter, None if it was not found.

    ``level`` is that of its harmonics, ``error`` the relative truncation error, ``solves`` the
    number of linear solves, ``tangents`` (n_unknowns + 1,) the two of the path before and
    after it, ``events`` those at it. At a fold the last entry of a tangent is 0. ``normal``
    (n_contacts,) are errors of normal forces, as of `Truncation`.
    """

    value: float
    level: int
    unknowns: FloatArray | None
    error: float
    solves: int
    tangents: Sequence[FloatArray] = ()
    events: tuple[Event, ...] = ()
    normal: FloatArray = np.zeros(0)

    @classmethod
    def of(cls, point: PathPoint, level: int, truncation: Truncation) -> "Solution":
        """The solution at a point of a path."""
        tangents = point.before, point.after
        if point.events and point.is_smooth_fold:
            tangents = tuple(np.append(tangent[:-1], 0.0) for tangent in tangents)
        solution = point.value, level, point.unknowns, truncation.error
        return cls(*solution, point.solves, tangents, point.events, truncation.normal)

    @classmethod
    def at(cls, value: float, level: int, state: PathState | None, solves: int) -> "Solution":
        """The solution at a value between the points of a path; ``state`` None: not found."""
        if state is None:
            return cls(value, level, None, np.nan, solves)
        tangents = state.direction, state.direction
        return cls(value, level, state.state[:-1], np.nan, solves, tangents)


@dataclass(frozen=True)
class BranchPart:
    """The points ``first`` to ``last`` of a branch, and the peaks between them.

    ``at_points`` are the solutions at all points of the branch, some perhaps with more harmonics
    than its ``level``; ``between`` those between two points, by the number of the first; ``peaks``
    have their truncation errors.
    """

    branch: Branch
    level: int
    first: int
    last: int
    at_points: list[Solution]
    peaks: list[tuple[Peak, float]]
    between: dict[int, list[Solution]] = field(default_factory=dict)

    @classmethod
    def gap(cls, branch: Branch, level: int, value: float) -> "BranchPart":
        """What stands for the values beyond an interrupted branch that are not computed."""
        nothing = replace(branch, points=[], peaks=[], between={})
        return cls(nothing, level, 0, 0, [Solution.at(value, level, None, 0)], [])

    def contains(self, value: float) -> bool:
        """Whether a value lies between the first and the last point."""
        if self.last < self.first or not self.branch.points:
            return False
        low, high = sorted(self.branch.points[i].value for i in (self.first, self.last))
        return low <= value <= high

    def cut(self, first: int, last: int) -> "BranchPart":
        """The part from point ``first`` to ``last`` with the peaks between them."""
        part = BranchPart(self.branch, self.level, first, last, self.at_points, [])
        part.peaks.extend(of for of in self.peaks if part.contains(of[0].value))
        return part

    def solutions(self) -> list[Solution]:
        """The solutions from the first to the last point, and those between points."""
        return [
            solution
            for i in range(self.first, self.last + 1)
            for solution in (self.at_points[i], *(self.between.get(i, ()) if i < self.last else ()))
        ]


def joined(parts: list[BranchPart]) -> list[Solution]:
    """The solutions of all parts; at a value where two parts meet, that with more harmonics."""
    solutions = [part.solutions() for part in parts]
    for (left, right), (before, after) in zip(pairwise(solutions), pairwise(parts), strict=True):
        if left and right and left[-1].value == right[0].value:
            (left.pop() if after.level > before.level else right.pop(0))
    return [solution for of_part in solutions for solution in of_part]


def status_of(parts: list[BranchPart], accuracy: float | None) -> Status:
    """Status of a curve: of the first branch that did not reach its end, else by the errors."""
    for part in parts:
        if part.branch.status != Status.REACHED_END:
            return part.branch.status
    errors = [solution.error for part in parts for solution in part.solutions()]
    errors += [error for part in parts for _, error in part.peaks]
    if accuracy is not None and max(errors, default=0.0) > accuracy:
        return Status.ACCURACY_NOT_REACHED
    return Status.REACHED_END


def replaced(
    whole: BranchPart,
    inaccurate: np.ndarray,
    refined: Callable[[Span], list[BranchPart] | None],
    accuracy: float,
) -> list[BranchPart]:
    """The whole with its ``inaccurate`` points replaced, by parts that agree at their ends.

    ``refined`` gives the parts with more harmonics over a span of points, None where they failed.
    """
    by_span: dict[Span, list[BranchPart] | None] = {}
    numbers = np.flatnonzero(inaccurate).tolist()
    spans = _merged([_widened(whole, (i, i), inaccurate) for i in numbers])
    while True:
        for span in spans:
            if span not in by_span:
                by_span[span] = refined(span)
        wider = [_agreeing(whole, span, by_span[span], inaccurate, accuracy) for span in spans]
        if wider == spans:
            break
        spans = _merged(wider)
    result, at = [], 0
    for first, last in spans:
        parts = by_span[first, last]
        if parts is not None:
            result += [whole.cut(at, first)] if first > at else []
            result += parts
            at = last
    return result + ([whole.cut(at, whole.last)] if at < whole.last else [])


def _agreeing(
    whole: BranchPart,
    span: Span,
    parts: list[BranchPart] | None,
    inaccurate: np.ndarray,
    accuracy: float,
) -> Span:
    """The same span if the whole agrees with ``parts`` at both ends, else a wider one."""
    if parts is None:
        return span
    first, last = span
    wide = _widened(whole, span, inaccurate, by=max(_MARGIN, (last - first) // 2))
    low, high = parts[0], parts[-1]
    if first > 0 and not _agree(whole, first, low, low.first, accuracy):
        first = wide[0]
    if last < whole.last and not _agree(whole, last, high, high.last, accuracy):
        last = wide[1]
    return first, last


def _widened(whole: BranchPart, span: Span, inaccurate: np.ndarray, by: int = _MARGIN) -> Span:
    """A span and a margin, with ends at accurate points that are neither events nor peaks."""
    peaks, points, ends = {peak.value for peak, _ in whole.peaks}, whole.branch.points, []

    def unfit(i: int) -> bool:
        return bool(inaccurate[i] or points[i].events or points[i].value in peaks)

    for end, direction in zip(span, (-1, 1), strict=True):
        at = end + direction * by
        while 0 < at < whole.last and unfit(at):
            at += direction
        ends.append(min(max(at, 0), whole.last))
    return ends[0], ends[1]


def _agree(coarse: BranchPart, i: int, fine: BranchPart, j: int, accuracy: float) -> bool:
    """Whether point ``i`` of a branch and ``j`` of one with more harmonics agree at a value.

    Compared are the amplitudes, the contact states and the signs of the slopes.
    """
    coarse_point, fine_point = coarse.branch.points[i], fine.branch.points[j]
    if not np.array_equal(coarse_point.switches, fine_point.switches):
        return False
    (amplitude, slope), (fine_amplitude, fine_slope) = (
        amplitude_and_slope(part.branch.curve.problem, point.unknowns, point.after[:-1])
        for part, point in ((coarse, coarse_point), (fine, fine_point))
    )
    allowed = accuracy * np.maximum(fine_amplitude, SMALLEST * fine_amplitude.max())
    if np.any(np.abs(amplitude - fine_amplitude) > allowed):
        return False
    alike = np.sign(slope * coarse_point.after[-1]) == np.sign(fine_slope * fine_point.after[-1])
    return bool(alike.all() if coarse.branch.per_dof else alike[leading(fine_amplitude)])


def _merged(spans: list[Span]) -> list[Span]:
    """Spans in ascending order; those that touch or overlap become one."""
    result: list[Span] = []
    for first, last in sorted(spans):
        if result and first <= result[-1][1]:
            result[-1] = result[-1][0], max(last, result[-1][1])
        else:
            result.append((first, last))
    return result
