"""Intervals by the profile of a likelihood: values that it does not make much less likely."""

from collections.abc import Callable

import numpy as np
from scipy import optimize, stats

from symhbm.numerics import FloatArray

_LIKELIHOOD = 1e-5
"""Digits of the largest likelihood at one value: far below the drop that ends an interval."""
_MOST_STEPS, _HALVINGS = 60, 10
"""Steps, each twice the last, after which an interval has no end; and halvings of the last one,
which leave a thousandth of it."""


def drop(n_values: int, n_parameters: int, confidence: float) -> float:
    """How much the logarithm of the likelihood may fall within an interval.

    As of normally distributed values, for which Student's distribution makes it exact; for many
    values it is half the quantile of chi squared.
    """
    free = n_values - n_parameters
    quantile = stats.t.ppf((1 + confidence) / 2, free)
    return n_values / 2 * float(np.log1p(quantile**2 / free))


def profile_interval(
    minus_log: Callable[[float, FloatArray], float],
    value: float,
    others: FloatArray,
    step: float,
    most: float,
) -> tuple[float, float]:
    """Ends of the values around the likeliest one whose likelihood falls by ``most`` at the most.

    ``minus_log`` is that of the likelihood, of a value and of ``others`` (n,), which are the
    likeliest at each; ``step`` is about the width. An end that is not found is infinite.
    """
    lowest = minus_log(value, others)
    options = dict(xatol=_LIKELIHOOD, fatol=_LIKELIHOOD)

    def end(sign: float) -> float:
        likeliest = others

        def inside(distance: float) -> bool:
            nonlocal likeliest
            at = value + sign * distance
            best = optimize.minimize(
                lambda rest: minus_log(at, rest), likeliest, method="Nelder-Mead", options=options
            )
            if best.fun - lowest > most:
                return False
            likeliest = best.x
            return True

        low, high = 0.0, step
        for _ in range(_MOST_STEPS):
            if not inside(high):
                break
            low, high = high, 2 * high
        else:
            return sign * np.inf
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            low, high = (middle, high) if inside(middle) else (low, middle)
        return value + sign * low

    return end(-1.0), end(1.0)
