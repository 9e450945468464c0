"""How far statistics of a few samples may be from those of all: named or drawn in each picture."""

from collections.abc import Callable

import numpy as np
from scipy.stats import binom, t

CONFIDENCE = 0.95
WORDS = f"{100 * CONFIDENCE:.0f} % interval"
N_RESAMPLED = 2000
"""Resampled sets: their quantiles scatter by less than a line is wide."""


def of_mean(values: np.ndarray, axis: int = -1) -> np.ndarray:
    """Half of the interval of a mean over an axis, by Student's t."""
    n = values.shape[axis]
    spread = values.std(axis=axis, ddof=1) / np.sqrt(n)
    return float(t.ppf((1 + CONFIDENCE) / 2, n - 1)) * spread


def of_median(values: np.ndarray, axis: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """The interval of a median over an axis: two of the values in order, whatever they are of."""
    n = values.shape[axis]
    rank = int(binom.ppf((1 - CONFIDENCE) / 2, n, 0.5))
    low = max(rank - 1, 0)
    ordered = np.sort(values, axis=axis)
    return ordered.take(low, axis), ordered.take(n - 1 - low, axis)


def of_share(share: np.ndarray, n: int) -> np.ndarray:
    """Half of the interval of a share of ``n`` samples."""
    return float(t.ppf((1 + CONFIDENCE) / 2, n - 1)) * np.sqrt(share * (1 - share) / n)


def of_statistic(statistic: Callable[[np.ndarray], float], n: int) -> tuple[float, float]:
    """The interval of a statistic of ``n`` samples, given by their numbers, by resampling."""
    draws = np.random.default_rng(1).integers(0, n, (N_RESAMPLED, n))
    found = [statistic(draw) for draw in draws]
    low, high = np.quantile(found, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return float(low), float(high)
