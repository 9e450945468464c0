"""Loops over polynomials on [0, 1]: where they change their sign, and which does so first.

In the Bernstein basis the signs of the coefficients bound the number of zeros (variation
diminishing): none is missed, however close the next one is.
"""

import math
from functools import cache

import numpy as np

from symhbm.numerics.loops.arrays import copy
from symhbm.numerics.machine_code import Loop

_CLOSEST = 2.0**-46
"""Share of the interval below which an interval with several zeros is not halved."""
_DEEPEST = 50
"""Intervals that wait at most: one for each halving."""
_OUTSIDE = 1e-9
"""Share of the interval over which a polynomial may begin below 0 by round-off alone."""
_STEPS = 100
"""Most steps to a zero, each at least a bisection."""


@cache
def bernstein(degree: int) -> np.ndarray:
    """Map of powers to Bernstein coefficients, (degree + 1, degree + 1).

    Every entry is at most one: no digits are lost.
    """
    row = range(degree + 1)
    return np.array([[math.comb(i, k) / math.comb(degree, k) for k in row] for i in row])


def crossings(powers: np.ndarray) -> list[tuple[float, bool]]:
    """Changes of sign of a polynomial on [0, 1], ascending: where, and whether it falls.

    ``powers`` (degree + 1,) are its coefficients. Zeros closer than 1e-14 may be taken as one, or
    as none where no sign is left.
    """
    places, falls = np.empty(2 * len(powers)), np.empty(2 * len(powers), dtype=bool)
    powers = np.ascontiguousarray(powers)
    count = _find_crossings(bernstein(len(powers) - 1) @ powers, powers, places, falls)
    return list(zip(places[:count].tolist(), falls[:count].tolist(), strict=True))


@Loop
def _find_crossings(coefficients, powers, places, falls) -> int:
    """Write the first changes of sign, as many as there is place for; their number.

    ``coefficients`` are those of Bernstein, ``powers`` those of the same polynomial.
    """
    size, count, waiting, before = len(powers), 0, 1, 0
    values, left, width = np.empty((_DEEPEST, size)), np.zeros(_DEEPEST), np.ones(_DEEPEST)
    copy(coefficients, values[0])
    while waiting and count < len(places):
        waiting -= 1
        first, last, changes = 0, 0, 0
        for i in range(size):
            if values[waiting, i] != 0:
                sign = 1 if values[waiting, i] > 0 else -1
                if first == 0:
                    first = sign
                elif sign != last:
                    changes += 1
                last = sign
        if first == 0:
            continue
        if changes > 1 and width[waiting] > _CLOSEST:
            _halve(values[waiting], values[waiting + 1])
            width[waiting] /= 2
            left[waiting + 1], width[waiting + 1] = left[waiting], width[waiting]
            left[waiting] += width[waiting]
            waiting += 2
            continue
        if before not in (0, first):
            places[count], falls[count] = left[waiting], before > 0
            count += 1
        if first != last and count < len(places):
            right = left[waiting] + width[waiting]
            places[count] = _zero(powers, left[waiting], right, first > 0)
            falls[count] = first > 0
            count += 1
        before = last
    return count


@Loop
def _halve(right, left) -> None:
    """Put Bernstein coefficients on the right half in place of those on both; write the left."""
    size = len(right)
    for i in range(size):
        left[i] = right[0]
        for k in range(size - 1 - i):
            right[k] = (right[k] + right[k + 1]) / 2


@Loop
def _zero(powers, left: float, right: float, falls: bool) -> float:
    """The only zero between ``left`` and ``right``: Newton's method kept inside a bracket."""
    root = (left + right) / 2
    for _ in range(_STEPS):
        value, slope = 0.0, 0.0
        for k in range(len(powers) - 1, -1, -1):
            slope = slope * root + value
            value = value * root + powers[k]
        if (value > 0) == falls:
            left = root
        else:
            right = root
        new = root - value / slope if slope != 0 else left - 1.0
        if not left <= new <= right:
            new = (left + right) / 2
        step, root = abs(new - root), new
        if step <= 1e-16 + 2e-16 * root:
            break
    return root


@Loop
def find_exits(coefficients, powers, exits) -> None:
    """Write where polynomials that begin positive become negative (m,), infinity if they do not.

    ``coefficients`` are those of Bernstein, ``powers`` those of the same polynomials, (m, degree +
    1). One that begins below 0 by more than round-off does so at 0.
    """
    places, falls = np.empty(2), np.empty(2, dtype=np.bool_)
    for m in range(len(powers)):
        exits[m] = math.inf
        first, lowest = 0.0, math.inf
        for i in range(powers.shape[1]):
            value = coefficients[m, i]
            lowest = min(lowest, value)
            first = value if first == 0.0 else first
        if first == 0.0 or lowest > 0:
            continue
        count = _find_crossings(coefficients[m], powers[m], places, falls)
        if first < 0 and (count == 0 or places[0] > _OUTSIDE):
            exits[m] = 0.0
            continue
        for i in range(count - 1, -1, -1):
            if falls[i]:
                exits[m] = places[i]
