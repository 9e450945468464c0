"""Following of branches over a whole band: path after path, missed events and peaks added.

Beyond the end of a branch, where a path cannot be continued, a solution that is found without a
neighbour starts the next one, which is followed back to its first point and from there to its last.
What lies between two branches is not computed.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from symhbm.continuation.between import (
    LocatedPeaks,
    Peak,
    locate_peaks,
    solved_between,
    unbounded_peak,
)
from symhbm.continuation.branch import Branch
from symhbm.continuation.correctors import Corrector, corrector_of
from symhbm.continuation.newton import NewtonResult, other_solution
from symhbm.continuation.path import Path
from symhbm.continuation.point import EventKind, PathPoint
from symhbm.continuation.problem import ContinuationProblem
from symhbm.continuation.start import linear_response, points_at_rest, solve_point
from symhbm.continuation.status import Status
from symhbm.numerics import FloatArray, length_of, on_one_thread, watching

_RESTARTS = (1, 10, 100, 1000)
"""Distances beyond a pole at which a new path starts, over that of the last point before it."""
_OF_START = (Status.SYSTEM_SINGULAR, Status.NOT_HELD, Status.UNDEFINED_FORCE, Status.NO_MODE)
"""What tells more of a first point that there is not."""
_MAX_DEPTH = 4
"""How often a segment is followed again because its step passed over events."""


@on_one_thread
def follow_branch(
    curve: ContinuationProblem,
    band: tuple[float, float],
    max_points: int,
    per_dof: bool,
    guess: FloatArray | None = None,
    searched: bool = True,
) -> Branch:
    """The branch of a curve from the first to the last value of a ``band``.

    An unbounded resonance ends a path, and another path starts beyond it. ``per_dof`` asks for the
    peaks of every degree of freedom instead of those of the largest response; ``guess``
    (n_unknowns,) [m] may be a response close to that at the first value. One that is not
    ``searched`` has the points of its path alone: no peaks, nothing that steps passed over, and no
    look at other solutions.
    """
    corrector = corrector_of(curve)
    resting = points_at_rest(curve, band) if curve.at_rest else None

    def solve_from_scratch(value: float) -> NewtonResult:
        result = solve_point(*curve.at(value))
        corrector.solves += result.iterations
        return result

    if resting is not None:
        return Branch(corrector, solve_from_scratch, per_dof, resting, [], Status.REACHED_END, 0)
    return follow_with(corrector, solve_from_scratch, band, max_points, per_dof, guess, searched)


def follow_with(
    corrector: Corrector,
    solve_from_scratch: Callable[[float], NewtonResult],
    band: tuple[float, float],
    max_points: int,
    per_dof: bool,
    guess: FloatArray | None = None,
    searched: bool = True,
) -> Branch:
    """As `follow_branch`, with a corrector and a way to solve without a neighbouring solution."""
    curve, (start, end) = corrector.curve, band
    heading = 1 if end > start else -1
    follower = Follower(corrector, per_dof)
    points: list[PathPoint] = []
    peaks: list[Peak] = []
    status = Status.NO_START

    def solved(unknowns: FloatArray | None, value: float) -> NewtonResult:
        solution = None if unknowns is None else corrector.free(unknowns, value)
        return solution if solution and solution.converged else solve_from_scratch(value)

    solution = solved(guess, start)
    if solution.status in _OF_START:
        status = solution.status
    while solution.converged and (end - start) * heading > 0:
        # Without a solution beyond its pole the branch keeps the status of the path.
        path = Path(curve, solution.unknowns, start, end, corrector, max_points)
        path_points = list(_told(path))
        max_points -= len(path_points)
        follower.rejected += path.rejected
        status = path.status
        more_points, more_peaks = follower.searched(path_points) if searched else (path_points, [])
        points += more_points
        peaks += sorted(more_peaks, key=lambda peak: (per_dof * peak.dof, peak.value))
        if path.status != Status.UNBOUNDED:
            break
        last = path_points[-1]
        scale = curve.scale(last.state)
        tangent = corrector.tangent(last.state, scale, last.before / scale, last.switches)
        if tangent is None:
            break
        pole = unbounded_peak(curve.problem, last, tangent.direction * scale)
        to_pole = pole.value - last.value
        if not 0 < to_pole * heading < (end - last.value) * heading:
            break  # the band ends on the flank of the resonance, before its pole
        peaks.append(pole)
        for distance in np.array(_RESTARTS) * to_pole:
            start = pole.value + distance
            solution = solved(-last.unknowns, start)
            if solution.converged:
                break
    if follower.missed and status == Status.REACHED_END:
        status = Status.PEAK_NOT_LOCATED
    complete = searched and status == Status.REACHED_END and not curve.single_valued
    ends = [points[i] for i in (0, -1)] if complete and curve.driven else []
    if any(solution_beside(corrector, end.value, [end.unknowns]) is not None for end in ends):
        status = Status.OTHER_SOLUTIONS
    if complete and any(e.kind == EventKind.BRANCH for p in points for e in p.events):
        status = Status.BRANCH_POINTS
    return Branch(corrector, solve_from_scratch, per_dof, points, peaks, status, follower.rejected)


def _told(path: Path) -> Iterator[PathPoint]:
    """The points of a path, told as they come with how many maxima lie before them."""
    watcher, points = watching(), list[PathPoint]()

    def n_maxima() -> int:
        rises = np.diff([length_of(point.unknowns) for point in points]) > 0
        return int(np.count_nonzero(rises[:-1] & ~rises[1:]))

    for point in path:
        points.append(point)
        watcher.reached(point.value, n_maxima)
        yield point


def filled(branch: Branch) -> Branch:
    """A branch with the solutions ``between`` its points that interpolation needs.

    Segments in which these show events or peaks that the path passed over are followed again.
    """
    if branch.curve.at_rest:
        return branch
    between, passed = solved_between(branch.points, branch.corrector, branch.per_dof)
    missed = 0
    for _ in range(_MAX_DEPTH):
        if not passed:
            break
        branch, lost = followed_again(branch, passed)
        missed += lost
        between, passed = solved_between(branch.points, branch.corrector, branch.per_dof)
    if (missed or passed) and branch.status == Status.REACHED_END:
        branch = replace(branch, status=Status.PEAK_NOT_LOCATED)
    return replace(branch, between=between)


def followed_again(branch: Branch, passed: dict[int, float]) -> tuple[Branch, int]:
    """A branch followed again through values that it ``passed`` over, by the point before.

    With it, how many peaks could not be solved for.
    """
    follower = Follower(branch.corrector, branch.per_dof, branch.rejected)
    points, peaks = follower.searched(branch.points, LocatedPeaks([], {}, 0, passed))
    known = {(peak.value, peak.dof) for peak in branch.peaks}
    peaks = branch.peaks + [peak for peak in peaks if (peak.value, peak.dof) not in known]
    branch = replace(branch, points=points, peaks=peaks, rejected=follower.rejected)
    return branch, follower.missed


@dataclass
class Follower:
    """Adds to the points of a path what its steps passed over.

    ``rejected`` counts its steps, ``missed`` the peaks that could not be solved for.
    """

    corrector: Corrector
    per_dof: bool
    rejected: int = 0
    missed: int = 0

    def searched(
        self, points: list[PathPoint], located: LocatedPeaks | None = None, depth: int = 0
    ) -> tuple[list[PathPoint], list[Peak]]:
        """A path with its peaks among its points, and the peaks.

        A segment in which a contact has another state is followed again, through that state.
        """
        located = located or locate_peaks(points, self.corrector, self.per_dof)
        path, peaks = [], located.peaks
        self.missed += located.lost
        for i, left in enumerate(points):
            path += [left, *located.between.get(i, ())]
            if i not in located.other_states:
                continue
            right, value = points[i + 1], located.other_states[i]
            added = self._points_through(left, right, value) if depth < _MAX_DEPTH else None
            if added is None:
                # The other state is one of round-off, next to the limit.
                pair = [left, right]
                alone = locate_peaks(pair, self.corrector, self.per_dof, ignore_states=True)
                path += alone.between.get(0, ())
                peaks += alone.peaks
                self.missed += alone.lost + len(alone.other_states)
                continue
            more_points, more_peaks = self.searched([left, *added, right], depth=depth + 1)
            path += more_points[1:-1]
            peaks += more_peaks
        return path, peaks

    def _points_through(
        self, left: PathPoint, right: PathPoint, value: float
    ) -> list[PathPoint] | None:
        """The points between two others, one of them at a ``value`` that the path passed over."""
        followed = [left]
        for end in (value, right.value):
            base, corrector = followed[-1], self.corrector
            path = Path(corrector.curve, left.unknowns, base.value, end, corrector, base=base)
            followed += list(path)[1:]
            self.rejected += path.rejected
            if path.status != Status.REACHED_END:
                return None
        *inner, last = followed[1:]
        if inner and _is_same(inner[-1], right) and np.array_equal(last.switches, right.switches):
            return inner[:-1]  # the event at the right point, located short of it
        # A contact still in another state at the right point changes there, but for round-off.
        return inner if np.array_equal(last.switches, left.switches) else None


def solution_beside(
    corrector: Corrector, value: float, known: Sequence[FloatArray]
) -> FloatArray | None:
    """A solution (n_unknowns,) at a value that is none of those ``known``, by Newton's method.

    It starts close to each of them and from the linear response; None if it finds none.
    """
    curve = corrector.curve
    linear = linear_response(*curve.at(value))
    starts = [*(1.01 * unknowns for unknowns in known), *([] if linear is None else [linear])]
    return other_solution(
        lambda unknowns, known, left: corrector.approach(unknowns, value, known, left),
        lambda unknowns: corrector.free(unknowns, value),
        known[0],
        starts,
        *known[1:],
    )


_FIRST, _FARTHER, _NOT_CONVERGED = 1e-3, 1.5, 4
"""Distance beyond the end of a branch, relative, of the first attempt to start the next one; its
growth with each attempt, and the additional growth where nothing converges."""
_MAX_BRANCHES = 12
"""Branches over one band."""
_ENDED = (Status.NO_START, Status.MINIMUM_STEP, Status.SEVERAL_MEET)
_SAME = 1e-6
"""Distance of two solutions, relative to the response, up to which they are one."""

Follow = Callable[[tuple[float, float], FloatArray | None], Branch]
"""Follows the branch over a band from a guess."""


def branches_over(
    curve: ContinuationProblem,
    band: tuple[float, float],
    max_points: int,
    per_dof: bool,
    guess: FloatArray | None = None,
) -> list[Branch]:
    """The branches over a band in its order; one, as of `follow_branch`, if that reaches its end.

    One that another follows has the status `Status.INTERRUPTED`, or that of one which reached its
    end where the other begins at its last point.
    """

    def follow(part: tuple[float, float], near: FloatArray | None) -> Branch:
        return follow_branch(curve, part, max_points, per_dof, guess if part == band else near)

    branches = chained(follow, band, _ENDED)
    for i, (branch, beyond) in enumerate(pairwise(branches)):
        goes_on = branch.points and _is_same(branch.points[-1], beyond.points[0])
        status = Status.REACHED_END if goes_on else Status.INTERRUPTED
        branches[i] = replace(branch, status=status)
    return branches


def chained(
    follow: Follow,
    band: tuple[float, float],
    ended: Collection[Status],
    applies: Callable[[Branch, float], bool | None] = lambda branch, value: True,
) -> list[Branch]:
    """Branches, each beyond one whose status is one of those ``ended``.

    ``applies`` is False of a value at which none may start; the first branch may have no points.
    """
    branches = [follow(band, None)]
    while branches[-1].status in ended and len(branches) < _MAX_BRANCHES:
        beyond = _beyond(branches[-1], band, follow, applies)
        if beyond is None:
            break
        branches.append(beyond)
    return branches


def _beyond(
    branch: Branch,
    band: tuple[float, float],
    follow: Follow,
    applies: Callable[[Branch, float], bool | None],
) -> Branch | None:
    """The branch after another one, None where none starts up to the end of the band."""
    (begin, end), corrector = band, branch.corrector
    heading = 1 if end > begin else -1
    begin = heading * max(
        [heading * point.value for point in branch.points], default=heading * begin
    )
    distance = _FIRST * max(abs(begin), branch.curve.smallest)
    value = begin
    while value != end:
        value = begin + heading * min(distance, abs(end - begin))
        distance *= _FARTHER
        if applies(branch, value) is False:
            continue
        solution = corrector.free(branch.points[-1].unknowns, value) if branch.points else None
        if solution is None or not solution.converged:
            solution = branch.solve_from_scratch(value)
        if not solution.converged:
            distance *= _NOT_CONVERGED
            continue
        back = follow((value, begin), solution.unknowns)
        corrector.solves += back.corrector.solves
        count = len(back.points)
        # Where a path came to an end, another one may find no way either.
        for number in sorted({count - 1, count // 2, 0} if count else (), reverse=True):
            first = back.points[number]
            if first.value == end:
                continue
            forward = follow((first.value, end), first.unknowns)
            reached = (heading * point.value for point in forward.points)
            if max(reached, default=-np.inf) > heading * value:
                return forward
            corrector.solves += forward.corrector.solves
    return None


def _is_same(left: PathPoint, right: PathPoint) -> bool:
    return bool(np.linalg.norm((right.state - left.state) / left.scale) <= _SAME)
