"""Cubic interpolation between two points with known slopes."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


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
