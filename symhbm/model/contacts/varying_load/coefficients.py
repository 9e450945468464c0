"""Force coefficients of a contact from its pieces, as closed forms.

With ``u``, ``v`` the coefficients of both displacements and ``1`` those of a constant,

    T = k_t A u - k_n B v - N0 b - mu (k_n C v + N0 c),        N = k_n E v + N0 e,

where the matrices and vectors depend on the pieces alone. Each entry is a sum of integrals of
``cos(k tau)`` and ``sin(k tau)`` over pieces, which are products: short pieces keep their digits.
"""

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
    STICK_HIGH,
    STICK_LOW,
    WEIGHT,
)
from symhbm.numerics.loops import Loop, fourier


@Loop
def coefficients(pieces: Any, count: int, order: Any, is_sine: Any, norm: Any, events: Any) -> None:
    """Write ``A, B, C, E`` column by column, ``b, c, e`` of one contact into its events.

    ``order``, ``is_sine`` and ``norm`` (K) are those of the basis, ``events`` (4 K^2 + 3 K).
    """
    size = len(order)
    area = size * size
    matrices = events[: 4 * area].reshape((4, size, size))
    vectors = events[4 * area :].reshape((3, size))
    for i in range(len(events)):
        events[i] = 0.0
    n_moments = 2 * int(order[size - 1]) + 1
    sums = np.zeros((4, 2, n_moments))
    of_piece, sticking, signed, closed = sums[0], sums[1], sums[2], sums[3]
    rows = np.empty((2, size))
    share, row = rows[0], rows[1]
    for k in range(count):
        kind, weight = int(pieces[k, KIND]), pieces[k, WEIGHT]
        if kind == APART:
            continue
        fourier.moments(pieces[k, BEGIN], pieces[k, END], of_piece)
        if kind == LIFTED:
            weight = -1.0
        sticks = kind >= STICK_LOW and kind != LIFTED
        sign = 0.0
        if kind in (PUSHED_UP, STICK_LOW):
            sign = -1.0
        elif kind in (PUSHED_DOWN, STICK_HIGH):
            sign = 1.0
        for c in range(2):
            for h in range(n_moments):
                part = weight * of_piece[c, h]
                closed[c, h] += part
                if sticks:
                    sticking[c, h] += part
                else:
                    signed[c, h] += sign * part
        alpha = pieces[k, SHARE] if sticks else 0.0
        for i in range(size):
            share[i] = weight * norm[i] * of_piece[1 if is_sine[i] else 0, int(order[i])]
            vectors[0, i] += alpha * share[i]
            vectors[1, i] += sign * share[i]
            vectors[2, i] += share[i]
        if sticks:
            fourier.functions_at(order, is_sine, pieces[k, ANCHOR], 0, row)
            for i in range(size):
                for j in range(size):
                    product = share[i] * row[j]
                    matrices[0, j, i] -= product
                    matrices[1, j, i] += alpha * product
                    matrices[2, j, i] += sign * product
    fourier.add_products(sticking, order, is_sine, norm, matrices[0])
    fourier.add_products(signed, order, is_sine, norm, matrices[2])
    fourier.add_products(closed, order, is_sine, norm, matrices[3])
