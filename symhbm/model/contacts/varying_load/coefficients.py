"""Force coefficients of a contact from its pieces, as closed forms.

With ``u``, ``v`` the coefficients of both displacements and ``1`` those of a constant,

    T = k_t A u - k_n B v - N0 b - mu (k_n C v + N0 c),        N = k_n E v + N0 e,

where the matrices and vectors depend on the pieces alone. Each entry is a sum of integrals of
``cos(k tau)`` and ``sin(k tau)`` over pieces, which are products: short pieces keep their digits.
"""

import math
from typing import Any

import numpy as np

from symhbm.model.contacts.varying_load.march import (
    ANCHOR,
    APART,
    BEGIN,
    END,
    KIND,
    LIFTED,
    PUSHED_DOWN,
    PUSHED_UP,
    SHARE,
    STICK_CLOSED,
    STICK_LOW,
    WEIGHT,
)
from symhbm.numerics.loops import Loop


@Loop
def functions_at(order: Any, is_sine: Any, angle: float, derivative: int, row: Any) -> None:
    """Write the basis functions at an angle [rad], or a derivative of them, into a row (K)."""
    for i in range(len(order)):
        n = order[i]
        # Each derivative turns a wave by a quarter; a sine is a cosine turned back by one.
        quarter = (derivative - (1 if is_sine[i] else 0)) % 4
        wave = math.cos(n * angle) if quarter % 2 == 0 else math.sin(n * angle)
        sign = 1.0 if quarter == 0 or quarter == 3 else -1.0
        row[i] = sign * wave * n**derivative


@Loop
def moments(begin: float, end: float, result: Any) -> None:
    """Write integrals of ``cos(k tau)`` and ``sin(k tau)`` over an interval into (2, 2 H + 1)."""
    half, middle = 0.5 * (end - begin), 0.5 * (begin + end)
    turn, shift = (math.cos(middle), math.sin(middle)), (math.cos(half), math.sin(half))
    cosine, sine = turn
    half_cosine, half_sine = shift
    result[0, 0], result[1, 0] = end - begin, 0.0
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
def _add_products(sums: Any, order: Any, is_sine: Any, norm: Any, out: Any) -> None:
    """Add to ``out`` the matrix that restricts a series to what the moments ``sums`` are of."""
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


@Loop
def coefficients(pieces: Any, count: int, order: Any, is_sine: Any, norm: Any, events: Any) -> None:
    """Write ``A, B, C, E`` column by column, ``b, c, e`` of one contact into its events.

    ``order``, ``is_sine`` and ``norm`` (K) are those of the basis, ``events`` (4 K^2 + 3 K).
    """
    size = len(order)
    area = size * size
    matrices = events[: 4 * area].reshape((4, size, size))
    vectors = events[4 * area :].reshape((3, size))
    events[:] = 0.0
    n_moments = 2 * int(order[size - 1]) + 1
    of_piece, sticking = np.zeros((2, n_moments)), np.zeros((2, n_moments))
    signed, closed = np.zeros((2, n_moments)), np.zeros((2, n_moments))
    row, share = np.empty(size), np.empty(size)
    for k in range(count):
        kind, weight = int(pieces[k, KIND]), pieces[k, WEIGHT]
        if kind == APART:
            continue
        moments(pieces[k, BEGIN], pieces[k, END], of_piece)
        if kind == LIFTED:
            weight = -1.0
        closed += weight * of_piece
        for i in range(size):
            share[i] = weight * norm[i] * of_piece[1 if is_sine[i] else 0, int(order[i])]
        vectors[2] += share
        if kind in (PUSHED_UP, PUSHED_DOWN):
            sign = -1.0 if kind == PUSHED_UP else 1.0
            signed += sign * of_piece
            vectors[1] += sign * share
        elif kind != LIFTED:
            sticking += weight * of_piece
            functions_at(order, is_sine, pieces[k, ANCHOR], 0, row)
            sign = 0.0
            if kind != STICK_CLOSED:
                sign = -1.0 if kind == STICK_LOW else 1.0
            alpha = pieces[k, SHARE]
            for i in range(size):
                for j in range(size):
                    product = share[i] * row[j]
                    matrices[0, j, i] -= product
                    matrices[1, j, i] += alpha * product
                    matrices[2, j, i] += sign * product
            vectors[0] += alpha * share
            vectors[1] += sign * share
    _add_products(sticking, order, is_sine, norm, matrices[0])
    _add_products(signed, order, is_sine, norm, matrices[2])
    _add_products(closed, order, is_sine, norm, matrices[3])
