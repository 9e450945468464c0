"""Loops over motions: where they turn, from the highest point on."""

import math
from typing import Any

import numpy as np

from symhbm.numerics.loops import fourier, series
from symhbm.numerics.loops.loop import Loop

DONE, NOT_FINITE, NOT_APART = range(3)
"""What came out: all points, coefficients that are no numbers, no two turning points."""
_SMALL, _LARGE = 1e-100, 1e100
"""Bounds of coefficients whose products neither vanish nor overflow."""


@Loop
def turning_points(
    cosine: Any, sine: Any, mirrors: bool, angle: Any, value: Any
) -> tuple[int, int, int]:
    """Write where a series turns over one period [rad], ascending from its maximum, and its values.

    ``angle`` and ``value`` take twice the highest harmonic. ``mirrors`` tells that its second half
    is minus the first. Results are what came out, how many they are, and which is the minimum.
    A constant has none, and its value is written.
    """
    highest = len(cosine) - 1
    largest = 0.0
    for h in range(highest + 1):
        if not (math.isfinite(cosine[h]) and math.isfinite(sine[h])):
            return NOT_FINITE, 0, 0
        if h:
            largest = max(largest, abs(cosine[h]), abs(sine[h]))
    if largest == 0.0:
        angle[0], value[0] = 0.0, cosine[0]
        return DONE, 0, 0
    scale = 1.0 if _SMALL < largest < _LARGE else largest
    rate, rises = np.empty((2, highest + 1)), np.empty(2 * highest, dtype=np.bool_)
    for h in range(highest + 1):
        rate[0, h], rate[1, h] = h * (sine[h] / scale), -h * (cosine[h] / scale)
    found = np.empty((2, 2 * highest))
    count = series.sign_changes_in(rate[0], rate[1], 0.0, mirrors, found[0], rises)
    if count == 0 or (count % 2 == 1) != mirrors:
        return NOT_APART, 0, 0
    for i in range(count):
        found[1, i] = series.at(cosine, sine, found[0, i])[0]
    if mirrors:
        for i in range(count):
            found[0, count + i], found[1, count + i] = found[0, i] + math.pi, -found[1, i]
        count *= 2
    start, lowest = 0, 0
    for i in range(count):
        if found[1, i] > found[1, start]:
            start = i
    for i in range(count):
        source = start + i
        again = 0.0
        if source >= count:
            source -= count
            again = 2 * math.pi
        angle[i], value[i] = found[0, source] + again, found[1, source]
        if value[i] < value[lowest]:
            lowest = i
    return DONE, count, count // 2 if mirrors else lowest


@Loop
def turning_points_of(
    order: Any,
    is_sine: Any,
    mirrors: bool,
    motions: Any,
    angle: Any,
    value: Any,
    counts: Any,
    lowest: Any,
) -> int:
    """Write the `turning_points` of motions (n, K), the last one again behind them.

    ``angle`` and ``value`` are (n, 2 H), ``counts`` and ``lowest`` (n,).
    """
    waves = np.empty((2, order[len(order) - 1] + 1))
    for j in range(len(motions)):
        fourier.as_series(order, is_sine, motions[j], waves[0], waves[1])
        status, count, low = turning_points(waves[0], waves[1], mirrors, angle[j], value[j])
        if status != DONE:
            return status
        counts[j], lowest[j] = count, low
        for i in range(max(count, 1), angle.shape[1]):
            angle[j, i], value[j, i] = angle[j, i - 1], value[j, i - 1]
    return DONE
