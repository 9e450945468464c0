"""Displacements of contacts as coordinates, in place of as many degrees of freedom."""

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import qr

from symhbm.model.records import record

_DEPENDENT = 1e-8
"""Share of a direction that is not one of the others, below which it depends on them."""


@record
class RelativeCoordinates(NamedTuple):
    """Which degrees of freedom displacements ``y = w^T x`` take the place of.

    Displacement ``rows[k]`` is what moves at the degree of freedom ``pivots[k]``, (n,) each, all
    others stay; ``held`` (n_held,) are some of those, which displacements may depend on.
    """

    rows: NDArray[np.intp]
    pivots: NDArray[np.intp]
    held: NDArray[np.intp]

    @classmethod
    def of(cls, directions: Any, held: NDArray[np.intp]) -> "RelativeCoordinates":
        """Those of sparse ``directions`` (n_rows, n_dof) that neither others nor ``held`` tell."""
        columns = np.setdiff1d(directions.nonzero()[1], held)
        size = np.sqrt(abs(directions).power(2).sum(axis=1))
        dense = directions[:, columns].toarray() / size[:, None]
        rows = np.sort(_independent(dense.conj().T))
        return cls(rows, columns[_independent(dense[rows])], held)

    @property
    def masters(self) -> NDArray[np.intp]:
        """Where they are that are held, then the displacements, (n_held + n,)."""
        return np.concatenate([self.held, self.pivots])

    def change(self, directions: Any) -> Any:
        """All degrees of freedom from these coordinates, sparse (n_dof, n_dof).

        ValueError unless ``directions`` (n_rows, n_dof) follow from those of ``rows``, and those
        can take the place of ``pivots``.
        """
        n = directions.shape[1]
        chosen = directions[self.rows].tocsc()
        square = chosen[:, self.pivots].toarray()
        sound = not len(square) or np.linalg.cond(square) < 1 / _DEPENDENT
        inverse = sp.csr_array(np.linalg.inv(square) if sound else square)
        kept = np.ones(n)
        kept[self.pivots] = 0.0
        own = sp.diags_array(kept, format="csr")
        at = sp.csr_array(
            (np.ones(len(square)), (self.pivots, np.arange(len(square)))), (n, len(square))
        )
        change = own + at @ inverse @ (at.T - chosen @ own)
        free = np.ones(n)
        free[self.masters] = 0.0
        rest = abs(directions @ change @ sp.diags_array(free))
        if not sound or (rest.nnz and rest.max() > _DEPENDENT * abs(directions).max()):
            raise ValueError(
                "keep='displacements': expected contacts whose displacements depend on each other "
                "in the same way in all waves around the disk; 'touched' keeps their degrees of "
                "freedom"
            )
        return change.tocsc()


def _independent(matrix: NDArray) -> NDArray[np.intp]:
    """Numbers of as many columns as are linearly independent."""
    _, r, order = qr(matrix, mode="economic", pivoting=True)  # type: ignore
    size = np.abs(r.diagonal())
    return order[: np.count_nonzero(size > _DEPENDENT * size.max(initial=0.0))].astype(np.intp)
