"""Loops over the functions of a Fourier basis, given by orders and which components are sines."""

import math
from typing import Any

from symhbm.numerics.loops.loop import Loop

_ROUND_OFF = 4e-15
"""Error [rad] of the length of a period."""


@Loop
def as_series(order: Any, is_sine: Any, coefficients: Any, cosine: Any, sine: Any) -> None:
    """Write coefficients (K) as a series, see `symhbm.numerics.loops.series`."""
    for h in range(len(cosine)):
        cosine[h] = sine[h] = 0.0
    for i in range(len(order)):
        if is_sine[i]:
            sine[order[i]] = coefficients[i]
        else:
            cosine[order[i]] = coefficients[i]


@Loop
def functions_at(order: Any, is_sine: Any, angle: float, derivative: int, row: Any) -> None:
    """Write the basis functions at an angle [rad], or a derivative of them, into a row (K)."""
    turn_cosine, turn_sine = math.cos(angle), math.sin(angle)
    c, s, h = 1.0, 0.0, 0
    for i in range(len(order)):
        n = order[i]
        while h < n:
            c, s = c * turn_cosine - s * turn_sine, s * turn_cosine + c * turn_sine
            h += 1
        # Each derivative turns a wave by a quarter; a sine is a cosine turned back by one.
        quarter = (derivative - (1 if is_sine[i] else 0)) % 4
        wave = c if quarter % 2 == 0 else s
        sign = 1.0 if quarter == 0 or quarter == 3 else -1.0
        row[i] = sign * wave * n**derivative


@Loop
def moments(begin: float, end: float, result: Any) -> None:
    """Write integrals of ``cos(k tau)`` and ``sin(k tau)`` over an interval into (2, 2 H + 1)."""
    half, middle = 0.5 * (end - begin), 0.5 * (begin + end)
    turn, shift = (math.cos(middle), math.sin(middle)), (math.cos(half), math.sin(half))
    result[0, 0], result[1, 0] = end - begin, 0.0
    if abs(end - begin - 2 * math.pi) < _ROUND_OFF:
        # A constant has no harmonics over a period: those by round-off may exceed a small motion.
        result[0, 0], shift = 2 * math.pi, (-1.0, 0.0)
    cosine, sine = turn
    half_cosine, half_sine = shift
    # Sines of the half width, and no differences: short intervals keep their digits.
    for k in range(1, result.shape[1]):
        size = 2 * half_sine / k
        result[0, k], result[1, k] = size * cosine, size * sine
        cosine, sine = cosine * turn[0] - sine * turn[1], sine * turn[0] + cosine * turn[1]
        half_cosine, half_sine = (
            half_cosine * shift[0] - half_sine * shift[1],
            half_sine * shift[0] + half_cosine * shift[1],
        )


@Loop
def add_products(sums: Any, order: Any, is_sine: Any, norm: Any, out: Any) -> None:
    """Add the matrix that restricts a series to what the moments ``sums`` are of, transposed."""
    size = len(order)
    for i in range(size):
        for j in range(size):
            p, q = order[i], order[j]
            difference, total = abs(p - q), p + q
            if is_sine[i] and is_sine[j]:
                value = sums[0, difference] - sums[0, total]
            elif is_sine[i] or is_sine[j]:
                # sin(a) cos(b) = [sin(a + b) + sin(a - b)] / 2
                turn = p - q if is_sine[i] else q - p
                value = sums[1, total] + (sums[1, difference] if turn > 0 else -sums[1, difference])
            else:
                value = sums[0, difference] + sums[0, total]
            out[j, i] += 0.5 * norm[i] * value
