"""What the motion of events adds to second derivatives of the forces.

At fixed events the forces are bilinear in motion and values, and CasADi differentiates them. An
event moves with the motion: where pieces meet whose variations differ, the boundary between them
moves; and what a piece that sticks remembers is a value at an event. Each adds a product of two
gradients, because first derivatives at fixed events are exact.
"""

from typing import Any

import numpy as np

from symhbm.model.contacts.varying_load.batch import value_of, wall_slope
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
from symhbm.numerics.loops import Loop, fourier


@Loop
def moving_events(
    order: Any,
    is_sine: Any,
    norm: Any,
    motions: Any,
    values: Any,
    pieces: Any,
    counts: Any,
    weights: Any,
    result: Any,
) -> None:
    """Add to ``result`` (n, 2 K + 4, 2 K + 4) the second derivatives of weighted forces.

    By ``motions`` (n, 2 K) and ``values`` (n, 4); ``weights`` (n, 2 K) are those of the forces'
    coefficients, ``pieces`` (n, most, 6) and ``counts`` (n,) as located.
    """
    size = len(order)
    n = 2 * size + 4
    functions, other, value = np.empty(size), np.empty(n), np.empty(n)
    of_piece = np.empty((2, 2 * int(order[size - 1]) + 1))
    for j in range(len(motions)):
        motion, friction = motions[j], values[j, 2]
        for k in range(counts[j]):
            piece = pieces[j, k]
            kind, begin = int(piece[KIND]), piece[BEGIN]
            if kind >= STICK_LOW and kind != LIFTED:
                fourier.moments(begin, piece[END], of_piece)
                total = 0.0
                for i in range(size):
                    moment = of_piece[1 if is_sine[i] else 0, int(order[i])]
                    total += weights[j, i] * norm[i] * moment
                _remembered(order, is_sine, motion, values[j], piece, total, result[j])
            if kind == LIFTED:
                for angle in (begin, piece[END]):
                    fourier.functions_at(order, is_sine, angle, 0, functions)
                    wall_slope(motion, values[j], functions, 0.0, 1.0, value)
                    weight = _weight(functions, norm, weights[j], size)
                    rate = _rate(order, is_sine, motion, values[j], angle, 0.0, 1.0)
                    _add(result[j], weight / abs(rate), value)
            before = pieces[j, k - 1 if k else counts[j] - 1]
            left = int(before[KIND])
            if left in (kind, LIFTED) or kind == LIFTED or piece[WEIGHT] != 1.0:
                continue
            fourier.functions_at(order, is_sine, begin, 0, functions)
            push = _weight(functions, norm, weights[j], 0)
            if left == APART or kind == APART:
                wall_slope(motion, values[j], functions, 0.0, 1.0, value)
                rate = _rate(order, is_sine, motion, values[j], begin, 0.0, 1.0)
                # Variations of q on both sides differ by this share of that of p.
                other_kind = kind if left == APART else left
                share = -piece[SHARE] if other_kind == STICK_CLOSED and left == APART else 0.0
                if other_kind == PUSHED_UP:
                    share = friction
                elif other_kind == PUSHED_DOWN:
                    share = -friction
                if rate != 0.0:
                    press = _weight(functions, norm, weights[j], size)
                    _add(result[j], (share * push) / rate * (1.0 if left == APART else -1.0), value)
                    _add(result[j], press / abs(rate), value)
            elif left >= STICK_LOW and kind < STICK_LOW:
                sign = -friction if kind == PUSHED_UP else friction
                _wall(order, is_sine, motion, values[j], begin, sign, functions, value)
                _memory(order, is_sine, motion, values[j], before, functions, other)
                rate = _rate(order, is_sine, motion, values[j], begin, 1.0, sign)
                if rate != 0.0:
                    _add(result[j], -push / rate, other - value)


@Loop
def _weight(functions: Any, norm: Any, weights: Any, first: int) -> float:
    """Weight of a force at one instant."""
    total = 0.0
    for i in range(len(functions)):
        total += weights[first + i] * norm[i] * functions[i]
    return total


@Loop
def _add(result: Any, factor: float, vector: Any) -> None:
    for a in range(len(vector)):
        for b in range(len(vector)):
            result[a, b] += factor * vector[a] * vector[b]


@Loop
def _wall(
    order: Any,
    is_sine: Any,
    motion: Any,
    values: Any,
    angle: float,
    press: float,
    functions: Any,
    slope: Any,
    derivative: int = 0,
) -> None:
    """Gradient of ``k_t u + press p``, or of a derivative of it, where ``press`` is -mu or mu."""
    size = len(order)
    fourier.functions_at(order, is_sine, angle, derivative, functions)
    wall_slope(motion, values, functions, 1.0, press, slope)
    load = values[3] if derivative == 0 else 0.0
    value = value_of(functions, motion, size, values[1], load)
    slope[2 * size + 2] = value if press > 0 else -value
    if derivative:
        slope[2 * size + 3] = 0.0


@Loop
def _memory(
    order: Any, is_sine: Any, motion: Any, values: Any, piece: Any, functions: Any, slope: Any
) -> None:
    """Gradient of ``q`` of a piece that sticks."""
    size, kind = len(order), int(piece[KIND])
    if kind == STICK_CLOSED:
        fourier.functions_at(order, is_sine, piece[ANCHOR], 0, functions)
        wall_slope(motion, values, functions, 1.0, piece[SHARE], slope)
        return
    press = -values[2] if kind == STICK_LOW else values[2]
    _wall(order, is_sine, motion, values, piece[ANCHOR], press, functions, slope)
    if values[2] == 0.0:
        value = value_of(functions, motion, size, values[1], values[3])
        slope[2 * size + 2] = -value if kind == STICK_LOW else value


@Loop
def _rate(
    order: Any, is_sine: Any, motion: Any, values: Any, angle: float, pull: float, press: float
) -> float:
    """Derivative of ``pull k_t u + press p`` by the angle."""
    return _turning(order, is_sine, motion, values, angle, pull, press, 1)


@Loop
def _turning(
    order: Any,
    is_sine: Any,
    motion: Any,
    values: Any,
    angle: float,
    pull: float,
    press: float,
    derivative: int,
) -> float:
    """A derivative of ``pull k_t u + press p`` by the angle."""
    size = len(order)
    functions, total = np.empty(size), 0.0
    fourier.functions_at(order, is_sine, angle, derivative, functions)
    for i in range(size):
        total += pull * values[0] * motion[i] * functions[i]
        total += press * values[1] * motion[size + i] * functions[i]
    return total


@Loop
def _remembered(
    order: Any, is_sine: Any, motion: Any, values: Any, piece: Any, weight: float, result: Any
) -> None:
    """Add what the motion of the event does whose ``q`` a piece remembers.

    There ``q = R(angle)``, stationary in the angle: ``R`` is a wall at its turning point, or
    ``k_t u + alpha p`` where the contact closes. ``weight`` is the integral of weights over it.
    """
    size, kind, angle = len(order), int(piece[KIND]), piece[ANCHOR]
    functions, slope = np.empty(size), np.empty(2 * size + 4)
    weight = weight * piece[WEIGHT]
    if kind != STICK_CLOSED:
        press = -values[2] if kind == STICK_LOW else values[2]
        _wall(order, is_sine, motion, values, angle, press, functions, slope, 1)
        bend = _turning(order, is_sine, motion, values, angle, 1.0, press, 2)
        if bend != 0.0:
            _add(result, weight / bend, slope)
        return
    rate = _rate(order, is_sine, motion, values, angle, 0.0, 1.0)
    if rate == 0.0:
        return
    shift, share = np.empty(2 * size + 4), piece[SHARE]
    fourier.functions_at(order, is_sine, angle, 0, functions)
    wall_slope(motion, values, functions, 0.0, -1.0 / rate, shift)
    fourier.functions_at(order, is_sine, angle, 1, functions)
    wall_slope(motion, values, functions, 1.0, share, slope)
    slope[2 * size + 3] = 0.0
    bend = _turning(order, is_sine, motion, values, angle, 1.0, share, 2)
    for a in range(2 * size + 4):
        for b in range(2 * size + 4):
            moved = slope[a] * shift[b] + shift[a] * slope[b] + bend * shift[a] * shift[b]
            result[a, b] -= weight * moved
