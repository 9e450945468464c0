"""Interpolation between two points with known slopes: cubics, and the amplitude of a path.

Pictures draw this amplitude, and points of a path are dense enough for it.
"""

from math import copysign, sqrt

import numpy as np
from numpy.typing import ArrayLike

from symhbm.numerics.arrays import FloatArray

_CLOSE = 1e-9
"""Change of a share at which the search ends: it converges quadratically."""
_MAX_STEPS = 60
"""Most steps of the search: bisection alone takes fewer."""
_MONOTONE = 3.0
"""Largest slope at an end over the mean slope of a monotone cubic."""
_LOWEST = 1e-3
"""Smallest interpolated amplitude over that at both points: a lower one requires a point."""


def cubic(left: ArrayLike, right: ArrayLike, slopes: tuple, share: ArrayLike) -> FloatArray:
    """Value at a ``share`` of the way; ``slopes`` are the derivatives by the share at both ends.

    All arguments broadcast against each other.
    """
    h, left, right = np.asarray(share), np.asarray(left), np.asarray(right)
    value = left + h**2 * (3 - 2 * h) * (right - left)
    return value + h * (1 - h) ** 2 * slopes[0] + h**2 * (h - 1) * slopes[1]


def cubic_slope(left: ArrayLike, right: ArrayLike, slopes: tuple, share: ArrayLike) -> FloatArray:
    """Derivative of `cubic` by the share."""
    h, left, right = np.asarray(share), np.asarray(left), np.asarray(right)
    value = 6 * h * (1 - h) * (right - left)
    return value + (1 - h) * (1 - 3 * h) * slopes[0] + h * (3 * h - 2) * slopes[1]


def cubic_top(left: float, right: float, slopes: tuple[float, float]) -> tuple[float, float]:
    """Share at which a cubic that rises first and falls last is largest, and its value there."""
    cube, square, slope = _powers(left, right, slopes)
    share = slope / (sqrt(square**2 - 3 * cube * slope) - square)
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
    values = (np.asarray(value, dtype=float) for value in (left, right, *slopes, share))
    start, end, first, last, where = np.broadcast_arrays(*values)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        result = _logarithmic(start, end, first, last, where)
        squares = cubic(start**2, end**2, (2 * start * first, 2 * end * last), where)
        valley = ((first < 0) & (last > 0)) | (np.minimum(start, end) <= 0)
        floor = (_LOWEST * np.minimum(start, end)) ** 2
        result = np.where(valley, np.sqrt(np.maximum(squares, floor)), result)
        result = np.where(np.isinf(first), _rooted(start, end, last, where), result)
        result = np.where(np.isinf(last), _rooted(end, start, -first, 1 - where), result)
    return np.where(where == 0, start, np.where(where == 1, end, result))


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


def _logarithmic(
    start: FloatArray, end: FloatArray, first: FloatArray, last: FloatArray, share: FloatArray
) -> FloatArray:
    """Cubic logarithm, monotone where both ends rise or both fall."""
    level = np.log(start), np.log(end)
    mean = level[1] - level[0]
    slopes = first / start, last / end
    limited = [
        np.where(slope * mean > 0, mean * np.minimum(slope / mean, _MONOTONE), slope)
        for slope in slopes
    ]
    return np.exp(cubic(*level, tuple(limited), share))


def _rooted(fold: FloatArray, end: FloatArray, slope: FloatArray, share: FloatArray) -> FloatArray:
    """``fold + c t + d t^2``, ``t`` the root of the share, with a known value and slope at 1.

    Straight over ``t`` where the other end is a fold, too.
    """
    rise = end - fold
    bend = np.where(np.isinf(slope), 0.0, 2 * slope - rise)
    root = np.sqrt(np.clip(share, 0.0, 1.0))
    return fold + (rise - bend) * root + bend * root**2
