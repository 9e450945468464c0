"""Contacts one after the other: their pieces, force coefficients, margins and what they do.

Force coefficients of a contact are closed forms of its pieces. With ``u``, ``v`` the coefficients
of both displacements and ``1`` those of a constant,

    T = k_t A u - k_n B v - N0 b - mu (k_n C v + N0 c),        N = k_n E v + N0 e,

where the matrices and vectors depend on the pieces alone. Each entry is a sum of integrals of
``cos(k tau)`` and ``sin(k tau)`` over pieces, which are products: short pieces keep their digits.
"""

import math

import numpy as np

from symhbm.model.contacts.press import (
    LARGEST,
    LEAST,
    MEAN,
    OPEN_SHARE,
    SLIP_DISTANCE,
    SLIPS,
    STICK_SHARE,
    chained,
    over_size,
    press_margins,
    variables_of,
)
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
    march,
    walls,
)
from symhbm.numerics.loops import Loop, fourier, series


@Loop
def coefficients(pieces, count: int, order, is_sine, norm, events) -> None:
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


def n_details(highest: int) -> int:
    """Number of details of a contact that `locate` writes, with a highest harmonic."""
    most_pieces = 14 * highest + 8  # which is never exceeded
    return 19 + 6 * most_pieces


@Loop
def locate(basis, motions, values, held, events, margins, by_motion, details) -> int:
    """Locate the events of contacts, see `symhbm.model.contacts.motions.EventLoop`.

    ``motions`` (n, 2 K), coefficients of ``u`` and ``v``; ``values`` (n, 4): ``k_t``, ``k_n``,
    ``mu`` and ``N0``; ``events`` (n, 4 K^2 + 3 K). ``details`` are of each contact figures (6), the
    derivatives of its margins by its values (3, 4), the number of its pieces, and these (most, 6).
    """
    order, is_sine, norm = basis
    waves, turning = np.empty((4, 2, int(order[len(order) - 1]) + 1)), np.empty((4, 2))
    slopes = np.empty((3, 3 * len(order) + 2))
    for j in range(len(motions)):
        noise = _waves(order, is_sine, motions[j], values[j], waves)
        by_values, pieces = details[j, 6:18].reshape((3, 4)), details[j, 19:].reshape((-1, 6))
        count = march(waves, noise, int(held[j]), pieces, turning)
        details[j, 18] = count
        coefficients(pieces, count, order, is_sine, norm, events[j])
        _margins(
            order, is_sine, motions[j], values[j], turning, margins[j], slopes, by_motion[j],
            by_values,
        )  # fmt: skip
        _figures(waves, values[j, 0], pieces, count, turning, details[j, :6])
    return 0


@Loop
def locate_normal(basis, motions, values, held, events, margins, by_motion, details) -> int:
    """As `locate`, of contacts that have ``v`` alone, whose slider neither moves nor pulls.

    ``events`` (n, K^2 + K) are ``E`` and ``e``, margins those of opening and touch.
    """
    (n, size), free = motions.shape, np.full(len(motions), -1.0)
    both, of_both = np.zeros((n, 2 * size)), np.empty((n, 4 * size * size + 3 * size))
    margins_of, slopes = np.empty((n, 3)), np.empty((n, 3, 2 * size))
    both[:, size:] = motions
    failed = locate(basis, both, values, free, of_both, margins_of, slopes, details)
    area = size * size
    events[:, :area], events[:, area:] = of_both[:, 3 * area : 4 * area], of_both[:, -size:]
    margins[:], by_motion[:] = margins_of[:, 1:], slopes[:, 1:, size:]
    return failed


@Loop
def estimate(order, is_sine, motions, values, margins, by_motion, by_values) -> None:
    """The margins of `locate` and their derivatives alone."""
    highest = int(order[len(order) - 1])
    waves, turning = np.empty((4, 2, highest + 1)), np.empty((4, 2))
    slopes = np.empty((3, 3 * len(order) + 2))
    for j in range(len(motions)):
        _waves(order, is_sine, motions[j], values[j], waves)
        # The largest `low`, the smallest `high`, the smallest and the largest `p`.
        for k, of, sign in ((0, 2, 1.0), (1, 3, -1.0), (2, 1, -1.0), (3, 1, 1.0)):
            wave = sign * waves[of]
            value, turning[k, 1] = fourier.largest(wave[0], wave[1], False)
            turning[k, 0] = sign * value
        _margins(
            order, is_sine, motions[j], values[j], turning, margins[j], slopes, by_motion[j],
            by_values[j],
        )  # fmt: skip


@Loop
def _waves(order, is_sine, motion, values, waves) -> tuple[float, float]:
    """As `walls`, of the coefficients of a motion."""
    size, highest = len(order), int(order[len(order) - 1])
    parts = np.zeros((2, 2, highest + 1))
    for i in range(size):
        for k in range(2):
            parts[1 if is_sine[i] else 0, k, int(order[i])] = motion[k * size + i]
    return walls(parts[0], parts[1], values, waves)


@Loop
def _margins(
    order, is_sine, motion, values, turning, margins, slopes, by_motion, by_values
) -> None:
    """Write the margins of slip, opening and touch, and their derivatives.

    Slip: the largest ``low`` less the smallest ``high``, over the size of what makes both.
    """
    size, variables = len(order), np.empty(3 * len(order) + 2)
    variables_of(motion, values, size, variables)
    slopes[:] = 0.0
    margins[SLIPS] = -np.inf
    if values[0] > 0.0 and values[2] == 0.0:
        margins[SLIPS] = np.inf
    elif values[0] > 0.0:
        slope, other = slopes[SLIPS, : 2 * size + 1], np.empty(size)
        fourier.functions_at(order, is_sine, turning[0, 1], 0, slope[:size])
        fourier.functions_at(order, is_sine, turning[1, 1], 0, other)
        slope[size] = -2.0
        for i in range(size):
            slope[size + 1 + i] = -slope[i] - other[i]
            slope[i] -= other[i]
        beyond = turning[0, 0] - turning[1, 0]
        margins[SLIPS] = over_size(order, variables, size, beyond, slope)
    press_margins(order, is_sine, variables, values[1], turning[2:], margins, slopes)
    chained(motion, values, size, slopes, by_motion, by_values)


@Loop
def _figures(waves, stiffness: float, pieces, count: int, turning, figures) -> None:
    """Shares of the period, normal forces and path of the slider of one contact."""
    for i in range(len(figures)):
        figures[i] = 0.0
    press, highest = waves[1], waves.shape[2] - 1
    of_piece = np.empty((2, highest + 1))
    mean = press[0, 0]
    for k in range(count):
        kind, begin, end = int(pieces[k, KIND]), pieces[k, BEGIN], pieces[k, END]
        share = (end - begin) / (2 * math.pi)
        if kind in (APART, LIFTED):
            figures[OPEN_SHARE] += share
            figures[STICK_SHARE] -= share if kind == LIFTED else 0.0
            fourier.moments(begin, end, of_piece)
            for h in range(highest + 1):
                integral = press[0, h] * of_piece[0, h] + press[1, h] * of_piece[1, h]
                mean -= integral / (2 * math.pi)
        elif kind >= STICK_LOW:
            figures[STICK_SHARE] += share * pieces[k, WEIGHT]
        elif stiffness > 0:
            wall = waves[2 if kind == PUSHED_UP else 3]
            travel = series.at(wall[0], wall[1], end)[0] - series.at(wall[0], wall[1], begin)[0]
            figures[SLIP_DISTANCE] += abs(travel) / stiffness
    figures[MEAN] = max(mean, 0.0)
    figures[LEAST], figures[LARGEST] = max(turning[2, 0], 0.0), max(turning[3, 0], 0.0)
