"""Contacts one after the other: the derivatives that their forces are made of, their margins.

The *variables* of a contact, that its force is homogeneous in, are the coefficients of ``k_t u_x``
and ``k_t u_y``, then ``mu N0`` and the coefficients of ``mu k_n v``: (P). With them go ``N0`` and
the coefficients of ``k_n v``, (1 + K), that its normal force is made of. A contact of constant load
has ``mu N0`` alone.
"""

import math
from typing import Any

import numpy as np

from symhbm.model.contacts.planar.collocation import EXCESS, STAGES, WEIGHT
from symhbm.model.contacts.planar.march import BEGIN, END, KIND, NODE, SLIP, STICK
from symhbm.model.contacts.planar.period import BEGINS, MOVES, RESTS, period
from symhbm.model.contacts.planar.rest import resting_place, weights_of
from symhbm.model.contacts.planar.series import (
    bounds_of,
    closed_intervals,
    extreme_between,
    motion_at,
)
from symhbm.model.contacts.planar.slopes import (
    functions_at,
    integrals,
    moving,
    rest_slopes,
    resting,
)
from symhbm.numerics.loops import Loop, arrays

SLIPS, OPENS, TOUCHES = range(3)
"""Switches of a contact: its margins."""
ASKED = -2
"""Of a contact whose margins alone are asked for."""
STICK_SHARE, OPEN_SHARE, MEAN, LEAST, LARGEST, SLIP_DISTANCE = range(6)
"""What a contact does over a period: shares of it, normal forces [N], path of the slider [m]."""


@Loop
def series_of(order: Any, is_sine: Any, motion: Any, values: Any, waves: Any) -> None:
    """Write ``k_t u_x``, ``k_t u_y`` and ``p`` as series (3, 2, H + 1).

    A slider moves with the mean of ``u``, which no force depends on and which takes digits: it is
    left out.
    """
    size = len(order)
    waves[:] = 0.0
    for k in range(len(motion) // size):
        stiffness = values[1] if k == 2 else values[0]
        for i in range(size):
            part = 1 if is_sine[i] else 0
            if k == 2 or order[i] > 0:
                waves[k, part, order[i]] += stiffness * motion[k * size + i]
    waves[2, 0, 0] += values[3]


@Loop
def limit_of(friction: float, waves: Any, press: Any) -> None:
    """Write ``p`` (2, H + 1) out of waves, and ``mu p`` in its place."""
    for k in range(2):
        arrays.copy(waves[2, k], press[k])
        for h in range(waves.shape[2]):
            waves[2, k, h] *= friction


@Loop
def extremes(waves: Any, out: Any) -> None:
    """Write the smallest and the largest ``p`` and their angles [rad] into (2, 2)."""
    samples = 8 * waves.shape[2]
    cell = 2 * math.pi / samples
    at = np.empty((3, 3))
    out[0, 0], out[1, 0] = np.inf, -np.inf
    for i in range(samples):
        motion_at(waves, i * cell, at)
        if at[2, 0] < out[0, 0]:
            out[0, 0], out[0, 1] = at[2, 0], i * cell
        if at[2, 0] > out[1, 0]:
            out[1, 0], out[1, 1] = at[2, 0], i * cell
    for k in range(2):
        sign = 1.0 - 2.0 * k
        angle, value = extreme_between(waves, sign, out[k, 1] - cell, out[k, 1] + cell)
        if sign * value <= sign * out[k, 0]:
            out[k, 0], out[k, 1] = value, angle


@Loop
def _sizes(order: Any, variables: Any, first: int, out: Any) -> float:
    """The size of some variables from the ``first`` on, without means of motions; its gradient."""
    size, square = len(order), 0.0
    out[:] = 0.0
    mean = 0.0
    for block in range(2):
        for i in range(size):
            j = block * size + i
            if j >= first and order[i] > 0:
                square += variables[j] ** 2
                out[j] = variables[j]
    load = 2 * size
    mean = variables[load]
    for i in range(len(variables) - load - 1):
        j = load + 1 + i
        if order[i] == 0:
            mean += variables[j]
        else:
            square += variables[j] ** 2
            out[j] = variables[j]
    square += mean * mean
    out[load] = mean
    if len(variables) > load + 1 and order[0] == 0:
        out[load + 1] = mean
    scale = math.sqrt(square)
    for j in range(len(out)):
        out[j] /= scale if scale > 0 else 1.0
    return scale


@Loop
def _slip_margin(order: Any, variables: Any, asked: float, by: Any, slopes: Any) -> float:
    """The margin of slip, of how much its resting place is asked for, and its gradient (P)."""
    size, constant = len(order), len(variables) == 2 * len(order) + 1
    slopes[:] = 0.0
    if constant:
        limit = variables[2 * size]
        if limit == 0.0:
            return np.inf
        radius = asked + limit
        if radius <= 0.0:
            return -np.inf
        for j in range(len(variables)):
            slopes[j] = by[j] / radius
        slopes[2 * size] += 1 / radius - 1 / limit
        return math.log(radius / limit)
    scale = _sizes(order, variables, 0, slopes)
    if scale == 0.0:
        return -np.inf
    margin = 2 * asked / scale
    for j in range(len(variables)):
        slopes[j] = (2 * by[j] - margin * slopes[j]) / scale
    return margin


@Loop
def figures_of(
    waves: Any, stiffness: float, kind: int, n_closed: int, closed: Any, pieces: Any, count: int,
    nodes: Any, turning: Any, figures: Any,
) -> None:  # fmt: skip
    """Write shares of the period, normal forces and the path of the slider, (6)."""
    period_length = 2 * math.pi
    figures[:] = 0.0
    figures[MEAN] = waves[2, 0, 0]
    if n_closed >= 0:
        total, share = 0.0, 0.0
        for i in range(n_closed):
            begin, end = closed[0, i], closed[1, i]
            share += (end - begin) / period_length
            half, middle = 0.5 * (end - begin), 0.5 * (begin + end)
            total += waves[2, 0, 0] * (end - begin)
            for h in range(1, waves.shape[2]):
                wave = waves[2, 0, h] * math.cos(h * middle) + waves[2, 1, h] * math.sin(h * middle)
                total += wave * 2 * math.sin(h * half) / h
        figures[MEAN], figures[OPEN_SHARE] = total / period_length, 1 - share
    figures[LEAST], figures[LARGEST] = max(turning[0, 0], 0.0), max(turning[1, 0], 0.0)
    if kind == RESTS:
        figures[STICK_SHARE] = 1.0
    for i in range(count):
        if pieces[i, KIND] == STICK:
            figures[STICK_SHARE] += (pieces[i, END] - pieces[i, BEGIN]) / period_length
        elif pieces[i, KIND] == SLIP and stiffness > 0:
            first = int(pieces[i, NODE])
            for j in range(STAGES):
                own = nodes[first + j]
                figures[SLIP_DISTANCE] += own[WEIGHT] * own[EXCESS] / stiffness


@Loop
def locate(
    order: Any,
    is_sine: Any,
    norm: Any,
    motions: Any,
    values: Any,
    held: Any,
    most: int,
    events: Any,
    margins: Any,
    slopes: Any,
    figures: Any,
) -> int:
    """Locate the events of contacts: 0, or what has failed.

    As `period` says it: ``most`` pieces of one do not suffice, or no march ends where it began.

    ``motions`` (n, m K), coefficients of the displacements; ``values`` (n, 4): ``k_t``, ``k_n``,
    ``mu`` and ``N0``; ``held`` (n,): -1 where the motion decides, 0 for stick, 1 for slip, or
    `ASKED`. Written are ``events`` (n, e), row by row derivatives of the force (2 K, P) and of the
    normal force (K, 1 + K), and what is left of the force (2 K); ``margins`` (n, q) with their
    ``slopes`` (n, q, P + 1 + K), and ``figures`` (n, 6).
    """
    size, highest = len(order), int(order[len(order) - 1])
    variable = motions.shape[1] == 3 * size
    n = 3 * size + 1 if variable else 2 * size + 1
    waves, variables = np.empty((3, 2, highest + 1)), np.empty(n)
    press = np.empty((2, highest + 1))
    bounds, turning = np.empty((2, 4)), np.empty((2, 2))
    closed = np.empty((2, 2 * highest + 4))
    angles, place, sides = np.empty(3), np.empty(3), np.empty((3, 8))
    place_slopes, jacobian = np.empty((3, n)), np.empty((2 * size, n))
    at_rest, coefficients = np.empty((2 * size, n)), np.empty(2 * size)
    pieces, nodes = np.empty((most, 7)), np.empty((most * STAGES, 8))
    turns, edges = np.empty((most * STAGES, 2, n + 2)), np.empty((most, 2, n + 2))
    starts = np.empty((2, n + 2))
    vector, matrix, row = np.empty(size), np.empty((size, size)), np.empty((2, size))
    normal, by_normal = np.empty(n), np.empty(n)
    for j in range(len(motions)):
        stiffness, friction = values[j, 0], values[j, 2]
        series_of(order, is_sine, motions[j], values[j], waves)
        bounds_of(waves, bounds)
        n_closed = closed_intervals(waves, bounds, closed[0], closed[1])
        extremes(waves, turning)
        normal[:] = 0.0
        normal[2 * size] = values[j, 3]
        for i in range(size):
            for k in range(2):
                normal[k * size + i] = stiffness * motions[j, k * size + i]
            if variable:
                normal[2 * size + 1 + i] = values[j, 1] * motions[j, 2 * size + i]
        margins[j, :], slopes[j, :, :] = -np.inf, 0.0
        if variable:
            scale = _sizes(order, normal, 2 * size, by_normal)
            for k in range(2):
                sign = 2.0 * k - 1.0
                if values[j, 1] == 0.0:
                    margins[j, OPENS + k] = np.inf if (k == 1) == (values[j, 3] > 0) else -np.inf
                elif scale > 0.0:
                    margin = sign * turning[k, 0] / scale
                    margins[j, OPENS + k] = margin
                    functions_at(order, is_sine, turning[k, 1], row)
                    target = slopes[j, OPENS + k, n:]
                    target[0] = (sign - margin * by_normal[2 * size]) / scale
                    for i in range(size):
                        by = by_normal[2 * size + 1 + i]
                        target[1 + i] = (sign * row[0, i] - margin * by) / scale
            first = 2 * size * n
            block = events[j, first : first + size * (1 + size)].reshape((size, 1 + size))
            block[:, :] = 0.0
            if n_closed < 0:
                for i in range(size):
                    block[i, 0], block[i, 1 + i] = 1.0 if order[i] == 0 else 0.0, 1.0
            for k in range(n_closed):
                integrals(closed[0, k], closed[1, k], order, is_sine, norm, vector, matrix)
                for i in range(size):
                    block[i, 0] += vector[i]
                    for m in range(size):
                        block[i, 1 + m] += matrix[i, m]
        for i in range(n):
            variables[i] = normal[i] * (friction if i >= 2 * size else 1.0)
        limit_of(friction, waves, press)
        n_active = resting_place(waves, angles, place)
        weights_of(waves, angles, n_active, place, sides)
        rest_slopes(order, is_sine, variable, angles, sides, n_active, place_slopes)
        margin = np.inf
        if friction > 0.0:
            margin = _slip_margin(order, variables, place[2], place_slopes[2], slopes[j, SLIPS, :n])
        margins[j, SLIPS] = margin
        if held[j] == ASKED:
            continue
        kind, count = period(waves, held[j], n_closed, closed, place, pieces, nodes)
        if count < 0:
            return count
        jacobian[:], coefficients[:] = 0.0, 0.0
        moves = kind in (MOVES, BEGINS)
        if kind == RESTS:
            resting(order, place_slopes, jacobian)
        elif moves:
            opens = n_closed >= 0
            moving(
                waves, order, is_sine, norm, variable, opens, pieces, count, nodes, coefficients,
                jacobian, turns, edges, starts,
            )  # fmt: skip
        if kind == BEGINS:  # the derivatives are those of slip, the force is still that of stick
            resting(order, place_slopes, at_rest)
            for i in range(2 * size):
                coefficients[i] = 0.0
                for k in range(n):
                    coefficients[i] += at_rest[i, k] * variables[k]
            kind, count = RESTS, 0
        left = events[j, events.shape[1] - 2 * size :]
        for i in range(2 * size):
            arrays.copy(jacobian[i], events[j, i * n : (i + 1) * n])
            left[i] = 0.0
            if moves:
                # Near the onset of slip the product of derivatives and variables has lost digits.
                product = 0.0
                for k in range(n):
                    product += jacobian[i, k] * variables[k]
                left[i] = coefficients[i] - product
        for k in range(2):
            arrays.copy(press[k], waves[2, k])
        figures_of(
            waves, stiffness, kind, n_closed, closed, pieces, count, nodes, turning, figures[j]
        )
    return 0
