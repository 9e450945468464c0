"""Cubics between two points, and the amplitude of a path there, of numbers and in loops."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from symhbm.numerics.check import FloatArray
from symhbm.numerics.machine_code import Loop

_CLOSE = 1e-9
"""Change of a share at which a search ends: it converges quadratically."""
_MAX_STEPS = 60
"""Most steps of a search: bisection alone takes fewer."""
_MONOTONE = 3.0
"""Largest slope at an end over the mean slope of a monotone cubic."""
_HIGHEST = 700.0
"""Largest logarithm of an interpolated amplitude that is a number."""
_LOWEST = 1e-3
"""Smallest interpolated amplitude over that at both points: a lower one requires a point."""


def cubic(left: Any, right: Any, slopes: tuple[Any, Any], share: Any) -> Any:
    """Value at a ``share`` of the way; ``slopes`` are the derivatives by the share at both ends.

    Arrays broadcast against each other.
    """
    square, rest = share * share, 1 - share
    value = left + square * (3 - 2 * share) * (right - left)
    return value + share * (rest * rest) * slopes[0] + square * (share - 1) * slopes[1]


def cubic_slope(left: Any, right: Any, slopes: tuple[Any, Any], share: Any) -> Any:
    """Derivative of `cubic` by the share."""
    value = 6 * share * (1 - share) * (right - left)
    value = value + (1 - share) * (1 - 3 * share) * slopes[0]
    return value + share * (3 * share - 2) * slopes[1]


cubic_at, cubic_slope_at = Loop(cubic), Loop(cubic_slope)
"""The same of numbers, within loops."""


@Loop
def cubic_top(left: float, right: float, slopes: tuple[float, float]) -> tuple[float, float]:
    """Share at which a cubic that rises first and falls last is largest, and its value there."""
    cube, square, slope = _powers(left, right, slopes)
    root = math.sqrt(square * square - 3 * cube * slope)
    # Of two forms of the same zero, the one without a difference of large numbers.
    above, below = (root + square, -3 * cube) if square > 0 else (slope, root - square)
    if below == 0:
        return 0.0, left  # flat to round-off
    share = above / below
    return share, left + share * (slope + share * (square + share * cube))


@Loop
def first_zero(left: float, right: float, slopes: tuple[float, float]) -> float:
    """Share at which a cubic first vanishes whose values at both ends have opposite signs."""
    cube, square, slope = _powers(left, right, slopes)
    low, high = 0.0, 1.0
    for turn in _turns(cube, square, slope):
        # The cubic is monotone between its turning points.
        if low < turn < high:
            at = left + turn * (slope + turn * (square + turn * cube))
            low, high = (turn, high) if at * left > 0 else (low, turn)
    share = (low + high) / 2
    for _ in range(_MAX_STEPS):
        at = left + share * (slope + share * (square + share * cube))
        low, high = (share, high) if at * left > 0 else (low, share)
        rate = slope + share * (2 * square + share * 3 * cube)
        trial = share - at / rate if rate != 0 else low
        share, last = (trial if low < trial < high else (low + high) / 2), share
        if abs(share - last) < _CLOSE:
            break
    return share


@Loop
def _powers(left: float, right: float, slopes: tuple[float, float]) -> tuple[float, float, float]:
    """Coefficients of a cubic by the share: of its third, second and first power."""
    first, last = slopes
    rise = right - left
    return first + last - 2 * rise, 3 * rise - 2 * first - last, first


@Loop
def _turns(cube: float, square: float, slope: float) -> tuple[float, float]:
    """Shares at which the derivative of a cubic vanishes, ascending; NaN for those it has not."""
    root = square * square - 3 * cube * slope
    if root <= 0:
        return math.nan, math.nan
    larger = -square - math.copysign(math.sqrt(root), square)
    one = larger / (3 * cube) if cube != 0 else math.nan
    other = slope / larger if larger != 0 else math.nan
    return (other, one) if other < one else (one, other)


@Loop
def interpolate(left, right, first, last, shares, values) -> None:
    """Write `cubic` of several pairs of points at the same ``shares`` (s,).

    Points ``left`` and ``right`` and slopes ``first`` and ``last`` are (n, m), ``values``
    (n, s, k) of their first k components.
    """
    for i in range(len(values)):
        for h in range(len(shares)):
            for k in range(values.shape[2]):
                slopes = first[i, k], last[i, k]
                values[i, h, k] = cubic_at(left[i, k], right[i, k], slopes, shares[h])


@Loop
def differentiate(left, right, first, last, shares, rates) -> None:
    """Write `cubic_slope` of the same."""
    for i in range(len(rates)):
        for h in range(len(shares)):
            for k in range(rates.shape[2]):
                slopes = first[i, k], last[i, k]
                rates[i, h, k] = cubic_slope_at(left[i, k], right[i, k], slopes, shares[h])


def amplitude_between(
    left: ArrayLike, right: ArrayLike, slopes: tuple[ArrayLike, ArrayLike], share: ArrayLike
) -> FloatArray:
    """Amplitude at a ``share`` of the way from one point to the next; all arguments broadcast.

    ``slopes`` are the derivatives by the share at both ends, infinite at a fold. The logarithm is
    cubic, which suits a resonance and its flanks. Between a fall and a rise the square is cubic, as
    for a motion that passes close to zero; next to a fold the amplitude follows the root. Pictures
    draw it, and points of a path are dense enough for it.
    """
    each = np.broadcast_arrays(left, right, *slopes, share)
    result = np.empty(each[0].shape)
    _amplitudes(*(np.array(values, dtype=float).ravel() for values in each), result.reshape(-1))
    return result


@Loop
def _amplitudes(left, right, first, last, share, result) -> None:
    for i in range(len(result)):
        result[i] = amplitude_at(left[i], right[i], first[i], last[i], share[i])


@Loop
def amplitude_at(left: float, right: float, first: float, last: float, share: float) -> float:
    """`amplitude_between` of numbers."""
    if share == 0 or share == 1:
        return right if share else left
    if math.isinf(last):
        return _rooted(right, left, -first, 1 - share)
    if math.isinf(first):
        return _rooted(left, right, last, share)
    lowest = min(left, right)
    if (first < 0 and last > 0) or lowest <= 0:
        square = cubic_at(left * left, right * right, (2 * left * first, 2 * right * last), share)
        least = _LOWEST * lowest
        return math.sqrt(max(square, least * least))
    level = math.log(left)
    mean = math.log(right) - level
    slopes = _limited(first / left, mean), _limited(last / right, mean)
    return math.exp(min(cubic_at(level, level + mean, slopes, share), _HIGHEST))


@Loop
def _limited(slope: float, mean: float) -> float:
    """A slope at an end with which a cubic stays monotone where both ends rise or both fall."""
    return mean * min(slope / mean, _MONOTONE) if slope * mean > 0 else slope


@Loop
def _rooted(fold: float, end: float, slope: float, share: float) -> float:
    """``fold + c t + d t^2``, ``t`` the root of the share, with a known value and slope at 1.

    Straight over ``t`` where the other end is a fold, too.
    """
    rise = end - fold
    bend = 0.0 if math.isinf(slope) else 2 * slope - rise
    root = math.sqrt(min(max(share, 0.0), 1.0))
    return fold + (rise - bend) * root + bend * (root * root)
