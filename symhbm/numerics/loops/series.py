"""Loops over one truncated Fourier series: its values, its sign changes, its level crossings.

A series is two arrays, the coefficients of ``cos(h tau)`` and ``sin(h tau)`` for all ``h`` from 0
to the highest harmonic.
"""

import math
from typing import Any

import numpy as np

from symhbm.numerics.loops.loop import Loop

_CELLS = 4
"""First cells per period of the highest harmonic."""
_CLOSEST = 1e-8
"""Width [rad] of a cell below which a pair of zeros does not count."""
_STEPS = 60
"""Most steps to a zero, each at least a bisection."""
_LAST_STEP = 1e-12
"""Last step to a zero, relative to the angle."""


@Loop
def at(cosine: Any, sine: Any, angle: float) -> tuple[float, float]:
    """Value and slope of a series at an angle [rad]."""
    turn_cosine, turn_sine = math.cos(angle), math.sin(angle)
    c, s, value, slope = 1.0, 0.0, 0.0, 0.0
    for h in range(len(cosine)):
        value += cosine[h] * c + sine[h] * s
        slope += h * (sine[h] * c - cosine[h] * s)
        c, s = c * turn_cosine - s * turn_sine, s * turn_cosine + c * turn_sine
    return value, slope


@Loop
def derive(cosine: Any, sine: Any, of_cosine: Any, of_sine: Any) -> None:
    """Write the coefficients of the derivative of a series."""
    for h in range(len(cosine)):
        of_cosine[h], of_sine[h] = h * sine[h], -h * cosine[h]


@Loop
def crossing(cosine: Any, sine: Any, level: float, left: float, right: float, rises: bool) -> float:
    """Where a series passes a level between two angles, between which it is monotone."""
    low, high = at(cosine, sine, left)[0] - level, at(cosine, sine, right)[0] - level
    if low * high >= 0 and (low >= 0) == rises:
        return left
    root = left + (right - left) * low / (low - high) if low * high < 0 else 0.5 * (left + right)
    for _ in range(_STEPS):
        value, slope = at(cosine, sine, root)
        value -= level
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
        # The error of Newton's method after a step is its square.
        if step <= _LAST_STEP * (1 + abs(root)):
            break
    return root


@Loop
def sign_changes(cosine: Any, sine: Any, noise: float, angles: Any, rises: Any) -> int:
    """Changes of sign of a series in ``[0, 2 pi)``, ascending.

    They are written into ``angles`` [rad] and ``rises``; the result is their number. Values up to
    the ``noise`` are zero. On each cell a cubic through values and slopes at both ends, with the
    bound of its error, tells that there is no zero or that the function is monotone, else the cell
    is halved: no pair of zeros is passed over unless it is closer than 1e-8 rad.
    """
    highest = len(cosine) - 1
    bound, size = 0.0, 0.0
    for h in range(highest + 1):
        amplitude = abs(cosine[h]) + abs(sine[h])
        size += amplitude
        bound += amplitude * float(h * h) ** 2
    if size <= noise:
        return 0
    cells = _CELLS * max(highest, 2)
    count = 0
    stack = np.empty((40, 6))
    start = at(cosine, sine, 0.0)
    before = start
    for i in range(cells):
        left, right = 2 * math.pi * i / cells, 2 * math.pi * (i + 1) / cells
        # The end of the last cell is the begin of the first: a zero there counts once.
        after = at(cosine, sine, right) if i < cells - 1 else start
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
            inner = 3 * (third - second) / width
            gentlest = min(first_slope, inner, last_slope)
            monotone = gentlest > steepest or max(first_slope, inner, last_slope) < -steepest
            if not monotone and width > _CLOSEST and max(largest, -lowest) > noise:
                middle = 0.5 * (left + right)
                value, slope = at(cosine, sine, middle)
                stack[depth] = middle, right, value, slope, last, last_slope
                stack[depth + 1] = left, middle, first, first_slope, value, slope
                depth += 2
            elif (first > 0) != (last > 0) and count < len(angles):
                angles[count] = crossing(cosine, sine, 0.0, left, right, last > 0)
                rises[count] = last > 0
                count += 1
    return count
