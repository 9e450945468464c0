"""Motion and limit of one contact, and a step of slip: where the force points, by collocation.

While a contact slips its force is ``r n``, ``n = (cos a, sin a)``, and

    r a' = x' . n_perp,        n_perp = (-sin a, cos a).

The angle ``a`` is a polynomial on the step that fulfils this at Gauss nodes; its end and the
integrals of the force are of twice their order. Written with ``r`` on the left the equation is
regular where the contact closes or opens, ``r = 0``.

``waves`` (3, 2, H + 1) holds the coefficients of ``cos(h tau)`` and ``sin(h tau)`` for all ``h``
from 0 to the highest harmonic: of ``x = k_t u_x`` and ``y = k_t u_y`` [N], and of the limit
``r = mu p`` [N], where ``p`` is the normal load.
"""

import math
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from symhbm.numerics.loops import Loop

ROUND_OFF = 2.2e-16
LAST_STEP = 1e-10
"""Last step [rad] of Newton's method: what is left is about its square."""
STAGES = 8
"""Gauss nodes of a step."""
ANGLE, WEIGHT, DIRECTION, TURN, LIMIT, ALONG, EXCESS, LIMIT_RATE = range(8)
"""Columns of a node.

Its angle in the period [rad] and its weight in integrals [rad], ``a`` and ``a'``, ``r``,
``x' . n``, ``x' . n - r'``, by which the slider moves, and ``r'``.
"""
_ITERATIONS = 12


def _tables() -> tuple[np.ndarray, ...]:
    nodes, weights = legendre.leggauss(STAGES)
    degrees = np.arange(STAGES)
    at_nodes = legendre.legvander(nodes, STAGES)
    # Values at the nodes to coefficients of Legendre polynomials, and those to values before.
    to_series = (degrees[:, None] + 0.5) * (at_nodes[:, :-1] * weights[:, None]).T
    integrals = [legendre.legval(nodes, legendre.legint(e, lbnd=-1)) for e in np.eye(STAGES)]
    return (nodes + 1) / 2, weights / 2, np.transpose(integrals) @ to_series / 2, to_series


NODES, WEIGHTS, BEFORE, TO_SERIES = _tables()
"""Nodes and weights on [0, 1], the matrix of integrals from 0 to each node, and that to series."""
AT_BEGIN = (-1.0) ** np.arange(STAGES) @ TO_SERIES
"""Value at the begin of a step of the polynomial through values at its nodes."""


@Loop
def motion_at(waves, angle: float, out) -> None:
    """Write values and two derivatives of ``x``, ``y`` and ``r`` at an angle [rad] into (3, 3)."""
    turn_cosine, turn_sine = math.cos(angle), math.sin(angle)
    for k in range(3):
        c, s = 1.0, 0.0
        value, first, second = 0.0, 0.0, 0.0
        for h in range(waves.shape[2]):
            a, b = waves[k, 0, h], waves[k, 1, h]
            wave = a * c + b * s
            value += wave
            first += h * (b * c - a * s)
            second -= h * h * wave
            c, s = c * turn_cosine - s * turn_sine, s * turn_cosine + c * turn_sine
        out[k, 0], out[k, 1], out[k, 2] = value, first, second


@Loop
def rates_at(waves, angle: float, out) -> None:
    """Write ``x'``, ``y'``, ``r`` and ``r'`` at an angle [rad] into (4)."""
    turn_cosine, turn_sine = math.cos(angle), math.sin(angle)
    c, s = 1.0, 0.0
    x, y, limit, rate = 0.0, 0.0, 0.0, 0.0
    for h in range(waves.shape[2]):
        x += h * (waves[0, 1, h] * c - waves[0, 0, h] * s)
        y += h * (waves[1, 1, h] * c - waves[1, 0, h] * s)
        limit += waves[2, 0, h] * c + waves[2, 1, h] * s
        rate += h * (waves[2, 1, h] * c - waves[2, 0, h] * s)
        c, s = c * turn_cosine - s * turn_sine, s * turn_cosine + c * turn_sine
    out[0], out[1], out[2], out[3] = x, y, limit, rate


@Loop
def bounds_of(waves, out) -> None:
    """Write bounds of derivatives 0 to 3 of the motion ``(x, y)`` and of ``r`` into (2, 4).

    The mean of the motion does not count.
    """
    out[:] = 0.0
    for h in range(waves.shape[2]):
        size = 0.0
        for part in range(2):
            size += np.hypot(waves[0, part, h], waves[1, part, h])
        limit = np.hypot(waves[2, 0, h], waves[2, 1, h])
        for d in range(4):
            if h > 0:
                out[0, d] += size * float(h) ** d
            out[1, d] += limit * (float(h) ** d if h > 0 or d == 0 else 0.0)


@Loop
def direction_within(turns, share: float, begin: float, length: float) -> float:
    """``a`` at a share of a step, of its derivatives at the nodes (s)."""
    z = 2 * share - 1
    last, now = 1.0, z
    total = 0.0
    for k in range(len(turns)):
        coefficient = 0.0
        for i in range(len(turns)):
            coefficient += TO_SERIES[k, i] * turns[i]
        if k == 0:
            total += coefficient * (z + 1)
        else:
            following = ((2 * k + 1) * z * now - k * last) / (k + 1)
            total += coefficient * (following - last) / (2 * k + 1)
            last, now = now, following
    return begin + 0.5 * length * total


@Loop
def factorise(matrix, pivots) -> None:
    """Triangular factors of a small matrix (s, s) in its place."""
    n = len(pivots)
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        pivots[k] = pivot
        if pivot != k:
            for j in range(n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
        if matrix[k, k] == 0.0:
            continue
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            matrix[i, k] = factor
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]


@Loop
def solve_factorised(matrix, pivots, right) -> None:
    """Solve for many right-hand sides (s, n) in their place."""
    n, columns = right.shape
    for k in range(n):
        pivot = pivots[k]
        if pivot != k:
            for c in range(columns):
                right[k, c], right[pivot, c] = right[pivot, c], right[k, c]
    for k in range(n):
        for i in range(k + 1, n):
            factor = matrix[i, k]
            for c in range(columns):
                right[i, c] -= factor * right[k, c]
    for k in range(n - 1, -1, -1):
        inverse = 1.0 / matrix[k, k] if matrix[k, k] != 0.0 else 0.0
        for c in range(columns):
            right[k, c] *= inverse
        for i in range(k):
            factor = matrix[i, k]
            for c in range(columns):
                right[i, c] -= factor * right[k, c]


@Loop
def step_matrix(nodes, length: float, matrix) -> None:
    """Derivative (s, s) of the equations of a step by ``a'`` at its nodes."""
    n = len(nodes)
    for i in range(n):
        for j in range(n):
            matrix[i, j] = length * nodes[i, ALONG] * BEFORE[i, j]
        matrix[i, i] += nodes[i, LIMIT]


@Loop
def slip_step(waves, begin: float, length: float, direction: float, work, nodes) -> Any:
    """Solve one step from an angle [rad] and a direction: whether it settles, and its error.

    ``work`` is a tuple of arrays; ``nodes`` (s, 8) takes the columns of the nodes. The error is how
    far ``a`` may be off within the step [rad]; at its end it is about the square of that.
    """
    rates, matrix, pivots, change = work
    n = STAGES
    for i in range(n):
        angle = begin + length * NODES[i]
        rates_at(waves, angle, rates[i])
        nodes[i, ANGLE], nodes[i, WEIGHT] = angle, length * WEIGHTS[i]
        nodes[i, LIMIT], nodes[i, LIMIT_RATE] = max(rates[i, 2], 0.0), rates[i, 3]
        nodes[i, TURN] = 0.0
    settled = False
    for _ in range(_ITERATIONS):
        for i in range(n):
            a = 0.0
            for j in range(n):
                a += BEFORE[i, j] * nodes[j, TURN]
            a = direction + length * a
            c, s = math.cos(a), math.sin(a)
            nodes[i, DIRECTION] = a
            nodes[i, ALONG] = rates[i, 0] * c + rates[i, 1] * s
            across = rates[i, 1] * c - rates[i, 0] * s
            change[i, 0] = across - nodes[i, LIMIT] * nodes[i, TURN]
        if settled:
            break
        step_matrix(nodes, length, matrix)
        factorise(matrix, pivots)
        solve_factorised(matrix, pivots, change)
        largest = 0.0
        for i in range(n):
            nodes[i, TURN] += change[i, 0]
            largest = max(largest, abs(change[i, 0]))
        if not largest * length < 1e3:
            return False, np.inf
        settled = largest * length < 1e-8
    error = 0.0
    for k in range(n - 2, n):
        coefficient = 0.0
        for i in range(n):
            coefficient += TO_SERIES[k, i] * nodes[i, TURN]
        error += abs(coefficient)
    for i in range(n):
        nodes[i, EXCESS] = nodes[i, ALONG] - nodes[i, LIMIT_RATE]
    return settled, error * length


@Loop
def direction_after(nodes, direction: float, length: float) -> float:
    """``a`` at the end of a step."""
    total = 0.0
    for i in range(len(nodes)):
        total += WEIGHTS[i] * nodes[i, TURN]
    return direction + length * total
