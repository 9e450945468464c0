"""Solutions with an error estimate, and branch parts of different levels that make a curve."""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from symhbm.continuation import Branch, Event, PathPoint, PathState, Status
from symhbm.continuation.between import Peak, amplitude_and_slope, is_smooth_fold, leading
from symhbm.numerics import FloatArray
from symhbm.response.accuracy.truncation import SMALLEST


@dataclass(frozen=True)
class Solution:
    """A response (n_unknowns,) [m] at a value of the moving parameter, None if it was not found.

    ``level`` is that of its harmonics, ``error`` the relative truncation error, ``solves`` the
    number of linear solves, ``tangents`` (2, n_unknowns + 1) the tangents of the path before and
    after it, ``events`` those at it. At a fold the last entry of a tangent is 0.
    """

    value: float
    level: int
    unknowns: FloatArray | None
    error: float
    solves: int
    tangents: FloatArray | None = None
    events: tuple[Event, ...] = ()

    @classmethod
    def of(cls, point: PathPoint, level: int, error: float) -> "Solution":
        """The solution at a point of a path."""
        tangents = np.stack([point.before, point.after])
        if is_smooth_fold(point):
            tangents[:, -1] = 0.0
        solution = point.value, level, point.unknowns, error
        return cls(*solution, point.solves, tangents, point.events)

    @classmethod
    def at(cls, value: float, level: int, state: PathState | None, solves: int) -> "Solution":
        """The solution at a value between the points of a path; ``state`` None: not found."""
        if state is None:
            return cls(value, level, None, np.nan, solves)
        tangents = np.stack([state.direction] * 2)
        return cls(value, level, state.state[:-1], np.nan, solves, tangents)


@dataclass(frozen=True)
class BranchPart:
    """The points ``first`` to ``last`` of a branch, and the peaks between them.

    ``at_points`` are the solutions at all points of the branch, some perhaps with more harmonics
    than its ``level``; ``between`` those between two points, by the number of the first;
    ``peak_errors`` the truncation errors of ``peaks``.
    """

    branch: Branch
    level: int
    first: int
    last: int
    at_points: list[Solution]
    peaks: list[Peak]
    peak_errors: list[float]
    between: dict[int, list[Solution]] = field(default_factory=dict)

    def contains(self, value: float) -> bool:
        """Whether a value lies between the first and the last point."""
        if self.last < self.first:
            return False
        low, high = sorted(self.branch.points[i].value for i in (self.first, self.last))
        return low <= value <= high

    def cut(self, first: int, last: int) -> "BranchPart":
        """The part from point ``first`` to ``last`` with the peaks between them."""
        part = BranchPart(self.branch, self.level, first, last, self.at_points, [], [])
        for peak, error in zip(self.peaks, self.peak_errors, strict=True):
            if part.contains(peak.value):
                part.peaks.append(peak)
                part.peak_errors.append(error)
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
    errors += [error for part in parts for error in part.peak_errors]
    if accuracy is not None and max(errors, default=0.0) > accuracy:
        return Status.ACCURACY_NOT_REACHED
    return Status.REACHED_END


def agree(coarse: BranchPart, i: int, fine: BranchPart, j: int, accuracy: float) -> bool:
    """Whether point ``i`` of a branch and ``j`` of one with more harmonics agree at a value.

    Compared are the amplitudes, the contact states and the signs of the slopes.
    """
    coarse_point, fine_point = coarse.branch.points[i], fine.branch.points[j]
    if not np.array_equal(coarse_point.slip, fine_point.slip):
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


def merged(spans: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Spans in ascending order; those that touch or overlap become one."""
    result: list[tuple[int, int]] = []
    for first, last in sorted(spans):
        if result and first <= result[-1][1]:
            result[-1] = result[-1][0], max(last, result[-1][1])
        else:
            result.append((first, last))
    return result
