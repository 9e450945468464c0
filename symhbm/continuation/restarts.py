"""Branches over a band, one beyond the end of another, where a path cannot be continued.

Beyond the end of a branch a solution that is found without a neighbour starts the next one, which
is followed back to its first point and from there to its last. What lies between two branches is
not computed.
"""

from collections.abc import Callable, Collection
from dataclasses import replace
from itertools import pairwise

import numpy as np

from symhbm.continuation.branch import Branch
from symhbm.continuation.following import follow_branch
from symhbm.continuation.point import PathPoint
from symhbm.continuation.problem import ContinuationProblem
from symhbm.continuation.status import Status
from symhbm.numerics import FloatArray

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
