"""The amplitude between two points of a path, from its values and slopes at them.

Pictures draw this interpolation, and points of a path are dense enough for it.
"""

import numpy as np
from numpy.typing import ArrayLike

from symhbm.numerics.arrays import FloatArray
from symhbm.numerics.interpolation import cubic

_MONOTONE = 3.0
"""Largest slope at an end over the mean slope of a monotone cubic."""
_LOWEST = 1e-3
"""Smallest interpolated amplitude over that at both points: a lower one requires a point."""


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
