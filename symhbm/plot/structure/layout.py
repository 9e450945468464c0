"""Positions of the masses in a drawing, and directions of elements to the ground."""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import shortest_path

from symhbm.model import Structure
from symhbm.numerics import FloatArray
from symhbm.plot.structure.network import Network

HALF = 0.2
"""Half of the side of a mass."""
REACH = 0.95
"""Length of an element to the ground."""
LONGEST_LINE = 8
"""Largest number of masses side by side."""
_PIVOTS = 40
"""Reference degrees of freedom of a layout: more do not change a picture."""


class Layout(NamedTuple):
    """Positions (n_dof, 2) of masses, and directions (n_dof, 2).

    ``inward`` is to the ground, ``outward`` of contacts to the ground, ``onward`` of forces;
    ``hub`` is the radius of the circle in the middle, None without one.
    """

    positions: FloatArray
    inward: FloatArray
    outward: FloatArray
    onward: FloatArray
    hub: float | None


def layout_of(model: Structure, parts: Network, pairs: NDArray[np.intp], detailed: bool) -> Layout:
    """A row or a ring for few masses, a ring for blades, else distances by numbers of links."""
    n = model.n_dof
    step = np.abs(pairs[:, 0] - pairs[:, 1])
    side = np.tile([0.0, 1.0], (n, 1))
    if n == 1 and parts.linear:
        along = np.array([[1.0, 0.0]])
        return Layout(np.zeros((1, 2)), -along, along, along, None)
    neighbours = bool(np.all((step == 1) | (step == n - 1))) and n > 2
    closed = neighbours and (model.lumped or bool(np.any(step == n - 1)))
    if detailed and parts.linear and not closed and np.all(step == 1) and n <= LONGEST_LINE:
        positions = np.zeros((n, 2))
        positions[:, 0] = 1.15 * np.arange(n)
        return Layout(positions, -side, side, side[:, ::-1], None)
    if not (detailed or closed or not parts.linear):
        positions = 0.35 * float(np.sqrt(n)) * spread(n, pairs)
        return Layout(positions, -side, side, side[:, ::-1], None)
    turn = np.pi / 2 - 2 * np.pi * np.arange(n) / n
    outward = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    onward = np.stack([np.sin(turn), -np.cos(turn)], axis=-1)
    radius = max(0.55 / np.sin(np.pi / max(n, 2)), 1.75)
    if closed or (neighbours and parts.linear):
        return Layout(radius * outward, -outward, outward, onward, radius - REACH - HALF)
    hub = None if parts.linear else radius - HALF
    return Layout(radius * outward, outward, outward, onward, hub)


def spread(n_dof: int, pairs: NDArray[np.intp]) -> FloatArray:
    """Positions (n_dof, 2) whose distances follow the numbers of links between them.

    Distances to a few degrees of freedom, each the farthest one from those before, give the two
    directions in which they differ most.
    """
    ones = np.ones(len(pairs))
    graph = sp.csr_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(n_dof, n_dof))
    nearest = np.full(n_dof, np.inf)
    rows: list[FloatArray] = []
    pivot = 0
    for _ in range(min(_PIVOTS, n_dof)):
        steps = shortest_path(graph, directed=False, unweighted=True, indices=pivot)
        rows.append(steps)
        nearest = np.minimum(nearest, steps)
        pivot = int(np.argmax(nearest))
    distance = np.stack(rows, axis=-1)
    within = distance[np.isfinite(distance)]
    # Parts without a link to the others stand aside.
    distance[~np.isfinite(distance)] = 1.2 * within.max() + 1
    square = distance**2
    centred = square - square.mean(axis=0) - square.mean(axis=1, keepdims=True) + square.mean()
    left, size, _ = np.linalg.svd(-centred / 2, full_matrices=False)
    positions = np.zeros((n_dof, 2))
    count = min(2, len(size))
    positions[:, :count] = left[:, :count] * size[:count]
    return positions / (np.abs(positions).max() or 1.0)
