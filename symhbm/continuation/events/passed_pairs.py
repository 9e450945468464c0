"""Pairs of branch points within one step of a path: the determinant changes its sign twice.

Between them the determinant of the derivatives and the tangent has the other sign. Where its
smallest singular value dips between two points of a path, the bottom of the dip tells.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import scipy

from symhbm.continuation.correctors import Corrector
from symhbm.continuation.events.crossing import with_tangent
from symhbm.continuation.point import UNBOUNDED_AMPLIFICATION, PathPoint
from symhbm.continuation.segment import Segment

_SHARES = (0.02, 0.25, 0.5, 0.75, 0.98)
"""Shares of a segment at which the singular value is known at first."""
_MOST_STEPS = 12
"""Most steps towards the bottom of a dip."""


def passed_pairs(points: Sequence[PathPoint], corrector: Corrector) -> dict[int, float]:
    """Values between two branch points that were passed over, by the number of the point before."""
    passed = {}
    for number, (left, right) in enumerate(pairwise(points)):
        amplification = max(left.amplification, right.amplification)
        if left.value == right.value or amplification > UNBOUNDED_AMPLIFICATION:
            continue
        try:
            value = _other_sign(Segment.of(corrector, left, right))
        except (ArithmeticError, np.linalg.LinAlgError):
            continue
        low, high = sorted((left.value, right.value))
        if value is not None and low < value < high:
            passed[number] = value
    return passed


def _other_sign(segment: Segment) -> float | None:
    """A value within a segment at which the sign differs from that at both ends, None without."""
    known: dict[float, tuple[float, float]] = {}

    def size(share: float) -> float:
        known[share] = _signed(segment, share)
        return known[share][1] * heading

    heading = 1.0
    heading = np.sign(size(_SHARES[0]))
    sizes = [size(share) for share in _SHARES]
    if sizes[-1] < 0:
        return None  # one branch point, or another path
    for k in range(1, len(_SHARES) - 1):
        if 0 < sizes[k] < min(sizes[k - 1], sizes[k + 1]):
            bounds = _SHARES[k - 1], _SHARES[k + 1]
            scipy.optimize.minimize_scalar(  # type: ignore
                size, bounds=bounds, method="bounded", options={"maxiter": _MOST_STEPS}
            )
    lowest, value = min((found * heading, value) for value, found in known.values())
    return value if lowest < 0 else None


def _signed(segment: Segment, share: float) -> tuple[float, float]:
    """The parameter at a share of a segment, and the smallest singular value with the sign.

    Of the derivatives and the unit tangent. Raises ArithmeticError where there is no solution.
    """
    solution = segment.at(share)
    matrix = with_tangent(segment.corrector, solution, segment.scale, segment.switches)
    matrix[-1] *= np.sign(matrix[-1] @ segment.normal)
    smallest = np.linalg.svd(matrix, compute_uv=False)[-1]
    return float(solution.state[-1]), float(np.linalg.slogdet(matrix)[0] * smallest)
