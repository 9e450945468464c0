"""Models as networks of masses, springs, dampers and contacts, and where these are drawn."""

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import shortest_path

from symhbm.model import Structure
from symhbm.numerics import FloatArray

_ROUND_OFF = 1e-9
"""Share of an entry that is round-off of its terms."""


class Links(NamedTuple):
    """Elements of one matrix: to the ground and between pairs, or why there are none.

    ``ground`` (n_dof,), ``pairs`` (n_pairs, 2), ``values`` (n_pairs,). Where the matrix is no
    network ``reason`` tells why, ``pairs`` are those it couples, and all values are 0.
    """

    ground: FloatArray
    pairs: NDArray[np.intp]
    values: FloatArray
    reason: str


class Network(NamedTuple):
    """Elements of a model; ``linear`` is False for a condensed one, which has no linear ones."""

    mass: FloatArray
    springs: Links
    dampers: Links
    inertial_pairs: int
    linear: bool


def links(matrix: Any) -> Links:
    """The elements that a matrix is the sum of: ``v [[1, -1], [-1, 1]]`` between two, ``v`` alone.

    Only matrices that are symmetric, with no positive entry off the diagonal and no row whose sum
    is negative, are such a sum.
    """
    whole: Any = sp.csc_array(matrix)
    diagonal = whole.diagonal()
    differs: Any = abs(whole - whole.T)
    largest = abs(whole).max() if whole.nnz else 0.0
    symmetric = not differs.nnz or differs.max() <= _ROUND_OFF * largest
    lower: Any = sp.coo_array(sp.tril(whole if symmetric else abs(whole) + abs(whole.T), -1))
    coupled = lower.data != 0
    pairs = np.stack([lower.col[coupled], lower.row[coupled]], axis=-1).astype(np.intp)
    values = -lower.data[coupled]
    sums = whole.sum(axis=1)
    ground = np.where(np.abs(sums) > _ROUND_OFF * diagonal, sums, 0.0)
    if not symmetric:
        reason = "is not symmetric"
    elif np.any(values < 0):
        reason = f"has positive entries off its diagonal ({(values < 0).sum()} of {len(values)})"
    elif np.any(ground < 0):
        reason = f"has rows whose sum is negative ({(ground < 0).sum()} of {len(ground)})"
    else:
        return Links(ground, pairs, values, "")
    return Links(np.zeros_like(ground), pairs, np.zeros_like(values), reason)


def network(model: Structure) -> Network:
    """Masses, springs and dampers of a model; a condensed one has none."""
    none = Links(np.zeros(model.n_dof), np.empty((0, 2), np.intp), np.empty(0), "")
    if not model.has_matrices:
        return Network(np.zeros(model.n_dof), none, none, 0, False)
    mass: Any = sp.csc_array(model.mass_matrix)
    return Network(
        mass.diagonal(),
        links(model.stiffness_matrix),
        links(model.damping_matrix),
        len(links(mass).pairs),
        True,
    )


def kinds_of_contacts(model: Structure) -> list[list[str]]:
    """Elements of each contact, those of all its laws, or ``opened`` where it has no force."""
    kinds: list[list[str]] = [[] for _ in model.contacts]
    for group in model.groups:
        acts = group.law.acts(group.values)
        for j in group.contacts[acts].tolist():
            kinds[j].append(group.law.drawn_as)
    return [kind or ["opened"] for kind in kinds]


def places_of_contacts(model: Structure) -> list[tuple[int, ...]]:
    """Degrees of freedom of each contact in the first of its directions, largest weights first."""
    rows = _places(model)
    return [rows[of_contact[0]] for of_contact in model.groups.rows]


def _places(model: Structure) -> list[tuple[int, ...]]:
    """Those of each direction: of a sector what moves in a wave, also to the same place beyond."""
    directions = sp.csr_array(model.directions_of(1))
    ends = zip(directions.indptr[:-1], directions.indptr[1:], strict=True)
    rows = [(directions.indices[i:j], np.abs(directions.data[i:j])) for i, j in ends]
    return [tuple(dofs[np.lexsort((dofs, -weights))].tolist()) for dofs, weights in rows]


def joined(model: Structure, parts: Network) -> NDArray[np.intp]:
    """Pairs of degrees of freedom with an element between them, (n, 2), the lower one first."""
    touched = [(dofs[0], dof) for dofs in _places(model) for dof in dofs[1:]]
    contacts = np.array(touched, dtype=np.intp).reshape(-1, 2)
    every = np.concatenate([parts.springs.pairs, parts.dampers.pairs, contacts])
    return np.unique(np.sort(every, axis=1), axis=0)


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
