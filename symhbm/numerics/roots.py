"""Zeros between two values of opposite sign: of one function, and of monotone ones at once."""

from collections.abc import Callable

import numpy as np
import scipy

from symhbm.numerics.check import FloatArray

MACHINE = np.finfo(float).eps
"""Round-off of double precision."""
_MAX_SECANTS = 12
_LAST_SECANT = 1e-11
"""Secant step that is not taken any more, over the distance of both values."""
_ASIDE = 1e-6
"""Distance from a zero, over that of both values, at which the signs are checked."""


def bracketed_root(
    function: Callable[[float], float],
    low: float = 0.0,
    high: float = 1.0,
    start: float | None = None,
    precision: float = 1e-13,
) -> float:
    """Where a function changes its sign between two values, at which its signs are opposite.

    By secants from a ``start`` near it, within 1e-11 of the distance, or by Brent's method, which
    takes over where secants fail: where the function jumps, too. Its ``precision`` is relative to
    the larger value.
    """
    known: dict[float, float] = {}

    def value(at: float) -> float:
        if at not in known:
            known[at] = function(at)
        return known[at]

    if start is not None:
        sign, width = np.sign(value(low)), high - low
        # The value at the opposite end has the other sign.
        root, before = start, high if value(start) * sign > 0 else low
        for _ in range(_MAX_SECANTS):
            change = value(root) - value(before)
            step = -value(root) * (root - before) / change if change else np.inf
            if abs(step) <= _LAST_SECANT * width:
                left = max((at for at in known if at < root - _ASIDE * width), default=low)
                right = min((at for at in known if at > root + _ASIDE * width), default=high)
                if value(left) * sign >= 0 >= value(right) * sign:
                    return root
                break
            if not low <= root + step <= high:
                break
            root, before = root + step, root
    xtol = precision * max(abs(low), abs(high))
    return float(scipy.optimize.brentq(value, low, high, xtol=xtol))  # type: ignore


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
