"""Parts of walks with their own sets of harmonics, which together make a curve."""

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

    ``level`` tells its set of harmonics, ``error`` what the harmonics left out make, ``solves`` the
    linear solves spent on it, ``tangents`` (2, n_unknowns + 1) the directions of the path before
    and after it, ``events`` what happens there. Across a fold the last entry of tangents is 0.
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
        """The response at a point of a path."""
        tangents = np.stack([point.before, point.after])
        if is_smooth_fold(point):
            tangents[:, -1] = 0.0
        state = point.value, level, point.unknowns
        return cls(*state, error, point.solves, tangents, point.events)

    @classmethod
    def at(cls, value: float, level: int, station: PathState | None, solves: int) -> "Solution":
        """The response at a value that was asked for, None if it was not found."""
        if station is None:
            return cls(value, level, None, np.nan, solves)
        tangents = np.stack([station.direction] * 2)
        return cls(value, level, station.state[:-1], np.nan, solves, tangents)


@dataclass(frozen=True)
class BranchPart:
    """The points ``first`` to ``last`` of a walk, and the peaks between them.

    ``responses`` are those at all points of the walk, some perhaps with more harmonics than its
    ``level``; ``between`` those between two of its points, by the number of the first;
    ``peak_errors``, those of ``peaks`` by truncation.
    """

    walk: Branch
    level: int
    first: int
    last: int
    responses: list[Solution]
    peaks: list[Peak]
    peak_errors: list[float]
    between: dict[int, list[Solution]] = field(default_factory=dict)

    def holds(self, value: float) -> bool:
        """Whether a value lies between the first and the last point."""
        if self.last < self.first:
            return False
        low, high = sorted(self.walk.points[i].value for i in (self.first, self.last))
        return low <= value <= high

    def part(self, first: int, last: int) -> "BranchPart":
        """The points ``first`` to ``last`` and the peaks between them."""
        cut = BranchPart(self.walk, self.level, first, last, self.responses, [], [])
        for peak, error in zip(self.peaks, self.peak_errors, strict=True):
            if cut.holds(peak.value):
                cut.peaks.append(peak)
                cut.peak_errors.append(error)
        return cut

    def own(self) -> list[Solution]:
        """The responses from the first to the last point, and those between."""
        return [
            response
            for i in range(self.first, self.last + 1)
            for response in (self.responses[i], *(self.between.get(i, ()) if i < self.last else ()))
        ]


def joined(stretches: list[BranchPart]) -> list[Solution]:
    """The responses of all stretches, each value once: where two meet, with more harmonics."""
    found = [stretch.own() for stretch in stretches]
    for (left, right), (one, other) in zip(pairwise(found), pairwise(stretches), strict=True):
        if left and right and left[-1].value == right[0].value:
            (left.pop() if other.level > one.level else right.pop(0))
    return [response for part in found for response in part]


def status_of(stretches: list[BranchPart], accuracy: float | None) -> Status:
    """How a curve ended: by the first walk that did not reach its end, or by its errors."""
    for stretch in stretches:
        if stretch.walk.status != Status.REACHED_END:
            return stretch.walk.status
    errors = [response.error for part in stretches for response in part.own()]
    errors += [error for part in stretches for error in part.peak_errors]
    if accuracy is not None and max(errors, default=0.0) > accuracy:
        return Status.ACCURACY_NOT_REACHED
    return Status.REACHED_END


def agree(stretch: BranchPart, i: int, other: BranchPart, j: int, accuracy: float) -> bool:
    """Whether two walks agree at a value: amplitudes, contact states and directions of slopes.

    ``i`` and ``j`` are the points of the walks there; the second has more harmonics.
    """
    here, there = stretch.walk.points[i], other.walk.points[j]
    if not np.array_equal(here.slip, there.slip):
        return False
    (level, slope), (finer, finer_slope) = (
        amplitude_and_slope(part.walk.curve.problem, point.unknowns, point.after[:-1])
        for part, point in ((stretch, here), (other, there))
    )
    if np.any(np.abs(level - finer) > accuracy * np.maximum(finer, SMALLEST * finer.max())):
        return False
    alike = np.sign(slope * here.after[-1]) == np.sign(finer_slope * there.after[-1])
    return bool(alike.all() if stretch.walk.per_dof else alike[leading(finer)])


def merged(spans: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Spans in ascending order, those that touch or overlap made one."""
    result: list[tuple[int, int]] = []
    for first, last in sorted(spans):
        if result and first <= result[-1][1]:
            result[-1] = result[-1][0], max(last, result[-1][1])
        else:
            result.append((first, last))
    return result
