"""Zeros of monotone functions, many at once."""

from collections.abc import Callable

import numpy as np

from symhbm.numerics.arrays import FloatArray

MACHINE = np.finfo(float).eps
"""Round-off of double precision."""


def monotone_root(
    function: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
    left: FloatArray,
    right: FloatArray,
    rising: np.ndarray,
    start: FloatArray,
    noise: FloatArray,
) -> FloatArray:
    """Zeros of monotone functions, one in each interval: Newton's method kept inside a bracket.

    ``function`` gives values and slopes, ``noise`` is the round-off of the values; all arrays have
    the shape ``(n,)``.
    """
    root = np.clip(start, left, right)
    for _ in range(80):
        value, slope = function(root)
        after = (value > 0) == rising
        right = np.where(after, root, right)
        left = np.where(after, left, root)
        new = root - value / np.where(slope == 0, np.inf, slope)
        inside = (new >= left) & (new <= right) & (slope != 0)
        new = np.where(inside, new, (left + right) / 2)
        step = np.abs(new - root)
        root = new
        if np.all((step <= 4 * MACHINE * (1 + np.abs(root))) | (np.abs(value) <= noise)):
            break
    return root
