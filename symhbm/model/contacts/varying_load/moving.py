"""The events of contacts under varying loads that move with motion and values.

Where pieces meet, the slopes of the forces may jump; and what a piece that sticks remembers is a
value of an event.
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
    STICK_CLOSED,
    STICK_HIGH,
    STICK_LOW,
    WEIGHT,
)
from symhbm.numerics.loops import Loop, fourier

_LOAD = 0.0, 1.0, 0.0
"""The normal load among the combinations of `_gradient`."""


@Loop
def moving_events(basis, motions, values, pieces, counts, contacts, gradient, jump, share) -> int:
    """Write the parts of `Events`, by ``motions`` (n, 2 K) and ``values`` (n, 4); their number.

    ``pieces`` (n, most, 6) and ``counts`` (n,) are those located.
    """
    order, is_sine, norm = basis
    count, other = 0, np.empty(gradient.shape[1])
    of_piece = np.empty((2, 2 * int(order[len(order) - 1]) + 1))
    for j in range(len(motions)):
        of_contact = basis, motions[j], values[j]
        for k in range(counts[j]):
            piece, before = pieces[j, k], pieces[j, k - 1 if k else counts[j] - 1]
            kind, left, begin = int(piece[KIND]), int(before[KIND]), piece[BEGIN]
            if kind == LIFTED:
                # While stick is imposed the normal force alone is none.
                for sign in (1.0, -1.0):
                    slope, angle = jump[count, 1], begin if sign > 0 else piece[END]
                    rate = _gradient(of_contact, angle, _LOAD, 0, slope)
                    _zero(rate, slope, gradient[count])
                    slope *= sign
                    _at(basis, angle, share[count])
                    contacts[count], count = j, count + 1
                continue
            if kind >= STICK_LOW:
                # The place of the slider is the turning point of a wall, or where it closed.
                slope, moves, anchor = jump[count, 0], gradient[count], piece[ANCHOR]
                bend = _gradient(of_contact, anchor, _place(piece, values[j]), 1, slope)
                _zero(bend, slope, moves)
                if kind == STICK_CLOSED:
                    rate = _gradient(of_contact, anchor, _LOAD, 0, other)
                    _zero(rate, other, moves)
                    for a in range(len(other)):
                        slope[a] = 2 * slope[a] + bend * moves[a]
                slope *= -1.0
                fourier.moments(begin, piece[END], of_piece)
                for i in range(len(order)):
                    moment = of_piece[1 if is_sine[i] else 0, int(order[i])]
                    share[count, i] = piece[WEIGHT] * norm[i] * moment
                contacts[count], count = j, count + 1
            if left in (kind, LIFTED) or piece[WEIGHT] != 1.0:
                continue
            slope, moves = jump[count], gradient[count]
            if APART in (left, kind):
                # Both forces are zero on one side.
                sign, closed = (1.0, before) if kind == APART else (-1.0, piece)
                _, press, side = _place(closed, values[j])
                rate = _gradient(of_contact, begin, _LOAD, 0, slope[1])
                _zero(rate, slope[1], moves)
                _gradient(of_contact, begin, (0.0, -press, -side), 0, slope[0])
                slope *= sign
            elif left >= STICK_LOW and kind < STICK_LOW:
                # A wall reaches the slider.
                rate = _gradient(of_contact, begin, _place(piece, values[j]), 0, slope[0])
                _gradient(of_contact, before[ANCHOR], _place(before, values[j]), 0, other)
                for a in range(len(other)):
                    slope[0, a] -= other[a]
                _zero(rate, slope[0], moves)
                if values[j, 2] == 0.0:
                    # It does where it turns: all that friction adds to both derivatives.
                    rate = _gradient(of_contact, begin, (1.0, 0.0, 0.0), 1, other)
                    _zero(rate, other, moves)
                    slope[0] *= 2.0
            else:
                continue
            _at(basis, begin, share[count])
            contacts[count], count = j, count + 1
    return count


@Loop
def _place(piece, values) -> Any:
    """The place of the slider of a piece as a combination, see `_gradient`."""
    kind, side, closed = int(piece[KIND]), 0.0, 0.0
    if kind in (PUSHED_UP, STICK_LOW):
        side = -1.0
    elif kind in (PUSHED_DOWN, STICK_HIGH):
        side = 1.0
    elif kind == STICK_CLOSED:
        closed = piece[SHARE]
    return 1.0, side * values[2] + closed, side


@Loop
def _gradient(of_contact, angle: float, combination, derivative: int, row) -> float:
    """Write the gradient of a derivative of ``pull k_t u + press p`` by the angle; give the next.

    The ``combination``: ``pull``, ``press``, and the derivative of ``press`` by ``mu``.
    """
    (order, is_sine, _), motion, values = of_contact
    pull, press, side = combination
    size, constant = len(order), 1.0 if derivative == 0 else 0.0
    functions, following = np.empty(size), np.empty(size)
    fourier.functions_at(order, is_sine, angle, derivative, functions)
    fourier.functions_at(order, is_sine, angle, derivative + 1, following)
    u, v, rate = 0.0, 0.0, 0.0
    for i in range(size):
        by_u, by_v = pull * values[0], press * values[1]
        u, v = u + functions[i] * motion[i], v + functions[i] * motion[size + i]
        row[i], row[size + i] = by_u * functions[i], by_v * functions[i]
        rate += following[i] * (by_u * motion[i] + by_v * motion[size + i])
    row[2 * size], row[2 * size + 1] = pull * u, press * v
    row[2 * size + 2] = side * (constant * values[3] + values[1] * v)
    row[2 * size + 3] = constant * press
    return rate


@Loop
def _zero(rate: float, of_value, of_angle) -> None:
    """Write the gradient of the angle of a zero, of those of the value and its rate."""
    for a in range(len(of_value)):
        of_angle[a] = -of_value[a] / rate if rate != 0.0 else 0.0


@Loop
def _at(basis, angle: float, share) -> None:
    """Write the share of a jump at an instant."""
    order, is_sine, norm = basis
    fourier.functions_at(order, is_sine, angle, 0, share)
    for i in range(len(order)):
        share[i] *= norm[i]
