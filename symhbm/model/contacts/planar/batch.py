"""Contacts one after the other: the derivatives that their forces are made of, their margins.

Derivatives are by the variables of `symhbm.model.contacts.press`.
"""

import math

import numpy as np

from symhbm.model.contacts.planar.collocation import EXCESS, STAGES, WEIGHT
from symhbm.model.contacts.planar.march import BEGIN, END, KIND, NODE, SLIP, STICK
from symhbm.model.contacts.planar.period import (
    BEGINS,
    FEW,
    MOST,
    MOVES,
    PER_HARMONIC,
    RESTS,
    TOO_MANY,
    period,
    prepare,
)
from symhbm.model.contacts.planar.rest import resting_place, weights_of
from symhbm.model.contacts.planar.slopes import integrals, moving, rest_slopes, resting
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
from symhbm.numerics.loops import Loop, arrays, fourier

ASKED = -2
"""Of a contact whose margins alone are asked for."""


@Loop
def _slip_margin(order, variables, asked: float, slope) -> float:
    """The margin of slip, of how much its resting place is asked for.

    The gradient of that, ``slope`` (P), becomes that of the margin.
    """
    load = 2 * len(order)
    if len(slope) > load + 1:
        for j in range(len(slope)):
            slope[j] *= 2
        return over_size(order, variables, load, 2 * asked, slope)
    limit, radius = variables[load], asked + variables[load]
    margin = np.inf if limit == 0.0 else -np.inf
    for j in range(len(slope)):
        slope[j] = slope[j] / radius if limit > 0.0 and radius > 0.0 else 0.0
    if limit > 0.0 and radius > 0.0:
        slope[load] += 1 / radius - 1 / limit
        margin = math.log(radius / limit)
    return margin


@Loop
def figures_of(
    press, stiffness: float, kind: int, n_closed: int, closed, pieces, nodes, turning, figures
) -> None:
    """Write shares of the period, normal forces and the path of the slider, (6)."""
    period_length, of_piece = 2 * math.pi, np.empty(press.shape)
    figures[:] = 0.0
    figures[MEAN] = press[0, 0]
    if n_closed >= 0:
        figures[MEAN], figures[OPEN_SHARE] = 0.0, 1.0
        for i in range(n_closed):
            fourier.moments(closed[0, i], closed[1, i], of_piece)
            figures[OPEN_SHARE] -= of_piece[0, 0] / period_length
            for h in range(press.shape[1]):
                total = press[0, h] * of_piece[0, h] + press[1, h] * of_piece[1, h]
                figures[MEAN] += total / period_length
    figures[LEAST], figures[LARGEST] = max(turning[0, 0], 0.0), max(turning[1, 0], 0.0)
    if kind == RESTS:
        figures[STICK_SHARE] = 1.0
    for i in range(len(pieces)):
        if pieces[i, KIND] == STICK:
            figures[STICK_SHARE] += (pieces[i, END] - pieces[i, BEGIN]) / period_length
        elif pieces[i, KIND] == SLIP and stiffness > 0:
            first = int(pieces[i, NODE])
            for j in range(STAGES):
                own = nodes[first + j]
                figures[SLIP_DISTANCE] += own[WEIGHT] * own[EXCESS] / stiffness


@Loop
def locate(basis, motions, values, held, events, margins, by_motion, details) -> int:
    """Locate the events of contacts, see `symhbm.model.contacts.motions.EventLoop`.

    What fails is what `period` says: too many pieces, or no march ends where it began.
    ``motions`` (n, m K), coefficients of the displacements; ``values`` (n, 4): ``k_t``, ``k_n``,
    ``mu`` and ``N0``; ``held`` may be `ASKED`. ``events`` are row by row derivatives of the force
    (2 K, P) and of the normal force (K, 1 + K), and what is left of the force (2 K); ``details``
    figures (6) and derivatives of the margins by the values (q, 4).
    """
    order, is_sine, norm = basis
    size, highest = len(order), order[len(order) - 1]
    load, variable = 2 * size, motions.shape[1] == 3 * size
    n = 3 * size + 1 if variable else load + 1
    waves, press = np.empty((3, 2, highest + 1)), np.empty((2, highest + 1))
    turning, closed = np.empty((2, 2)), np.empty((2, highest + 1))
    variables = np.empty(n + 1 + size if variable else n)
    slopes = np.empty((margins.shape[1], len(variables)))
    angles, place, sides = np.empty(3), np.empty(3), np.empty((3, 8))
    place_slopes, jacobian = np.empty((3, n)), np.empty((load, n))
    at_rest, coefficients = np.empty((load, n)), np.empty(load)
    most = FEW + PER_HARMONIC * highest
    pieces, nodes = np.empty((most, 7)), np.empty((most * STAGES, 8))
    turns, edges = np.empty((most * STAGES, 2, n + 2)), np.empty((most, 2, n + 2))
    given, marched = (order, is_sine, norm, variable), (turns, edges, np.empty((2, n + 2)))
    vector, transposed = np.empty(size), np.empty((size, size))
    for j in range(len(motions)):
        n_closed = prepare(basis, motions[j], values[j], waves, press, turning, closed)
        n_active = resting_place(waves, angles, place)
        weights_of(waves, angles, n_active, place, sides)
        rest_slopes(given, angles, sides, n_active, place_slopes)
        variables_of(motions[j], values[j], load, variables)
        slopes[:] = 0.0
        margins[j, SLIPS] = np.inf
        if values[j, 2] > 0.0:
            arrays.copy(place_slopes[2], slopes[SLIPS, :n])
            margins[j, SLIPS] = _slip_margin(order, variables, place[2], slopes[SLIPS, :n])
        if variable:
            press_margins(order, is_sine, variables, values[j, 1], turning, margins[j], slopes)
        by_values = details[j, 6:].reshape((-1, 4))
        chained(motions[j], values[j], load, slopes, by_motion[j], by_values)
        if held[j] == ASKED:
            continue
        if variable:
            first = load * n
            block = events[j, first : first + size * (1 + size)].reshape((size, 1 + size))
            block[:, :] = 0.0
            if n_closed < 0:
                for i in range(size):
                    block[i, 0], block[i, 1 + i] = 1.0 if order[i] == 0 else 0.0, 1.0
            for k in range(n_closed):
                integrals(closed[0, k], closed[1, k], given, vector, transposed)
                for i in range(size):
                    block[i, 0] += vector[i]
                    for m in range(size):
                        block[i, 1 + m] += transposed[m, i]
        kind, count = period(waves, int(held[j]), n_closed, closed, place, pieces, nodes)
        while count == TOO_MANY and 4 * most < MOST:
            most *= 4
            pieces, nodes = np.empty((most, 7)), np.empty((most * STAGES, 8))
            turns, edges = np.empty((most * STAGES, 2, n + 2)), np.empty((most, 2, n + 2))
            marched = turns, edges, np.empty((2, n + 2))
            kind, count = period(waves, int(held[j]), n_closed, closed, place, pieces, nodes)
        if count < 0:
            return count
        jacobian[:], coefficients[:] = 0.0, 0.0
        moves = kind in (MOVES, BEGINS)
        if kind == RESTS:
            resting(order, place_slopes, jacobian)
        elif moves:
            opens = n_closed >= 0
            moving(waves, given, opens, pieces[:count], nodes, marched, coefficients, jacobian)
        if kind == BEGINS:  # the derivatives are those of slip, the force is still that of stick
            resting(order, place_slopes, at_rest)
            for i in range(load):
                coefficients[i] = 0.0
                for k in range(n):
                    coefficients[i] += at_rest[i, k] * variables[k]
            kind, count = RESTS, 0
        left = events[j, events.shape[1] - load :]
        for i in range(load):
            arrays.copy(jacobian[i], events[j, i * n : (i + 1) * n])
            left[i] = 0.0
            if moves:
                # Near the onset of slip the product of derivatives and variables has lost digits.
                product = 0.0
                for k in range(n):
                    product += jacobian[i, k] * variables[k]
                left[i] = coefficients[i] - product
        figures_of(
            press, values[j, 0], kind, n_closed, closed, pieces[:count], nodes, turning,
            details[j, :6],
        )  # fmt: skip
    return 0
