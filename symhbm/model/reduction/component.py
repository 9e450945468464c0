"""Hurty's reduction of one component to degrees of freedom of it, by its matrices.

Motions are ``x = [B 0; Psi Phi] (b, eta)``: of the boundary by ``b``, of the interior by constraint
modes ``Psi = -K_ii^-1 K_ib B`` and modes ``Phi`` with the boundary held. Motions of the interior at
as many degrees of freedom as there are modes stand for ``eta``, so that every coordinate is the
displacement of a place.
"""

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import qr

from symhbm.model.linear import LowRankSum, lowest_modes
from symhbm.numerics import FloatArray

_COLUMNS = 64
"""Right-hand sides solved at once: little memory."""


def chosen_rows(shapes: FloatArray) -> NDArray[np.intp]:
    """Rows of ``shapes`` (n, m) that tell its columns apart best, (m,), ascending."""
    parts: Any = qr(shapes.T, mode="r", pivoting=True)
    return np.sort(parts[1][: shapes.shape[1]]).astype(np.intp)


def by_rows(shapes: FloatArray, rows: NDArray[np.intp]) -> NDArray:
    """Shapes (n, m) that span the same and are those of a unit motion of each of m ``rows``."""
    result = np.linalg.solve(shapes[rows].T, shapes.T).T
    result[rows] = np.eye(len(rows))
    return result


class Component:
    """A component held at its ``boundary`` (n_boundary,): how its interior follows.

    ``motion`` (n_boundary, n) is that of the boundary by its coordinates. ValueError where the
    interior can move without any stiffness, or has fewer than ``modes`` modes.
    """

    def __init__(
        self, mass: Any, stiffness: Any, boundary: NDArray[np.intp], motion: Any, modes: int
    ):
        n_dof = mass.shape[0]
        self.interior = interior = np.setdiff1d(np.arange(n_dof), boundary)
        rows = stiffness.tocsr()[interior]
        inside = rows[:, interior].tocsc()
        static = follow(inside, -(rows[:, boundary] @ motion))
        self.squares, self.shapes = lowest_modes(
            inside, mass.tocsr()[interior][:, interior].tocsc(), modes
        )
        if len(self.squares) < modes:
            raise ValueError(
                f"modes={modes}: expected at most {len(self.squares)}, the modes of the structure "
                "with what is kept held"
            )
        chosen = chosen_rows(self.shapes) if modes else np.zeros(0, dtype=np.intp)
        self.representatives = interior[chosen]
        self.to_modes = np.linalg.inv(self.shapes[chosen])
        self.basis = np.zeros((n_dof, motion.shape[1] + modes))
        self.basis[boundary, : motion.shape[1]] = (
            motion.toarray() if sp.issparse(motion) else motion
        )
        spread = self.shapes @ self.to_modes
        self.basis[interior, : motion.shape[1]] = static - spread @ static[chosen]
        self.basis[interior, motion.shape[1] :] = spread
        self.basis[self.representatives] = np.eye(motion.shape[1] + modes)[motion.shape[1] :]
        # Of each mode by the coordinates of the reduced component.
        self.modal_rows = np.hstack([-self.to_modes @ static[chosen], self.to_modes])


def follow(inside: Any, push: Any) -> FloatArray:
    """Motion of an interior under static forces (n_interior, n)."""
    push = push.toarray() if sp.issparse(push) else np.asarray(push)
    result = np.empty(push.shape)
    try:
        options = dict(SymmetricMode=True)
        factors = sp.linalg.splu(
            sp.csc_array(inside), "MMD_AT_PLUS_A", diag_pivot_thresh=0.1, options=options
        )
        for first in range(0, push.shape[1], _COLUMNS):
            result[:, first : first + _COLUMNS] = factors.solve(push[:, first : first + _COLUMNS])
    except RuntimeError:
        result[:] = np.nan
    rest = np.abs(inside @ result - push).max(initial=0.0)
    terms = (abs(inside) @ np.abs(result).max(axis=1, initial=0.0)).max(initial=1e-300)
    if not np.isfinite(result).all() or rest > 1e-6 * terms:
        raise ValueError(
            "stiffness_matrix: expected one that holds all degrees of freedom once the kept ones "
            "are held; add to places one of each part that moves freely"
        )
    return result


def projected(matrix: Any, basis: FloatArray) -> FloatArray:
    """``basis^T matrix basis``, symmetric to the bit where the matrix is symmetric."""
    result = basis.T @ (matrix @ basis)
    symmetric = isinstance(matrix, LowRankSum) or not (abs(matrix - matrix.T) > 0).nnz
    return (result + result.T) / 2 if symmetric else result
