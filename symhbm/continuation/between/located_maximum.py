"""Location of one amplitude maximum between two solutions: the zero of its slope along the path."""

from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.between.slopes import Slopes
from symhbm.continuation.correctors import Corrected
from symhbm.continuation.segment import PathState, Segment
from symhbm.numerics import FloatArray, bracketed_root

CORNER_JUMP = 1e-6
"""Jump of a slope, relative to the slopes around, from which a maximum is a corner."""
_ROUND_OFF_SLOPE = 1e-12
"""Slope at an end, over the larger one, that is zero: by symmetry, branches are level where they
cross others."""
_SMALL_SLOPE = 1e-2
"""Slope at an end, relative to the larger one, below which its tangent is too inaccurate."""
_MAX_RATIO = 1e4
"""Largest distance of two solutions over that of their planes along a continuous path."""
_ROUND_OFF = 1e-10
"""Distance of two solutions, relative to the response, that round-off explains."""


class PeakKind(StrEnum):
    """Kinds of peaks; an unbounded one exceeds what the balance resolves in double precision."""

    SMOOTH = "smooth"
    CORNER = "corner"
    UNBOUNDED = "unbounded"


class LocatedMaximum(NamedTuple):
    """A maximum of the responses ``dofs``: its ``share`` of the segment and the solution ``at`` it.

    ``solution`` is the same with its direction relative to ``scale``; ``solves`` counts the linear
    solves spent on it.
    """

    share: float
    at: Slopes
    solution: Corrected
    scale: FloatArray
    kind: PeakKind
    dofs: tuple[int, ...]
    solves: int


def locate_maximum(
    segment: Segment, left: Slopes, right: Slopes, dof: int, start: float
) -> LocatedMaximum | None:
    """The maximum of one amplitude between two solutions, where its slope changes sign.

    ``start`` is its estimated share of the segment. None if the iteration does not converge.
    """
    visited: dict[float, tuple[Corrected, Slopes]] = {}
    solves_before = segment.corrector.solves

    def slope(share: float) -> float:
        if share not in visited:
            nearest = min(visited, key=lambda known: abs(known - share), default=None)
            neighbour = None if nearest is None else (nearest, visited[nearest][1])
            solution = segment.corrected(share, neighbour) if 0 <= share <= 1 else None
            if solution is None:
                raise ArithmeticError
            at = PathState(solution.point, solution.direction * segment.scale)
            visited[share] = solution, Slopes.of(segment.curve.problem, at)
        return float(visited[share][1].slope[dof])

    # A small slope is as inaccurate as the tangent of its point: solve for both anew.
    ends = float(left.slope[dof]), float(right.slope[dof])
    scale = max(ends[0], -ends[1])
    try:
        left_slope, right_slope = (
            s if abs(s) > _SMALL_SLOPE * scale else slope(float(h)) for h, s in enumerate(ends)
        )
        flat = _ROUND_OFF_SLOPE * scale
        known = {0.0: left_slope, 1.0: right_slope}
        if left_slope <= flat or right_slope >= -flat:
            share = 0.0 if left_slope <= flat else 1.0
        else:
            share = bracketed_root(lambda at: known[at] if at in known else slope(at), start=start)
        slope(share)
    except ArithmeticError:
        return None
    (solution, at), solves = visited[share], segment.corrector.solves - solves_before
    jumps = abs(at.slope[dof]) > CORNER_JUMP * scale and 0.0 < share < 1.0
    states = {known: of_share.state for known, (_, of_share) in visited.items()}
    if jumps and not _is_continuous(segment, states, share):
        return None
    kind = PeakKind.CORNER if jumps else PeakKind.SMOOTH
    return LocatedMaximum(share, at, solution, segment.scale, kind, (dof,), solves)


def _is_continuous(segment: Segment, states: dict[float, FloatArray], share: float) -> bool:
    """Whether a solution is close to its neighbours: at a corner slopes jump, solutions do not."""
    for side in (-1, 1):
        neighbour = min(
            (h for h in states if h * side > share * side), key=lambda h: h * side, default=share
        )
        distance = np.linalg.norm((states[neighbour] - states[share]) / segment.scale)
        if distance > _MAX_RATIO * segment.length * abs(neighbour - share) + _ROUND_OFF:
            return False
    return True


def estimated_maximum(slopes: FloatArray, switch_events: NDArray[np.bool_]) -> float:
    """Share of the segment where the ``slopes`` (n,) of a `SlopeEstimate` first turn negative."""
    fall = int(np.argmax((slopes[:-1] > 0) & (slopes[1:] <= 0)))
    inside = slopes[fall] / (slopes[fall] - slopes[fall + 1])
    share = float(fall + inside) / (len(slopes) - 1)
    if switch_events[0] == switch_events[1]:
        return share
    # Samples are evenly spaced in the square root of the distance from the slip event.
    return share**2 if switch_events[0] else 1 - (1 - share) ** 2
