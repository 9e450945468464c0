"""Folds of a path, where it turns back in its parameter, or in one of its unknowns."""

import math
from itertools import pairwise

import numpy as np

from symhbm.continuation.correctors import Corrector
from symhbm.continuation.point import PathPoint
from symhbm.continuation.segment import PathState, Segment
from symhbm.numerics import refined

_SHARES = np.arange(17) / 16
"""Shares of a segment at which the interpolated path tells whether it turns back."""
_NEARLY = 0.3
"""Slope of the parameter, over the larger one at the ends, below which two folds may hide."""
_STEEP = 0.01
"""Slope of the parameter at an end, over that at the other, of an end that is nearly a fold."""
_DIP = 0.999
"""Slope of the parameter, over the smaller one at the ends, below which it has a minimum."""


def find_folds(
    corrector: Corrector, left: PathPoint, right: PathPoint, component: int = -1
) -> list[PathState] | None:
    """Folds between two neighbouring points of a path without an event in between, in their order.

    They are those of the parameter, the last component, or turns of another ``component``. Where
    the interpolated path turns back, the segment is halved until every fold lies between slopes of
    opposite sign. None if a solution in between cannot be found, as the points are then too far
    apart.
    """

    def between(first: PathState, last: PathState) -> Segment:
        return Segment(corrector, first, last, left.switches)

    def middle(first: PathState, last: PathState) -> PathState | None:
        segment = between(first, last)
        return segment.at(0.5) if _may_hide(segment, component) else None

    def advance(at: PathState) -> float:
        return float(at.direction[component])

    ends = PathState(left.state, left.after), PathState(right.state, right.before)
    try:
        pairs = pairwise(refined(ends, middle))
        return [between(*pair).zero(advance) for pair in pairs if math.prod(map(advance, pair)) < 0]
    except ArithmeticError:
        return None


def _may_hide(segment: Segment, component: int) -> bool:
    """Whether more folds may lie in a segment than the one that slopes at its ends tell."""
    advance = segment.interpolate(_SHARES)[1][:, component]
    turns = np.count_nonzero(advance[1:] * advance[:-1] < 0)
    turned = segment.left.direction[component] * segment.right.direction[component] < 0
    slowest = np.abs(advance[1:-1]).min()
    # Near two folds, or near a cusp, the interpolated path need not turn where the path does.
    ends = abs(advance[0]), abs(advance[-1])
    dips = slowest < _DIP * min(ends) or min(ends) < _STEEP * max(ends)
    nearly = not turned and dips and slowest < _NEARLY * max(ends)
    return bool(turns > turned or nearly)
