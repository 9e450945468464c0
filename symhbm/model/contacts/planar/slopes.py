"""Derivatives of the force's coefficients by the motion and the limit of a contact.

They are those at fixed events: the force is continuous in time, where a contact begins to stick its
slider stands still, and where it begins to slip only what is along the circle goes on. The force is
homogeneous: it is the product of these derivatives and what they are by, the coefficients of ``x``,
of ``y``, and of the limit, of which the first is a constant.
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
    LIMIT_RATE,
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
from symhbm.numerics.loops import Loop, arrays, fourier


@Loop
def functions_at(order, is_sine, angle: float, row) -> None:
    """Write the basis functions at an angle [rad] and their derivatives into (2, K)."""
    for k in range(2):
        fourier.functions_at(order, is_sine, angle, k, row[k])


@Loop
def integrals(begin: float, end: float, given, vector, transposed) -> None:
    """Write what restricts a constant (K) and, transposed, a series (K, K) to an interval [rad]."""
    order, is_sine, norm, _ = given
    moments = np.empty((2, 2 * order[len(order) - 1] + 1))
    fourier.moments(begin, end, moments)
    for i in range(len(order)):
        vector[i] = norm[i] * moments[1 if is_sine[i] else 0, order[i]]
    transposed[:] = 0.0
    fourier.add_products(moments, order, is_sine, norm, transposed)


@Loop
def add_along(row, mean: float, variable: bool, x: float, y: float, limit: float, out) -> None:
    """Add ``x dx + y dy + limit dr`` at an instant, by all variables, to ``out``.

    ``row`` (K), the functions of the basis, and ``mean`` 1; or their derivatives, and 0.
    """
    size = len(row)
    for j in range(size):
        out[j] += x * row[j]
        out[size + j] += y * row[j]
    out[2 * size] += limit * mean
    if variable:
        for j in range(size):
            out[2 * size + 1 + j] += limit * row[j]


@Loop
def rest_slopes(given, angles, sides, n: int, out) -> None:
    """Write the derivatives (3, P) of the resting place and of how much it is asked for.

    ``sides`` are those of `symhbm.model.contacts.planar.rest.weights_of`.
    """
    order, is_sine, _, variable = given
    row = np.empty((2, len(order)))
    asks, turns = np.zeros((3, out.shape[1])), np.zeros((3, out.shape[1]))
    out[:] = 0.0
    for i in range(n):
        functions_at(order, is_sine, angles[i], row)
        nx, ny, weight, across, length, bend = sides[i, :6]
        if length == 0.0:
            if not variable:
                # Without a motion all instants are the same: the mean of any that follows.
                for j in range(len(order)):
                    row[0, j] = 1.0 if order[j] == 0 else 0.0
            add_along(row[0], 1.0, variable, 1.0, 0.0, 0.0, out[0])
            add_along(row[0], 1.0, variable, 0.0, 1.0, 0.0, out[1])
            add_along(row[0], 1.0, variable, 0.0, 0.0, -1.0, out[2])
            return
        add_along(row[0], 1.0, variable, nx, ny, -1.0, asks[i])
        # By how much n turns: at the instant, and with the instant that moves.
        move = -across / (length * bend)
        along = 1.0 / length + across / length * move
        add_along(row[0], 1.0, variable, -ny * along, nx * along, 0.0, turns[i])
        add_along(row[1], 0.0, variable, nx * move, ny * move, -move, turns[i])
        for j in range(out.shape[1]):
            out[2, j] += weight * asks[i, j]
    if n == 2:
        a, b = sides[0], sides[1]
        turn_a = (a[3] * a[3] / (a[4] * a[5]) - 1) / a[4]
        turn_b = (b[3] * b[3] / (b[4] * b[5]) - 1) / b[4]
        # n_a and n_b stay opposite, and both ask for as much.
        first_x, first_y = b[0] - a[0], b[1] - a[1]
        second_x = -b[1] * turn_b + a[1] * turn_a
        second_y = b[0] * turn_b - a[0] * turn_a
        determinant = first_x * second_y - first_y * second_x
        for j in range(out.shape[1]):
            f, g = asks[1, j] - asks[0, j], turns[0, j] - turns[1, j]
            out[0, j] = (f * second_y - g * first_y) / determinant
            out[1, j] = (first_x * g - second_x * f) / determinant
    elif n == 3:
        a, b, c = sides[0], sides[1], sides[2]
        # Two differences of the three conditions.
        first_x, first_y = a[0] - b[0], a[1] - b[1]
        second_x, second_y = a[0] - c[0], a[1] - c[1]
        determinant = first_x * second_y - first_y * second_x
        for j in range(out.shape[1]):
            f, g = asks[0, j] - asks[1, j], asks[0, j] - asks[2, j]
            out[0, j] = (f * second_y - g * first_y) / determinant
            out[1, j] = (first_x * g - second_x * f) / determinant


@Loop
def resting(order, place_slopes, jacobian) -> None:
    """Write the derivatives (2 K, P) of the force of a contact that sticks all the time."""
    size = len(order)
    jacobian[:] = 0.0
    for i in range(size):
        for k in range(2):
            jacobian[k * size + i, k * size + i] = 1.0
            if order[i] == 0:
                for j in range(jacobian.shape[1]):
                    jacobian[k * size + i, j] -= place_slopes[k, j]


@Loop
def slope_of_opening(waves, given, angle: float, out) -> None:
    """Write the derivatives (P or more) of the angle at which the limit falls through zero."""
    order, is_sine, _, variable = given
    at, row = np.empty((3, 3)), np.empty((2, len(order)))
    motion_at(waves, angle, at)
    functions_at(order, is_sine, angle, row)
    out[:] = 0.0
    if at[2, 1] < 0.0:
        add_along(row[0], 1.0, variable, 0.0, 0.0, -1 / at[2, 1], out)


@Loop
def moving(waves, given, opens: bool, pieces, nodes, slopes, coefficients, jacobian) -> None:
    """Write the force's coefficients (2 K) and their derivatives (2 K, P) of one that moves.

    ``given`` are the arrays of the basis, and whether the load varies. Of ``slopes``, ``turns``
    (n_nodes, 2, P + 2) takes those of ``a`` and ``a'`` at the nodes, ``edges`` (n_pieces, 2, P + 2)
    those of ``a`` at both ends of slip and of both components of ``q`` of stick; the last two
    columns are by the position of the slider at the begin. ``starts`` (2, P + 2) takes the
    derivatives of that, and what a change of it adds up to over all periods.

    Before a contact opens ``a`` is a power of the time left, whose derivatives at a fixed angle
    grow without bound: the nodes of that step move with the angle of opening.
    """
    (order, is_sine, norm, variable), (turns, edges, starts) = given, slopes
    size, n, count = len(order), jacobian.shape[1], len(pieces)
    total = n + 2
    at, row = np.empty((3, 3)), np.empty((2, size))
    vector, transposed = np.empty(size), np.empty((size, size))
    q, a_begin, a_end = np.zeros((2, total)), np.zeros(total), np.zeros(total)
    force = np.zeros((2, total))
    system, pivots = np.empty((STAGES, STAGES)), np.empty(STAGES, np.int64)
    right = np.empty((STAGES, total))
    whole = np.zeros((2 * size, total))
    coefficients[:] = 0.0
    stretch = np.zeros(total)
    if not opens:
        q[0, n] = q[1, n + 1] = 1.0
    for i in range(count):
        piece = pieces[i]
        begin, end, how = piece[BEGIN], piece[END], piece[HOW]
        if piece[KIND] == STICK:
            if how == CLOSED:
                # The angle of closing moves by -dr / r'.
                motion_at(waves, begin, at)
                functions_at(order, is_sine, begin, row)
                rate = at[2, 1]
                for k in range(2):
                    q[k, :] = 0.0
                    share = -at[k, 1] / rate if rate > 0 else 0.0
                    add_along(row[0], 1.0, variable, 1.0 - k, float(k), share, q[k])
            integrals(begin, end, given, vector, transposed)
            for k in range(2):
                arrays.copy(q[k], edges[i, k])
                place = piece[FIRST] if k == 0 else piece[LAST]
                for j in range(size):
                    coefficients[k * size + j] -= vector[j] * place
                    for m in range(size):
                        part = waves[k, 1 if is_sine[m] else 0, order[m]]
                        coefficients[k * size + j] += transposed[m, j] * part
                        whole[k * size + j, k * size + m] += transposed[m, j]
                    for m in range(total):
                        whole[k * size + j, m] -= vector[j] * q[k, m]
        elif piece[KIND] == SLIP:
            first = int(piece[NODE])
            own = nodes[first : first + STAGES]
            length = end - begin
            if how != GOES_ON:
                motion_at(waves, begin, at)
                functions_at(order, is_sine, begin, row)
                c, s = math.cos(piece[FIRST]), math.sin(piece[FIRST])
                a_begin[:] = 0.0
                if how == CLOSED:
                    along = at[0, 1] * c + at[1, 1] * s
                    turn = 0.0
                    for j in range(STAGES):
                        turn += AT_BEGIN[j] * own[j, TURN]
                    add_along(row[1], 0.0, variable, -s / along, c / along, 0.0, a_begin)
                    add_along(row[0], 1.0, variable, 0.0, 0.0, -turn / along, a_begin)
                else:
                    limit = at[2, 0]
                    add_along(row[0], 1.0, variable, -s / limit, c / limit, 0.0, a_begin)
                    for m in range(total):
                        a_begin[m] -= (c * q[1, m] - s * q[0, m]) / limit
            following = pieces[min(i + 1, count - 1)]
            moves = following[KIND] == APART
            stretch[:] = 0.0
            if moves:
                slope_of_opening(waves, given, end, stretch)
            for j in range(STAGES):
                functions_at(order, is_sine, own[j, ANGLE], row)
                c, s = math.cos(own[j, DIRECTION]), math.sin(own[j, DIRECTION])
                shift = 0.0
                if moves:
                    motion_at(waves, own[j, ANGLE], at)
                    shift = at[1, 2] * c - at[0, 2] * s - own[j, TURN] * own[j, LIMIT_RATE]
                    shift *= NODES[j]
                    for k in range(STAGES):
                        shift -= own[j, ALONG] * BEFORE[j, k] * own[k, TURN]
                for m in range(total):
                    right[j, m] = shift * stretch[m] - own[j, ALONG] * a_begin[m]
                add_along(row[1], 0.0, variable, -s, c, 0.0, right[j])
                add_along(row[0], 1.0, variable, 0.0, 0.0, -own[j, TURN], right[j])
            step_matrix(own, length, system)
            factorise(system, pivots)
            solve_factorised(system, pivots, right)
            arrays.copy(a_begin, a_end)
            for j in range(STAGES):
                turned = turns[first + j, 0]
                arrays.copy(right[j], turns[first + j, 1])
                arrays.copy(a_begin, turned)
                for k in range(STAGES):
                    factor = length * BEFORE[j, k]
                    turn = BEFORE[j, k] * own[k, TURN]
                    for m in range(total):
                        turned[m] += factor * right[k, m] + turn * stretch[m]
                arrays.add(length * WEIGHTS[j], right[j], a_end)
                functions_at(order, is_sine, own[j, ANGLE], row)
                c, s = math.cos(own[j, DIRECTION]), math.sin(own[j, DIRECTION])
                limit = own[j, LIMIT]
                rate = own[j, LIMIT_RATE] * NODES[j]
                for m in range(total):
                    force[0, m] = rate * c * stretch[m] - limit * s * turned[m]
                    force[1, m] = rate * s * stretch[m] + limit * c * turned[m]
                add_along(row[0], 1.0, variable, 0.0, 0.0, c, force[0])
                add_along(row[0], 1.0, variable, 0.0, 0.0, s, force[1])
                for k in range(2):
                    for m in range(size):
                        factor = own[j, WEIGHT] * norm[m] * row[0, m]
                        target = whole[k * size + m]
                        value = limit * (c if k == 0 else s)
                        coefficients[k * size + m] += factor * value
                        moved = own[j, WEIGHT] * norm[m] * NODES[j] * row[1, m] + factor / length
                        for p in range(total):
                            target[p] += factor * force[k, p] + moved * value * stretch[p]
            arrays.copy(a_begin, edges[i, 0])
            arrays.copy(a_end, edges[i, 1])
            arrays.copy(a_end, a_begin)
            if i + 1 == count or following[KIND] != SLIP or following[HOW] != GOES_ON:
                motion_at(waves, end, at)
                functions_at(order, is_sine, end, row)
                c, s = math.cos(piece[LAST]), math.sin(piece[LAST])
                limit = max(at[2, 0], 0.0)
                for m in range(total):
                    q[0, m], q[1, m] = limit * s * a_end[m], -limit * c * a_end[m]
                add_along(row[0], 1.0, variable, 1.0, 0.0, -c, q[0])
                add_along(row[0], 1.0, variable, 0.0, 1.0, -s, q[1])
    for j in range(2 * size):
        arrays.copy(whole[j, :n], jacobian[j])
    starts[:] = 0.0
    if opens:
        return
    a, b, c, d = 1 - q[0, n], -q[0, n + 1], -q[1, n], 1 - q[1, n + 1]
    determinant = a * d - b * c
    for m in range(n):
        starts[0, m] = (d * q[0, m] - b * q[1, m]) / determinant
        starts[1, m] = (a * q[1, m] - c * q[0, m]) / determinant
    starts[0, n], starts[0, n + 1] = d / determinant, -b / determinant
    starts[1, n], starts[1, n + 1] = -c / determinant, a / determinant
    for j in range(2 * size):
        for m in range(n):
            jacobian[j, m] += whole[j, n] * starts[0, m] + whole[j, n + 1] * starts[1, m]
