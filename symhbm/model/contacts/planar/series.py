"""Motion and limit of one contact as series: values, bounds, and where the limit is above zero.

``waves`` (3, 2, H + 1) holds the coefficients of ``cos(h tau)`` and ``sin(h tau)`` for all ``h``
from 0 to the highest harmonic: of ``x = k_t u_x`` and ``y = k_t u_y`` [N], and of the limit
``r = mu p`` [N], where ``p`` is the normal load.
"""

import math
from typing import Any

import numpy as np

from symhbm.numerics.loops import Loop

ROUND_OFF = 2.2e-16
LAST_STEP = 1e-10
"""Last step [rad] of Newton's method: what is left is about its square."""
_DOUBLE = 1e-14
"""Relative size below which a smallest limit is a zero: it opens for no time."""
_MOST = 5000
"""Most steps to the next zero: enough for any but one that is double up to round-off."""


@Loop
def motion_at(waves: Any, angle: float, out: Any) -> None:
    """Write values and two derivatives of ``x``, ``y`` and ``r`` at an angle [rad] into (3, 3)."""
    turn_cosine, turn_sine = math.cos(angle), math.sin(angle)
    for k in range(3):
        c, s = 1.0, 0.0
        value, first, second = 0.0, 0.0, 0.0
        for h in range(waves.shape[2]):
            a, b = waves[k, 0, h], waves[k, 1, h]
            wave = a * c + b * s
            value += wave
            first += h * (b * c - a * s)
            second -= h * h * wave
            c, s = c * turn_cosine - s * turn_sine, s * turn_cosine + c * turn_sine
        out[k, 0], out[k, 1], out[k, 2] = value, first, second


@Loop
def rates_at(waves: Any, angle: float, out: Any) -> None:
    """Write ``x'``, ``y'``, ``r`` and ``r'`` at an angle [rad] into (4)."""
    turn_cosine, turn_sine = math.cos(angle), math.sin(angle)
    c, s = 1.0, 0.0
    x, y, limit, rate = 0.0, 0.0, 0.0, 0.0
    for h in range(waves.shape[2]):
        x += h * (waves[0, 1, h] * c - waves[0, 0, h] * s)
        y += h * (waves[1, 1, h] * c - waves[1, 0, h] * s)
        limit += waves[2, 0, h] * c + waves[2, 1, h] * s
        rate += h * (waves[2, 1, h] * c - waves[2, 0, h] * s)
        c, s = c * turn_cosine - s * turn_sine, s * turn_cosine + c * turn_sine
    out[0], out[1], out[2], out[3] = x, y, limit, rate


@Loop
def bounds_of(waves: Any, out: Any) -> None:
    """Write bounds of derivatives 0 to 3 of the motion ``(x, y)`` and of ``r`` into (2, 4).

    The mean of the motion does not count.
    """
    out[:] = 0.0
    for h in range(waves.shape[2]):
        size = 0.0
        for part in range(2):
            size += math.hypot(waves[0, part, h], waves[1, part, h])
        limit = math.hypot(waves[2, 0, h], waves[2, 1, h])
        for d in range(4):
            if h > 0:
                out[0, d] += size * float(h) ** d
            out[1, d] += limit * (float(h) ** d if h > 0 or d == 0 else 0.0)


@Loop
def extreme_between(waves: Any, sign: float, left: float, right: float) -> Any:
    """Where the limit times a sign is smallest between two angles [rad], and the limit there."""
    out = np.empty((3, 3))
    angle = 0.5 * (left + right)
    for _ in range(60):
        motion_at(waves, angle, out)
        slope, bend = sign * out[2, 1], sign * out[2, 2]
        if slope > 0:
            right = angle
        else:
            left = angle
        new, last = 0.5 * (left + right), 1e-15
        if bend > 0 and left <= angle - slope / bend <= right:
            new, last = angle - slope / bend, LAST_STEP
        step = abs(new - angle)
        angle = new
        if step <= last:
            break
    motion_at(waves, angle, out)
    return angle, out[2, 0]


@Loop
def next_zero(
    waves: Any, sign: float, start: float, end: float, bound: float, size: float
) -> float:
    """First angle [rad] after ``start`` at which the limit loses its sign, ``end`` without any.

    ``bound`` is that of its second derivative: no step leaps over a zero. ``size`` is that of the
    limit, which round-off is relative to.
    """
    out = np.empty((3, 3))
    angle = start
    for _ in range(_MOST):
        motion_at(waves, angle, out)
        value, slope = sign * out[2, 0], sign * out[2, 1]
        if value <= 4 * ROUND_OFF * size and slope < 0:
            return angle
        root = math.sqrt(max(slope * slope + 2 * bound * max(value, 0.0), 0.0))
        # The positive root of value + slope h - bound h^2 / 2.
        if slope < 0:
            step = 2 * max(value, 0.0) / (root - slope)
        else:
            step = (slope + root) / bound
        angle += max(step, 4 * ROUND_OFF * (1 + abs(angle)))
        if angle >= end:
            return end
    return end


@Loop
def closed_intervals(waves: Any, bounds: Any, closes: Any, opens: Any) -> int:
    """Write where the limit is above zero [rad]; their number, -1 where it always is.

    Intervals ascend, the first begins in ``[0, 2 pi)``; an interval ends after its begin.
    """
    out = np.empty((3, 3))
    size, bound = bounds[1, 0], bounds[1, 2]
    period = 2 * math.pi
    if bounds[1, 1] <= ROUND_OFF * size:
        return -1 if waves[2, 0, 0] > 0 else 0
    # From the lowest sample on all is one sign after the other.
    samples = 8 * waves.shape[2]
    low, high, at_low, at_high = np.inf, -np.inf, 0.0, 0.0
    for i in range(samples):
        angle = period * i / samples
        motion_at(waves, angle, out)
        if out[2, 0] < low:
            low, at_low = out[2, 0], angle
        if out[2, 0] > high:
            high, at_high = out[2, 0], angle
    cell = period / samples
    angle, low = extreme_between(waves, 1.0, at_low - cell, at_low + cell)
    at_high, high = extreme_between(waves, -1.0, at_high - cell, at_high + cell)
    tiny = _DOUBLE * size
    if high <= tiny:
        return 0
    if low > tiny:
        # Where a sample misses a dip, the search from the highest point finds it.
        first = next_zero(waves, 1.0, at_high, at_high + period, bound, size)
        if first >= at_high + period:
            return -1
        angle = first
        motion_at(waves, angle, out)
        angle, low = extreme_between(waves, 1.0, angle, angle + cell)
    if low > -tiny:
        motion_at(waves, angle, out)
        # It touches zero and is above it all the same.
        closes[0], opens[0] = angle % period, angle % period + period
        return 1
    start, end, count = angle, angle + period, 0
    while count < len(closes):
        close = next_zero(waves, -1.0, start, end, bound, size)
        if close >= end:
            break
        start = next_zero(waves, 1.0, close + 2 * ROUND_OFF * (1 + abs(close)), end, bound, size)
        if start - close > 1e-14:
            closes[count], opens[count] = close, start
            count += 1
    return count
