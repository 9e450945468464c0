"""Loops over one truncated Fourier series: its values, its sign changes, its level crossings.

A series is two arrays, the coefficients of ``cos(h tau)`` and ``sin(h tau)`` for all ``h`` from 0
to the highest harmonic.
"""

import math
from typing import Any

import numpy as np

from symhbm.numerics.loops import Loop

_CELLS = 4
"""First cells per period of the highest harmonic."""
_CLOSEST = 1e-8
"""Width [rad] of a cell below which a pair of zeros does not count."""
_STEPS = 60
"""Most steps to a zero, each at least a bisection."""
_ROUND_OFF = 2e-16


@Loop
def value_at(cosine: Any, sine: Any, angle: float, derivative: int) -> float:
    """A series at an angle [rad], or its derivative 0, 1 or 2 by the angle."""
    turn_cosine, turn_sine = math.cos(angle), math.sin(angle)
    c, s, total = 1.0, 0.0, 0.0
    for h in range(len(cosine)):
        if derivative == 0:
            total += cosine[h] * c + sine[h] * s
        elif derivative == 1:
            total += h * (sine[h] * c - cosine[h] * s)
        else:
            total -= h * h * (cosine[h] * c + sine[h] * s)
        c, s = c * turn_cosine - s * turn_sine, s * turn_cosine + c * turn_sine
    return total


@Loop
def crossing(
    cosine: Any, sine: Any, derivative: int, level: float, left: float, right: float, rises: bool
) -> float:
    """Where a series, or its first derivative, passes a level between two angles, once."""
    root = 0.5 * (left + right)
    low = value_at(cosine, sine, left, derivative) - level
    high = value_at(cosine, sine, right, derivative) - level
    if low * high < 0:
        root = left + (right - left) * low / (low - high)
    elif (low >= 0) == rises:
        return left
    for _ in range(_STEPS):
        value = value_at(cosine, sine, root, derivative) - level
        slope = value_at(cosine, sine, root, derivative + 1)
        if (value > 0) == rises:
            right = root
        else:
            left = root
        new = 0.5 * (left + right)
        if slope != 0.0:
            newton = root - value / slope
            if left <= newton <= right:
                new = newton
        step = abs(new - root)
        root = new
        if step <= 4 * _ROUND_OFF * (1 + abs(root)):
            break
    return root


@Loop
def sign_changes(
    cosine: Any, sine: Any, derivative: int, noise: float, angles: Any, rises: Any
) -> int:
    """Changes of sign of a series, or of its first derivative, in ``[0, 2 pi)``, ascending.

    They are written into ``angles`` [rad] and ``rises``; the result is their number. Values up to
    the ``noise`` are zero. On each cell a cubic through values and slopes at both ends, with the
    bound of its error, tells that there is no zero or that the function is monotone, else the cell
    is halved: no pair of zeros is passed over unless it is closer than 1e-8 rad.
    """
    highest = len(cosine) - 1
    bound, size = 0.0, 0.0
    for h in range(highest + 1):
        amplitude = abs(cosine[h]) + abs(sine[h])
        size += amplitude * (1.0 if derivative == 0 else h)
        bound += amplitude * float(h) ** (4 + derivative)
    if size <= noise:
        return 0
    cells = _CELLS * max(highest, 2)
    count = 0
    stack = np.empty((40, 6))
    start = value_at(cosine, sine, 0.0, derivative), value_at(cosine, sine, 0.0, derivative + 1)
    before = start
    for i in range(cells):
        left, right = 2 * math.pi * i / cells, 2 * math.pi * (i + 1) / cells
        after = start  # of the last cell: a zero there counts once
        if i < cells - 1:
            value = value_at(cosine, sine, right, derivative)
            after = value, value_at(cosine, sine, right, derivative + 1)
        stack[0] = left, right, before[0], before[1], after[0], after[1]
        before = after
        depth = 1
        while depth:
            depth -= 1
            left, right, first, first_slope, last, last_slope = stack[depth]
            width = right - left
            error = bound * width**4 / 384 + noise
            # Coefficients of the cubic in the Bernstein basis bound it, and those of its slope.
            second, third = first + first_slope * width / 3, last - last_slope * width / 3
            lowest, largest = min(first, second, third, last), max(first, second, third, last)
            if lowest > error or largest < -error:
                continue
            steepest = bound * width**3 / 96
            slopes = first_slope, 3 * (third - second) / width, last_slope
            monotone = min(slopes) > steepest or max(slopes) < -steepest
            if not monotone and width > _CLOSEST and max(largest, -lowest) > noise:
                middle = 0.5 * (left + right)
                value = value_at(cosine, sine, middle, derivative)
                slope = value_at(cosine, sine, middle, derivative + 1)
                stack[depth] = middle, right, value, slope, last, last_slope
                stack[depth + 1] = left, middle, first, first_slope, value, slope
                depth += 2
            elif (first > 0) != (last > 0) and count < len(angles):
                angles[count] = crossing(cosine, sine, derivative, 0.0, left, right, last > 0)
                rises[count] = last > 0
                count += 1
    return count
