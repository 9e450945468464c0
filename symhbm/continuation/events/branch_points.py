"""Branch points of a path: other solutions meet it there, and the path goes straight on.

There ``det [J; t^T]`` changes its sign although the tangent does not turn, as where motions of a
symmetric structure that are not as symmetric as it branch off.
"""

import numpy as np

from symhbm.continuation.correctors import Corrected, Corrector
from symhbm.continuation.point import PathPoint
from symhbm.continuation.segment import PathState, Segment
from symhbm.numerics import FloatArray

_CLOSEST = 1e-5
"""Distance, relative to the response, at which the point is known: closer by, round-off turns the
tangent towards what branches off."""
_STRAIGHT = 0.5
"""Distance of two solutions across the way, over the part of it between them, that is one path."""
_MAX_HALVINGS = 40


def find_branch_point(
    corrector: Corrector, base: PathPoint, ahead: Corrected, scale: FloatArray
) -> Corrected | None:
    """The first solution beyond a branch point between two points, looking ahead.

    ``ahead`` looks away from ``base`` as well, with another sign of the determinant. None where the
    two are on different paths, which may be as close as you like but do not meet.
    """
    right = PathState(ahead.point, ahead.direction * scale)
    path = Segment(corrector, PathState(base.state, base.after), right, base.slip)
    if not path.length > 0:
        return None
    low, high, here, beyond = 0.0, 1.0, base.state, ahead
    for _ in range(_MAX_HALVINGS):
        across = _across(path, here, beyond.point)
        if across > _STRAIGHT * (high - low) * path.length:
            return None
        if (high - low) * path.length <= _CLOSEST:
            return beyond
        share = (low + high) / 2
        station = path.solve(share)
        if station is None:
            return None
        found = corrector.tangent(station.state, path.scale, path.normal, base.slip)
        if found is None:
            return None
        if found.sign == ahead.sign:
            high, beyond = share, found
        else:
            low, here = share, station.state
    return None


def _across(path: Segment, here: FloatArray, there: FloatArray) -> float:
    """Distance of two solutions across the straight way from one end to the other."""
    chord = (there - here) / path.scale
    way = (path.right.state - path.left.state) / path.scale
    along = np.dot(chord, way) / np.dot(way, way)
    return float(np.linalg.norm(chord - along * way))
