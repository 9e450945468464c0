"""Branch points of a path, where other solutions meet it and the path continues straight.

There ``det [J; t^T]`` changes its sign although the tangent does not turn: motions that are less
symmetric than the structure branch off at such points.
"""

import numpy as np

from symhbm.continuation.correctors import Corrected, Corrector
from symhbm.continuation.events.corners import NO_TURN
from symhbm.continuation.point import PathPoint
from symhbm.continuation.segment import PathState, Segment
from symhbm.numerics import FloatArray, length_of

_CLOSEST = 1e-5
"""Accuracy of a branch point, relative to the response: closer to it, round-off turns the tangent
towards the other branch."""
_STRAIGHT = 0.5
"""Largest distance of two solutions of one path across their segment, over that along it."""
_MAX_HALVINGS = 40


def find_branch_point(
    corrector: Corrector, base: PathPoint, ahead: Corrected, scale: FloatArray
) -> Corrected | None:
    """The first solution beyond a branch point between two points, its tangent away from ``base``.

    The tangent of ``ahead`` points away from ``base`` too, with the other sign of the determinant.
    None where the two are on different paths, which may come arbitrarily close but do not meet.
    """
    right = PathState(ahead.point, ahead.direction * scale)
    segment = Segment(corrector, PathState(base.state, base.after), right, base.switches)
    if not segment.length > 0:
        return None
    low, high, near_state, past_branch = 0.0, 1.0, base.state, ahead
    row = base.after / scale
    if segment.length <= _CLOSEST and np.dot(row, ahead.direction) < NO_TURN * length_of(row):
        return None  # an acute corner, at which the path turns back
    for _ in range(_MAX_HALVINGS):
        distance = _across(segment, near_state, past_branch.point)
        if distance > _STRAIGHT * (high - low) * segment.length:
            return None
        if (high - low) * segment.length <= _CLOSEST:
            return past_branch
        share = (low + high) / 2
        solution = segment.solve(share)
        if solution is None:
            return None
        tangent = corrector.tangent(solution.state, segment.scale, segment.normal, base.switches)
        if tangent is None:
            return None
        if tangent.sign == ahead.sign:
            high, past_branch = share, tangent
        else:
            low, near_state = share, solution.state
    return None


def _across(segment: Segment, left: FloatArray, right: FloatArray) -> float:
    """Distance of two solutions across the straight line between the ends of a segment."""
    chord = (right - left) / segment.scale
    direction = (segment.right.state - segment.left.state) / segment.scale
    share = np.dot(chord, direction) / np.dot(direction, direction)
    return float(np.linalg.norm(chord - share * direction))
