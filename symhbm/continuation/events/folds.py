"""Folds of a path: points where it turns back in its parameter, solved for."""

import numpy as np
import scipy
from numpy.typing import NDArray

from symhbm.continuation.correctors import Corrector
from symhbm.continuation.point import PathPoint
from symhbm.continuation.segment import PathState, Segment

_SHARES = np.arange(17) / 16
_MAX_DEPTH = 8
_NEARLY = 0.3
"""Advance in the parameter, relative to the larger end's, that may turn in between."""
_STEEP = 0.01
"""Advance relative to the larger end's so small that the other end is all but a fold."""
_DIP = 0.999
"""Advance relative to the smaller end's below which it has a minimum in between."""


def find_folds(corrector: Corrector, left: PathPoint, right: PathPoint) -> list[PathState] | None:
    """Folds between two neighbours on a path without an event in between, in their order.

    Where the interpolated path turns back, points are added until every fold stands between
    slopes of opposite sign. None if one of them cannot be solved for: the points are then too far
    apart.
    """
    ends = PathState(left.state, left.after), PathState(right.state, right.before)
    try:
        return _folds(corrector, *ends, left.slip, 0)
    except ArithmeticError:
        return None


def _folds(
    corrector: Corrector, left: PathState, right: PathState, slip: NDArray[np.bool_], depth: int
) -> list[PathState]:
    path = Segment(corrector, left, right, slip)
    advance = path.interpolate(_SHARES)[1][:, -1]
    turns = np.count_nonzero(advance[1:] * advance[:-1] < 0)
    turned = left.direction[-1] * right.direction[-1] < 0
    slowest = np.abs(advance[1:-1]).min()
    # Short of two folds, or of a cusp, the interpolated path need not turn where the path does.
    ends = abs(advance[0]), abs(advance[-1])
    dips = slowest < _DIP * min(ends) or min(ends) < _STEEP * max(ends)
    nearly = not turned and dips and slowest < _NEARLY * max(ends)
    if (turns > turned or nearly) and depth < _MAX_DEPTH:
        centre = _solved(path, 0.5)
        halves = (left, centre), (centre, right)
        return [f for half in halves for f in _folds(corrector, *half, slip, depth + 1)]
    return [_fold(path)] if turned else []


def _fold(path: Segment) -> PathState:
    """The solution where the tangent has no part along the parameter."""
    found = {0.0: path.left, 1.0: path.right}

    def advance(share: float) -> float:
        if share not in found:
            found[share] = _solved(path, share)
        return float(found[share].direction[-1])

    share = float(scipy.optimize.brentq(advance, 0.0, 1.0, xtol=1e-13))  # type: ignore
    advance(share)
    return found[share]


def _solved(path: Segment, share: float) -> PathState:
    station = path.solve(share)
    if station is None:
        raise ArithmeticError("the path between two points cannot be solved for")
    return station
