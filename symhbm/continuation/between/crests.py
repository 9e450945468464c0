"""Maxima between two solutions, solved for: where the slope of a response falls through zero."""

from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from symhbm.continuation.between.slopes import Slopes
from symhbm.continuation.segment import Segment
from symhbm.numerics import FloatArray

FLAT = 1e-6
"""Slopes that jump by more than this share of those around them make a corner."""
_LOW = 1e-2
"""Slope at an end, relative to the larger one, that is known no better than its tangent is."""
_ASIDE = 1e-6
"""Distance from a peak, as a share of the way, at which slopes tell that it is a maximum."""
_STEEPEST = 1e4
"""Way of the solution over that across its planes, of a path that is continuous."""
_ROUND_OFF = 1e-10
"""Distance of solutions, relative to the response, that tells nothing of a path."""
_MAX_SECANTS = 12
_PRECISION = 1e-11
"""Last step of the search for a peak, as a share of the way between two points."""


class PeakKind(StrEnum):
    """What makes a peak; an unbounded one grows beyond what double precision can balance."""

    SMOOTH = "smooth"
    CORNER = "corner"
    UNBOUNDED = "unbounded"


class LocatedMaximum(NamedTuple):
    """A maximum of the responses ``dofs`` at one solution, a ``share`` of the way to it.

    ``solves`` counts the linear solves spent on it.
    """

    share: float
    at: Slopes
    kind: PeakKind
    dofs: tuple[int, ...]
    solves: int


def locate_maximum(
    path: Segment, left: Slopes, right: Slopes, dof: int, start: float
) -> LocatedMaximum | None:
    """Solve for the point between two others where the slope of one amplitude changes sign.

    ``start`` is about where, as a share of the way. None if there is none to be found.
    """
    visited: dict[float, Slopes] = {}
    before = path.corrector.solves

    def slope(share: float) -> float:
        if share not in visited:
            near = min(visited.items(), key=lambda s: abs(s[0] - share), default=None)
            found = path.solve(share, near) if 0 <= share <= 1 else None
            if found is None:
                raise ArithmeticError
            visited[share] = Slopes.of(path.curve.problem, found)
        return float(visited[share].slope[dof])

    # A slope close to zero is no better than the tangent of its point: solve for it anew.
    ends = float(left.slope[dof]), float(right.slope[dof])
    level = max(ends[0], -ends[1])
    try:
        low, high = (s if abs(s) > _LOW * level else slope(float(h)) for h, s in enumerate(ends))
        if low <= 0 or high >= 0:
            share = 0.0 if low <= 0 else 1.0
        else:
            share = zero(slope, low, high, start)
        slope(share)
    except ArithmeticError:
        return None
    at, solves = visited[share], path.corrector.solves - before
    jumps = abs(at.slope[dof]) > FLAT * level and 0.0 < share < 1.0
    if jumps and not _is_continuous(path, visited, share):
        return None
    return LocatedMaximum(share, at, PeakKind.CORNER if jumps else PeakKind.SMOOTH, (dof,), solves)


def _is_continuous(path: Segment, visited: dict[float, Slopes], share: float) -> bool:
    """Whether a solution is close to those visited next to it: at a corner only slopes jump."""
    for side in (-1, 1):
        beside = min(
            (h for h in visited if h * side > share * side), key=lambda h: h * side, default=share
        )
        apart = np.linalg.norm((visited[beside].state - visited[share].state) / path.scale)
        if apart > _STEEPEST * path.length * abs(beside - share) + _ROUND_OFF:
            return False
    return True


def falls_at(slopes: FloatArray, roots: NDArray[np.bool_]) -> float:
    """Share of the way where the slopes (n,) of a `Turning` first change from rise to fall."""
    fall = int(np.argmax((slopes[:-1] > 0) & (slopes[1:] <= 0)))
    inside = slopes[fall] / (slopes[fall] - slopes[fall + 1])
    place = float(fall + inside) / (len(slopes) - 1)
    if roots[0] == roots[1]:
        return place
    return place**2 if roots[0] else 1 - (1 - place) ** 2  # evenly spaced by the root of distance


def zero(slope: Callable[[float], float], low: float, high: float, start: float) -> float:
    """Share of the way where a slope falls through zero, by secants from the ``start``.

    ``low`` and ``high`` are its values at both ends; Brent's method where secants fail.
    """
    known = {0.0: low, 1.0: high}

    def remembered(share: float) -> float:
        if share not in known:
            known[share] = slope(share)
        return known[share]

    first = remembered(start)
    other = 1.0 if first > 0 else 0.0  # where the slope has the other sign
    share, before = start, other
    for _ in range(_MAX_SECANTS):
        rise = remembered(share) - remembered(before)
        step = -remembered(share) * (share - before) / rise if rise else np.inf
        if not 0 <= share + step <= 1:
            break
        share, before = share + step, share
        if abs(step) <= _PRECISION:
            left = max((h for h in known if h < share - _ASIDE), default=0.0)
            right = min((h for h in known if h > share + _ASIDE), default=1.0)
            if known[left] >= 0 >= known[right]:
                return share
            break
    return float(scipy.optimize.brentq(remembered, 0, 1, xtol=1e-13))  # type: ignore
