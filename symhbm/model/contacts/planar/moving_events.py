"""What the motion of events and of the slider adds to second derivatives of the force.

First derivatives at fixed events are exact. Their own derivative is the second variation of the
force within each piece, and a product of two gradients wherever pieces meet whose variations
differ. While a contact slips the second variation of ``a`` obeys the linear equation of the first,

    r d2a' + (x' . n) d2a = -2 dr da' - 2 (dx' . n) da - (x' . n_perp) da^2,

and what it does to a weighted force is a sum over the nodes: multipliers, marched backwards
through slip and stick, weigh its right-hand side. Those of the slider's position are periodic.
"""

import math

import numpy as np

from symhbm.model.contacts.planar.collocation import (
    ALONG,
    ANGLE,
    AT_BEGIN,
    BEFORE,
    DIRECTION,
    LIMIT,
    NODES,
    STAGES,
    TURN,
    WEIGHT,
    WEIGHTS,
    factorise,
    motion_at,
    solve_factorised,
    step_matrix,
)
from symhbm.model.contacts.planar.march import (
    APART,
    BEGIN,
    CLOSED,
    END,
    FIRST,
    GOES_ON,
    HOW,
    KIND,
    LAST,
    NODE,
    SLIP,
    STICK,
)
from symhbm.model.contacts.planar.period import MOVES, period, prepare
from symhbm.model.contacts.planar.rest import resting_place
from symhbm.model.contacts.planar.slopes import (
    add_along,
    functions_at,
    integrals,
    moving,
    slope_of_opening,
)
from symhbm.numerics.loops import Loop, arrays, fourier, series


@Loop
def _add(factor: float, first, second, result) -> None:
    """Add the symmetric matrix of ``factor * first * second`` to ``result`` (P, P)."""
    half = 0.5 * factor
    for i in range(len(result)):
        for j in range(len(result)):
            result[i, j] += half * (first[i] * second[j] + second[i] * first[j])


@Loop
def weights_at(norm, row, weights, first: int) -> float:
    """Weight of a force at one instant; ``row`` (K), the functions of the basis."""
    total = 0.0
    for i in range(len(row)):
        total += weights[first + i] * norm[i] * row[i]
    return total


@Loop
def _opening(closed, n_closed: int, press, basis, weights, result) -> None:
    """Add those of the normal force: zeros of ``p`` move; ``result`` (1 + K, 1 + K)."""
    order, is_sine, norm = basis
    own = np.ones(1 + len(order))
    for i in range(n_closed):
        if closed[1, i] >= closed[0, i] + 2 * math.pi:
            continue
        for k in range(2):
            rate = abs(series.at(press[0], press[1], closed[k, i])[1])
            fourier.functions_at(order, is_sine, closed[k, i], 0, own[1:])
            if rate > 0.0:
                push = weights_at(norm, own[1:], weights, 2 * len(order))
                _add(push / rate, own, own, result)


@Loop
def _at_periodic_position(pieces, slopes) -> None:
    """Add to slopes what the position at the begin does, as it moves to stay periodic.

    They are those (P + 2) of `symhbm.model.contacts.planar.slopes.moving`.
    """
    turns, edges, starts = slopes
    for i in range(len(pieces)):
        for k in range(2):
            _at_start(starts, edges[i, k])
        if pieces[i, KIND] == SLIP:
            first = int(pieces[i, NODE])
            for j in range(first, first + STAGES):
                for k in range(2):
                    _at_start(starts, turns[j, k])


@Loop
def _at_start(starts, slope) -> None:
    n = len(slope) - 2
    for m in range(n):
        slope[m] += slope[n] * starts[0, m] + slope[n + 1] * starts[1, m]


@Loop
def _of_stretch(
    waves, given, own, length: float, j: int, at, row, share: float, turns, stretch, limit_slope,
    weights, out,
) -> None:  # fmt: skip
    """Write what goes with ``stretch`` at a node (P); ``at`` and ``row`` are those of its angle."""
    order, is_sine, norm, variable = given
    size, limit, weight = len(order), own[j, LIMIT], own[j, WEIGHT]
    c, s, node = math.cos(own[j, DIRECTION]), math.sin(own[j, DIRECTION]), NODES[j]
    bent, third = np.empty(size), np.zeros(2)
    for m in range(size):
        square = float(order[m] * order[m])
        bent[m] = -square * row[0, m]
        for k in range(2):
            third[k] -= waves[k, 1 if is_sine[m] else 0, order[m]] * square * row[1, m]
    x0, x1 = weights_at(norm, row[0], weights, 0), weights_at(norm, row[1], weights, 0)
    y0, y1 = weights_at(norm, row[0], weights, size), weights_at(norm, row[1], weights, size)
    x2, y2 = weights_at(norm, bent, weights, 0), weights_at(norm, bent, weights, size)
    push, across = weight * (x0 * c + y0 * s), weight * (y0 * c - x0 * s)
    push_rate, across_rate = weight * (x1 * c + y1 * s), weight * (y1 * c - x1 * s)
    straight = share * (third[1] * c - third[0] * s) + (push - share * own[j, TURN]) * at[2, 2]
    straight = node * node * (straight + weight * (x2 * c + y2 * s) * limit)
    straight += 2 * node * push_rate * limit / length
    by_limit = 2 * push / length + 2 * node * push_rate
    by_turn = limit * (2 * across / length + 2 * node * across_rate)
    by_rates = 2 * (limit * across - share * own[j, ALONG])
    for m in range(len(out)):
        total = straight * stretch[m] + by_limit * limit_slope[m] + by_turn * turns[j, 0, m]
        for k in range(STAGES):
            total += by_rates * BEFORE[j, k] * turns[k, 1, m]
        out[m] = total
    pull = 2 * node * share
    add_along(bent, 0.0, variable, -s * pull, c * pull, 0.0, out)
    pull = 2 * node * (push - share * own[j, TURN])
    add_along(row[1], 0.0, variable, 0.0, 0.0, pull, out)


@Loop
def _backwards(waves, given, pieces, nodes, slopes, weights, after, adds: bool, result) -> None:
    """March the multipliers of the slider's position ``after`` (2) backwards through pieces.

    Where it ``adds``, add the second derivatives (P, P) of the force to a result, by ``weights``
    (2 K) of its coefficients; ``given`` and ``slopes`` are those of
    `symhbm.model.contacts.planar.slopes.moving`, at the periodic position.
    """
    (order, is_sine, norm, variable), (turns, edges, _) = given, slopes
    size, n, count = len(order), len(result), len(pieces)
    at, row = np.empty((3, 3)), np.empty((2, size))
    vector, matrix = np.empty(size), np.empty((size, size))
    u, v = np.empty(n), np.empty(n)
    system, transposed = np.empty((STAGES, STAGES)), np.empty((STAGES, STAGES))
    pivots, shares = np.empty(STAGES, np.int64), np.empty((STAGES, 1))
    push, across = np.empty(STAGES), np.empty(STAGES)
    stretch, back = np.zeros(n), 0.0
    for i in range(count - 1, -1, -1):
        piece = pieces[i]
        begin, end, how = piece[BEGIN], piece[END], piece[HOW]
        last = i + 1 == count
        if piece[KIND] == STICK:
            integrals(begin, end, given, vector, matrix)
            for k in range(2):
                for m in range(size):
                    after[k] -= weights[k * size + m] * vector[m]
            if how == CLOSED:
                if adds:
                    motion_at(waves, begin, at)
                    functions_at(order, is_sine, begin, row)
                    rate = at[2, 1]
                    if rate > 0:
                        # The angle of closing, and by how much q is x there.
                        u[:], v[:] = 0.0, 0.0
                        add_along(row[0], 1.0, variable, 0.0, 0.0, -1 / rate, u)
                        pull = after[0] * at[0, 1] + after[1] * at[1, 1]
                        bend = after[0] * at[0, 2] + after[1] * at[1, 2] - pull * at[2, 2] / rate
                        for k in range(2):
                            bend += weights_at(norm, row[0], weights, k * size) * at[k, 1]
                        limit = -pull / rate
                        add_along(row[1], 0.0, variable, after[0], after[1], limit, v)
                        _add(2.0, u, v, result)
                        _add(bend, u, u, result)
                after[:] = 0.0
            continue
        if piece[KIND] == APART:
            after[:] = 0.0
            continue
        following = pieces[min(i + 1, count - 1)]
        if last or following[KIND] != SLIP or following[HOW] != GOES_ON:
            motion_at(waves, end, at)
            functions_at(order, is_sine, end, row)
            c, s = math.cos(piece[LAST]), math.sin(piece[LAST])
            limit = max(at[2, 0], 0.0)
            along, sideways = after[0] * c + after[1] * s, after[1] * c - after[0] * s
            back = -limit * sideways
            if adds:
                turned = edges[i, 1, :n]
                u[:] = 0.0
                add_along(row[0], 1.0, variable, 0.0, 0.0, 1.0, u)
                _add(-2 * sideways, u, turned, result)
                _add(along * limit, turned, turned, result)
                if not last and following[KIND] == STICK and limit > 0.0:
                    # Where nothing pushes any more: x' . n = r'.
                    sidestep = at[1, 1] * c - at[0, 1] * s
                    bend = at[0, 2] * c + at[1, 2] * s - at[2, 2] + sidestep * sidestep / limit
                    v[:] = 0.0
                    arrays.add(sidestep, turned, v)
                    add_along(row[1], 0.0, variable, c, s, -1.0, v)
                    if bend < 0.0:
                        _add(-along / bend, v, v, result)
            after[:] = 0.0
        first = int(piece[NODE])
        own = nodes[first : first + STAGES]
        length = end - begin
        moves = adds and not last and following[KIND] == APART
        if moves:
            slope_of_opening(waves, given, end, stretch)
        for j in range(STAGES):
            functions_at(order, is_sine, own[j, ANGLE], row)
            c, s = math.cos(own[j, DIRECTION]), math.sin(own[j, DIRECTION])
            x = own[j, WEIGHT] * weights_at(norm, row[0], weights, 0)
            y = own[j, WEIGHT] * weights_at(norm, row[0], weights, size)
            push[j], across[j] = x * c + y * s, y * c - x * s
        step_matrix(own, length, system)
        for j in range(STAGES):
            shares[j, 0] = back * length * WEIGHTS[j]
            for k in range(STAGES):
                shares[j, 0] += own[k, LIMIT] * across[k] * length * BEFORE[k, j]
                transposed[j, k] = system[k, j]
        factorise(transposed, pivots)
        solve_factorised(transposed, pivots, shares)
        for j in range(STAGES):
            limit, share = own[j, LIMIT], shares[j, 0]
            back += limit * across[j] - share * own[j, ALONG]
            if not adds:
                continue
            functions_at(order, is_sine, own[j, ANGLE], row)
            c, s = math.cos(own[j, DIRECTION]), math.sin(own[j, DIRECTION])
            turned, rates = turns[first + j, 0, :n], turns[first + j, 1, :n]
            u[:] = 0.0
            add_along(row[0], 1.0, variable, 0.0, 0.0, 1.0, u)
            x, y = 0.0, 0.0
            if moves:
                motion_at(waves, own[j, ANGLE], at)
                arrays.add(at[2, 1] * NODES[j], stretch, u)
                x, y = NODES[j] * at[0, 2], NODES[j] * at[1, 2]
            _add(-2 * share, u, rates, result)
            factor = -limit * (share * own[j, TURN] + push[j])
            for m in range(n):
                v[m] = factor * turned[m] + 2 * across[j] * u[m]
            add_along(row[1], 0.0, variable, -2 * share * c, -2 * share * s, 0.0, v)
            if moves:
                arrays.add(-2 * share * (x * c + y * s), stretch, v)
            _add(1.0, v, turned, result)
            if moves:
                near = turns[first : first + STAGES]
                _of_stretch(
                    waves, given, own, length, j, at, row, share, near, stretch, u, weights, v
                )
                _add(1.0, v, stretch, result)
        if how == GOES_ON:
            continue
        motion_at(waves, begin, at)
        functions_at(order, is_sine, begin, row)
        c, s = math.cos(piece[FIRST]), math.sin(piece[FIRST])
        pulls = c * weights_at(norm, row[0], weights, 0)
        pulls += s * weights_at(norm, row[0], weights, size)
        along = at[0, 1] * c + at[1, 1] * s
        limit, turned = at[2, 0], edges[i, 0, :n]
        u[:] = 0.0
        add_along(row[0], 1.0, variable, 0.0, 0.0, 1.0, u)
        if how == CLOSED:
            if adds:
                v[:] = 0.0
                for j in range(STAGES):
                    arrays.add(AT_BEGIN[j], turns[first + j, 1, :n], v)
                _add(-2 * back / along, u, v, result)
                v[:] = 0.0
                add_along(row[1], 0.0, variable, c, s, 0.0, v)
                _add(-2 * back / along, v, turned, result)
                if at[2, 1] > 0.0:
                    _add(pulls / at[2, 1], u, u, result)
        else:
            after[0], after[1] = back * s / limit, -back * c / limit
            if adds:
                _add(-2 * back / limit, u, turned, result)
                if i > 0 and pieces[i - 1, KIND] == STICK:
                    # How fast the force leaves the circle, and how far it is from it.
                    rate = along - at[2, 1]
                    held = edges[i - 1]
                    for m in range(n):
                        v[m] = -c * held[0, m] - s * held[1, m]
                    add_along(row[0], 1.0, variable, c, s, -1.0, v)
                    _add(-2 * back / limit, v, turned, result)
                    if rate > 0.0:
                        sidestep = (at[1, 1] * c - at[0, 1] * s) / limit
                        _add((back * sidestep / limit - pulls) / rate, v, v, result)
        back = 0.0


@Loop
def bends_of(basis, motions, values, held, most: int, weights, bends) -> int:
    """Write the second derivatives of weighted forces: 0, or what has failed.

    Arguments and result as of `symhbm.model.contacts.planar.batch.locate`. ``weights`` (n, m K);
    ``bends`` (n, P + 1 + K, P + 1 + K) takes what events and sliders add as they move, without
    resting places.
    """
    order, is_sine, norm = basis
    size, highest = len(order), order[len(order) - 1]
    variable = motions.shape[1] == 3 * size
    n = 3 * size + 1 if variable else 2 * size + 1
    waves, press = np.empty((3, 2, highest + 1)), np.empty((2, highest + 1))
    turning, closed = np.empty((2, 2)), np.empty((2, highest + 1))
    angles, place = np.empty(3), np.empty(3)
    jacobian, coefficients = np.empty((2 * size, n)), np.empty(2 * size)
    pieces, nodes = np.empty((most, 7)), np.empty((most * STAGES, 8))
    turns, edges = np.empty((most * STAGES, 2, n + 2)), np.empty((most, 2, n + 2))
    starts, after = np.empty((2, n + 2)), np.empty(2)
    given, slopes = (order, is_sine, norm, variable), (turns, edges, starts)
    bends[:] = 0.0
    for j in range(len(motions)):
        n_closed = prepare(basis, motions[j], values[j], waves, press, turning, closed)
        resting_place(waves, angles, place)
        kind, count = period(waves, held[j], n_closed, closed, place, pieces, nodes)
        if count < 0:
            return count
        own, opens = pieces[:count], n_closed >= 0
        if kind == MOVES:
            moving(waves, given, opens, own, nodes, slopes, coefficients, jacobian)
            result, after[:] = bends[j, :n, :n], 0.0
            if not opens:
                _at_periodic_position(own, slopes)
                _backwards(waves, given, own, nodes, slopes, weights[j], after, False, result)
                x, y = after[0], after[1]
                for k in range(2):
                    after[k] = starts[0, n + k] * x + starts[1, n + k] * y
            _backwards(waves, given, own, nodes, slopes, weights[j], after, True, result)
        if variable:
            _opening(closed, n_closed, press, basis, weights[j], bends[j, n:, n:])
    return 0
