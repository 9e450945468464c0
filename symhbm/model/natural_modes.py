"""Natural frequencies and modes of structures, and of sectors by nodal diameter."""

from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import diags_array
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from symhbm.model.structure import Structure
from symhbm.numerics import DENSE_LIMIT, RADIANS, ComplexArray, FloatArray

_BELOW = 1e-9
"""Shift below zero, over the largest ratio of stiffness to mass: free motions stay regular."""


def natural_modes_of(
    structure: Structure, nodal_diameter: int | None, count: int, stuck: bool = False
) -> tuple[FloatArray, ComplexArray]:
    """The lowest natural frequencies (count,) [Hz], ascending, and modes (n_whole, count).

    Modes are of unit mass, of one sector where it is one. Contacts are open, or ``stuck``.
    Raises ValueError for a mass matrix that is not positive definite.
    """
    mass, _, stiffness = structure.matrices(nodal_diameter)
    if stuck:
        directions = structure.directions_of(nodal_diameter)
        springs = diags_array(structure.stuck_springs)
        stiffness = stiffness + directions.conj().T @ springs @ directions
    stiffness = (stiffness + stiffness.conj().T) / 2
    size = mass.shape[0]
    try:
        if size <= DENSE_LIMIT or 2 * count > size:
            lowest = [0, count - 1]
            squares, shapes = eigh(stiffness.toarray(), mass.toarray(), subset_by_index=lowest)
        else:
            squares, shapes = _lowest(stiffness.tocsc(), mass.tocsc(), count)
    except (np.linalg.LinAlgError, RuntimeError) as error:
        raise ValueError(
            "mass_matrix: expected a positive definite one, natural frequencies could not be "
            f"computed ({error})"
        ) from error
    return np.sqrt(np.maximum(squares, 0.0)) / RADIANS, structure.expanded(shapes, nodal_diameter)


def _lowest(stiffness: Any, mass: Any, count: int) -> tuple[FloatArray, ComplexArray]:
    """Squares of the lowest angular frequencies, ascending, and their modes."""
    inertia = mass.diagonal().real
    ratio = stiffness.diagonal().real[inertia > 0] / inertia[inertia > 0]
    shift = -_BELOW * ratio.max(initial=1.0)
    matrix = (stiffness - shift * mass).tocsc()
    # Ordering and pivots for symmetric patterns: positive definite but for round-off.
    factors = splu(matrix, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    inverse = LinearOperator(matrix.shape, factors.solve, dtype=matrix.dtype)  # type: ignore
    start = np.random.default_rng(0).normal(size=len(inertia))
    squares, shapes = eigsh(stiffness, count, mass, sigma=shift, OPinv=inverse, v0=start)
    order = np.argsort(squares)
    shapes = shapes[:, order]
    size = np.sqrt(np.sum(shapes.conj() * (mass @ shapes), axis=0).real)
    return squares[order], shapes / size
