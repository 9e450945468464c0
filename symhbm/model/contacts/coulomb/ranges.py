"""Estimates of slip margins between the points of a path, from the ranges of motions."""

import math
from typing import Any

import numpy as np

from symhbm.numerics import FloatArray, FourierBasis
from symhbm.numerics.loops import Loop

_SAMPLES = 16
"""Angles per period of the highest harmonic at which the range of a motion is taken."""


def range_margins(basis: FourierBasis, motion: FloatArray, error: FloatArray) -> FloatArray:
    """Logarithm of half the range of each motion (n, K), with an ``error`` (n, 1) [m], (n, 1).

    Samples of it give the range where it has several harmonics.
    """
    margins = np.empty((len(motion), 1))
    motion = np.ascontiguousarray(motion)
    if basis.has_one_harmonic and basis.n_components == 2:
        _of_one_harmonic(motion, error, margins)
    else:
        count = _SAMPLES * basis.highest
        values = basis.values(2 * np.pi * np.arange(count) / count)
        _of_samples(np.ascontiguousarray(values), motion, error, margins)
    return margins


@Loop
def _of_one_harmonic(motion: Any, error: Any, margins: Any) -> None:
    """Write the margins of motions with a cosine and a sine alone."""
    for i in range(len(motion)):
        size = math.sqrt(motion[i, 0] ** 2 + motion[i, 1] ** 2) + error[i, 0]
        margins[i, 0] = math.log(size) if size > 0 else -math.inf


@Loop
def _of_samples(values: Any, motion: Any, error: Any, margins: Any) -> None:
    """Write the margins over samples, from the ``values`` (s, K) of the components at them."""
    for i in range(len(motion)):
        lowest, highest = math.inf, -math.inf
        for h in range(len(values)):
            at = 0.0
            for k in range(values.shape[1]):
                at += values[h, k] * motion[i, k]
            lowest, highest = min(lowest, at), max(highest, at)
        size = (highest - lowest) / 2 + error[i, 0]
        margins[i, 0] = math.log(size) if size > 0 else -math.inf
