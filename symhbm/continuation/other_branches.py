"""Branches of solutions beside a path: through its branch points, and from other solutions.

At each branch point two branches cross. The one that was not followed is followed both ways, to the
ends of the band or until it closes, and its branch points are taken in turn. Then another solution
is looked for at both ends of the band, and the branch from it is followed.
"""

from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.branch import Branch
from symhbm.continuation.correctors import Corrector, Hyperplane
from symhbm.continuation.events import (
    Crossing,
    Curvature,
    at_crossing,
    curvature_of,
    passed_pairs,
    solve_crossing,
)
from symhbm.continuation.following import Follower, filled, followed_again, solution_beside
from symhbm.continuation.path import Path
from symhbm.continuation.point import Event, EventKind, PathPoint
from symhbm.continuation.segment import Segment
from symhbm.continuation.status import Status
from symhbm.numerics import FloatArray, on_one_thread

_SAME = 1e-6
"""Distance of two solutions, relative to the response, up to which they are one."""
_FIRST = (1e-2, 1e-3, 1e-4)
"""Arc lengths of a first step from a branch point, tried in turn."""
_ON_BRANCH = 0.9
"""Cosine of the angle between a tangent and the first step along it, at least."""
_UNCLEAR = 1e-4
"""Distance, relative to the response, from a point where more than two branches meet up to which
nothing is followed."""
_PASSES = 1e-2
"""Distance at which a branch passes where it began, over the length of the step there."""


class Origin(StrEnum):
    """What a branch was found by."""

    PATH = "path"
    CROSSING = "branch point"
    BESIDE = "other solution"


class FoundBranch(NamedTuple):
    """A branch, what it was found by, the number of the branch it left, and where.

    ``parent`` is -1 of the path and of branches from other solutions; ``value`` is the parameter,
    ``solves`` the number of linear solves it took.
    """

    branch: Branch
    origin: Origin
    parent: int
    value: float
    solves: int


@dataclass
class _Known:
    """A branch point: its crossing, which of the two tangents were followed, and whose it is."""

    crossing: Crossing
    scale: FloatArray
    switches: NDArray[np.bool_]
    parent: int
    followed: list[bool] = field(default_factory=lambda: [False, False])

    def is_at(self, state: FloatArray) -> bool:
        """Whether a state (n_unknowns + 1,) is this branch point."""
        return bool(np.linalg.norm((state - self.crossing.state) / self.scale) <= _SAME)

    def pass_along(self, direction: FloatArray) -> None:
        """Mark the branch along a direction (n_unknowns + 1,) as followed."""
        assert self.crossing.tangents is not None
        along = self.crossing.tangents @ (direction / self.scale)
        self.followed[int(np.argmax(np.abs(along)))] = True


@on_one_thread
def other_branches(
    first: Branch, band: tuple[float, float], max_points: int, max_branches: int
) -> list[FoundBranch]:
    """The ``first`` branch, and others over its ``band`` that are found from it.

    ``max_points`` is the largest number of points of a path, ``max_branches`` that of branches. A
    branch on which others branch off that were not followed has the status
    `Status.BRANCH_POINTS`.
    """
    search = _Search(first, band, max_points, curvature_of(first.corrector.curve))
    search.start()
    while len(search.found) < max_branches:
        more = search.from_crossing() or search.from_other_solution()
        if not more:
            break
        for found in more:
            search.add(found)
    return [search.ended(number) for number in range(min(len(search.found), max_branches))]


@dataclass
class _Search:
    """The branches ``found`` so far from the ``first`` one, and the branch points on them."""

    first: Branch
    band: tuple[float, float]
    max_points: int
    curvature: Curvature | None
    found: list[FoundBranch] = field(default_factory=list)
    _known: list[_Known] = field(default_factory=list)
    _lost: set[int] = field(default_factory=set)
    _tried: list[FloatArray] = field(default_factory=list)
    _complete: bool = False

    @property
    def _corrector(self) -> Corrector:
        return self.first.corrector

    def start(self) -> None:
        """Add the first branch, searched for what it passed over."""
        path = self._searched(self.first)
        self.add(FoundBranch(path, Origin.PATH, -1, self.band[0], self._corrector.solves))

    def add(self, found: FoundBranch) -> None:
        """Add a branch, and its branch points to those known."""
        number, points = len(self.found), found.branch.points
        self.found.append(found)
        for before, point in zip(points[:1] + points, points, strict=False):
            if any(event.kind == EventKind.BRANCH for event in point.events):
                self._note(number, point, before.switches)

    def ended(self, number: int) -> FoundBranch:
        """A branch with the status that it has among all that were found."""
        found = self.found[number]
        status, complete = found.branch.status, (Status.OTHER_SOLUTIONS, Status.BRANCH_POINTS)
        if (status == complete[0] and self._complete) or status == complete[1]:
            status = Status.REACHED_END
        left = any(not all(known.followed) for known in self._known if known.parent == number)
        if (left or number in self._lost) and status in (Status.REACHED_END, Status.CLOSED):
            status = Status.BRANCH_POINTS
        return found._replace(branch=replace(found.branch, status=status))

    def from_crossing(self) -> list[FoundBranch]:
        """The branch through a known branch point that was not followed, both ways."""
        for known in self._known:
            if all(known.followed):
                continue
            number = known.followed.index(False)
            known.followed[number] = True
            assert known.crossing.tangents is not None
            tangent = known.crossing.tangents[number]
            ways = []
            for direction in (tangent, -tangent):
                found = self._from(known, direction)
                if found is None:
                    self._lost.add(known.parent)
                    continue
                ways.append(found)
                first, *_, last = found.branch.points
                if np.array_equal(first.state, last.state):
                    break  # it is closed, and went both ways
            if ways:
                return ways
        return []

    def from_other_solution(self) -> list[FoundBranch]:
        """The branch from a solution at an end of the band that is on none of those found."""
        for value, other in (self.band, self.band[::-1]):
            ends = [point for f in self.found for point in f.branch.points if point.value == value]
            tried = [state for state in self._tried if state[-1] == value]
            known = [point.unknowns for point in ends] + [state[:-1] for state in tried]
            if not known:
                continue
            unknowns = solution_beside(self._corrector, value, known)
            if unknowns is None:
                continue
            self._tried.append(np.append(unknowns, value))
            path = Path(
                self._corrector.curve,
                unknowns,
                value,
                other,
                self._corrector,
                self.max_points,
                careful=True,
            )
            solves = self._corrector.solves
            points = list(path)
            if len(points) > 1:
                return [self._made(path, points, Origin.BESIDE, -1, solves)]
        self._complete = True
        return []

    def _note(self, number: int, point: PathPoint, switches: NDArray[np.bool_]) -> None:
        """Add a branch point of a branch to those known, and the direction it was passed in."""
        known = next((k for k in self._known if k.is_at(point.state)), None)
        if known is None:
            scale, crossing = self._corrector.curve.scale(point.state), None
            if self.curvature is not None:
                given = self._corrector, self.curvature, point.state, scale, switches
                crossing = solve_crossing(*given)
            if crossing is None or crossing.tangents is None or not crossing.meets:
                self._lost.add(number)
                return
            known = _Known(crossing, scale, switches, number)
            if not known.is_at(point.state):
                self._lost.add(number)
                return
            self._known.append(known)
        known.pass_along(point.after)

    def _from(self, known: _Known, direction: FloatArray) -> FoundBranch | None:
        """The branch from a branch point along a direction, None where no step leads to it."""
        corrector, curve = self._corrector, self._corrector.curve
        low, high = sorted(self.band)
        state, scale, solves = known.crossing.state, known.scale, corrector.solves
        for length in _FIRST:
            guess = state + length * direction * scale
            plane = Hyperplane(guess, scale, direction)
            solution = corrector.correct(guess, plane, known.switches, radius=length)
            if solution is None or not low < solution.point[-1] < high:
                continue
            step = (solution.point - state) / scale
            if np.dot(step, direction) >= _ON_BRANCH * np.linalg.norm(step):
                break
        else:
            return None
        start = at_crossing(curve, known.crossing, direction, scale, known.switches, solution)
        events = (Event(EventKind.BRANCH),)
        first = PathPoint.of(curve, start, scale, known.switches, corrector.solves - solves, events)
        base = PathPoint.of(curve, solution, scale, known.switches, 0)
        path = Path(
            curve,
            base.unknowns,
            base.value,
            self.band[1],
            corrector,
            self.max_points,
            base=base,
            begin=self.band[0],
            careful=True,
        )
        points, closed = [first], False
        for point in path:
            if len(points) > 2 and _passes(Segment.of(corrector, points[-1], point), first):
                ahead = np.dot(first.after / scale, point.before / scale) > 0
                tangent = first.after if ahead else -first.after
                points.append(first._replace(before=tangent, after=tangent))
                closed = True
                break
            points.append(point)
        return self._made(path, points, Origin.CROSSING, known.parent, solves, closed)

    def _made(
        self,
        path: Path,
        points: list[PathPoint],
        origin: Origin,
        parent: int,
        solves: int,
        closed: bool = False,
    ) -> FoundBranch:
        """A branch of the points of a path, with its peaks and what its steps passed over."""
        first, corrector = self.first, self._corrector
        status = Status.CLOSED if closed else path.status
        if status == Status.TURNED_BACK:
            status = Status.REACHED_END
        if status == Status.SEVERAL_MEET:
            points = _far_enough(points)
        follower = Follower(corrector, first.per_dof, path.rejected)
        points, peaks = follower.searched(points)
        if follower.missed and status in (Status.REACHED_END, Status.CLOSED):
            status = Status.PEAK_NOT_LOCATED
        given = corrector, first.solve_from_scratch, first.per_dof, points, peaks, status
        branch = self._searched(Branch(*given, follower.rejected))
        return FoundBranch(branch, origin, parent, points[0].value, corrector.solves - solves)

    def _searched(self, branch: Branch) -> Branch:
        """A branch with the branch points that it passed over in pairs, and all between points."""
        if self.curvature is not None:
            passed = passed_pairs(branch.points, self._corrector)
            branch, _ = followed_again(branch, passed)
        return filled(branch)


def _far_enough(points: list[PathPoint]) -> list[PathPoint]:
    """A path that ends where more than two branches meet, up to where tangents are round-off."""
    last = points[-1]
    distance = [np.linalg.norm((p.state - last.state) / last.scale) for p in points]
    far = np.flatnonzero(np.array(distance) > _UNCLEAR)
    return points[: max(2, int(far.max(initial=0)) + 1)]


def _passes(segment: Segment, start: PathPoint) -> bool:
    """Whether a branch passes its ``start`` within a segment, or at the end of it."""
    step = (segment.right.state - segment.left.state) / segment.scale
    share = segment.share_of(start.state) if segment.length else 0.0
    if not 0 < share <= 1 + _PASSES:
        return False
    [near], [slope] = segment.interpolate(np.array([share]))
    distance = np.linalg.norm((near - start.state) / segment.scale)
    along, slope = start.after / segment.scale, slope / segment.scale
    cosine = np.dot(along, slope) / np.linalg.norm(along) / np.linalg.norm(slope)
    return bool(distance <= _PASSES * np.linalg.norm(step) and abs(cosine) >= _ON_BRANCH)
