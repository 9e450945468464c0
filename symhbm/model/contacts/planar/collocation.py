"""One step of slip: the direction of the force by Gauss collocation.

While a contact slips its force is ``r n``, ``n = (cos a, sin a)``, and

    r a' = x' . n_perp,        n_perp = (-sin a, cos a).

The angle ``a`` is a polynomial on the step that fulfils this at Gauss nodes; its end and the
integrals of the force are of twice their order. Written with ``r`` on the left the equation is
regular where the contact closes or opens, ``r = 0``.
"""

import math
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from symhbm.model.contacts.planar.series import rates_at
from symhbm.numerics.loops import Loop

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
def direction_within(turns: Any, share: float, begin: float, length: float) -> float:
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
def factorise(matrix: Any, pivots: Any) -> None:
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
def solve_factorised(matrix: Any, pivots: Any, right: Any) -> None:
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
def step_matrix(nodes: Any, length: float, matrix: Any) -> None:
    """Derivative (s, s) of the equations of a step by ``a'`` at its nodes."""
    n = len(nodes)
    for i in range(n):
        for j in range(n):
            matrix[i, j] = length * nodes[i, ALONG] * BEFORE[i, j]
        matrix[i, i] += nodes[i, LIMIT]


@Loop
def slip_step(
    waves: Any, begin: float, length: float, direction: float, work: Any, nodes: Any
) -> Any:
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
def direction_after(nodes: Any, direction: float, length: float) -> float:
    """``a`` at the end of a step."""
    total = 0.0
    for i in range(len(nodes)):
        total += WEIGHTS[i] * nodes[i, TURN]
    return direction + length * total
