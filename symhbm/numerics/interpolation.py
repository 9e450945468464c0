"""Interpolation between two points with known slopes: cubics, and the amplitude of a path.

Pictures draw this amplitude, and points of a path are dense enough for it.
"""

from math import copysign, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from symhbm.numerics.arrays import FloatArray
from symhbm.numerics.loops import Loop, interpolation

_CLOSE = 1e-9
"""Change of a share at which the search ends: it converges quadratically."""
_MAX_STEPS = 60
"""Most steps of the search: bisection alone takes fewer."""


cubic, cubic_slope = interpolation.cubic, interpolation.cubic_slope


def cubic_top(left: float, right: float, slopes: tuple[float, float]) -> tuple[float, float]:
    """Share at which a cubic that rises first and falls last is largest, and its value there."""
    cube, square, slope = _powers(left, right, slopes)
    root = sqrt(square**2 - 3 * cube * slope)
    # Of two forms of the same zero, the one without a difference of large numbers.
    above, below = (root + square, -3 * cube) if square > 0 else (slope, root - square)
    if not below:
        return 0.0, left  # flat to round-off
    share = above / below
    return share, left + share * (slope + share * (square + share * cube))


def first_zero(left: float, right: float, slopes: tuple[float, float]) -> float:
    """Share at which a cubic first vanishes whose values at both ends have opposite signs."""
    cube, square, slope = _powers(left, right, slopes)

    def value(share: float) -> float:
        return left + share * (slope + share * (square + share * cube))

    low, high = 0.0, 1.0
    for turn in _turns(cube, square, slope):
        # The cubic is monotone between its turning points.
        if low < turn < high:
            low, high = (turn, high) if value(turn) * left > 0 else (low, turn)
    share = (low + high) / 2
    for _ in range(_MAX_STEPS):
        at = value(share)
        low, high = (share, high) if at * left > 0 else (low, share)
        rate = slope + share * (2 * square + share * 3 * cube)
        trial = share - at / rate if rate else low
        share, last = (trial if low < trial < high else (low + high) / 2), share
        if abs(share - last) < _CLOSE:
            break
    return share


def amplitude_between(
    left: ArrayLike, right: ArrayLike, slopes: tuple[ArrayLike, ArrayLike], share: ArrayLike
) -> FloatArray:
    """Amplitude at a ``share`` of the way from one point to the next; all arguments broadcast.

    ``slopes`` are the derivatives by the share at both ends, infinite at a fold. The logarithm is
    cubic, which suits a resonance and its flanks. Between a fall and a rise the square is cubic, as
    for a motion that passes close to zero; next to a fold the amplitude follows the root.
    """
    each = np.broadcast_arrays(left, right, *slopes, share)
    result = np.empty(each[0].shape)
    _amplitudes(*(np.array(values, dtype=float).ravel() for values in each), result.reshape(-1))
    return result


@Loop
def _amplitudes(left: Any, right: Any, first: Any, last: Any, share: Any, result: Any) -> None:
    for i in range(len(result)):
        result[i] = interpolation.amplitude_at(left[i], right[i], first[i], last[i], share[i])


def _powers(left: float, right: float, slopes: tuple[float, float]) -> tuple[float, float, float]:
    """Coefficients of a cubic by the share: of its third, second and first power."""
    first, last = slopes
    rise = right - left
    return first + last - 2 * rise, 3 * rise - 2 * first - last, first


def _turns(cube: float, square: float, slope: float) -> list[float]:
    """Shares at which the derivative of a cubic vanishes, ascending."""
    root = square**2 - 3 * cube * slope
    if root <= 0:
        return []
    larger = -square - copysign(sqrt(root), square)
    pair = [larger / (3 * cube)] if cube else []
    pair += [slope / larger] if larger else []
    return sorted(pair)
