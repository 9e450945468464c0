"""Large matrices of low rank beside sparse ones: never formed, always as factors."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.records import Record


class LowRankSum(Record):
    """``sparse + left @ right^T``: a sparse matrix (n, m) and factors (n, rank) and (m, rank).

    It multiplies columns, adds to sparse matrices, and gives blocks, as those do.
    """

    __array_ufunc__ = None
    """NumPy's numbers leave products with it to its own methods."""

    def __init__(self, sparse: Any, left: NDArray, right: NDArray):
        self.sparse, self.left, self.right = sparse, left, right

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        return len(self.left), len(self.right)

    @property
    def factors(self) -> tuple[NDArray, NDArray]:
        """``left`` and ``right``."""
        return self.left, self.right

    @property
    def T(self) -> LowRankSum:  # noqa: N802
        """The transposed matrix."""
        return LowRankSum(self.sparse.T, self.right, self.left)

    @property
    def arrays(self) -> tuple[NDArray, ...]:
        """All numbers that it is made of."""
        sparse = sp.csc_array(self.sparse)
        return sparse.indptr, sparse.indices, sparse.data, self.left, self.right

    def __matmul__(self, columns: Any) -> Any:
        return self.sparse @ columns + self.left @ (self.right.T @ columns)

    def __add__(self, sparse: Any) -> LowRankSum:
        return LowRankSum(self.sparse + sparse, self.left, self.right)

    __radd__ = __add__

    def __mul__(self, factor: Any) -> LowRankSum:
        return LowRankSum(factor * self.sparse, factor * self.left, self.right)

    __rmul__ = __mul__

    def __getitem__(self, chosen: Any) -> LowRankSum:
        rows, columns = chosen if isinstance(chosen, tuple) else (chosen, slice(None))
        part = self.sparse.tocsr()[rows][:, columns]
        return LowRankSum(part, self.left[rows], self.right[columns])

    def astype(self, dtype: Any) -> LowRankSum:
        """The same in another precision."""
        return LowRankSum(
            self.sparse.astype(dtype), self.left.astype(dtype), self.right.astype(dtype)
        )

    def tocsr(self) -> LowRankSum:
        """Itself: it has no other form."""
        return self

    tocsc = tocsr

    @property
    def dtype(self) -> Any:
        """That of all its numbers."""
        return np.result_type(self.sparse.dtype, self.left, self.right)

    def __abs__(self) -> LowRankSum:
        """A matrix whose entries are at least as large, and positive."""
        return LowRankSum(abs(self.sparse), np.abs(self.left), np.abs(self.right))

    def count_nonzero(self) -> int:
        """Whether it has entries that are not 0, as a number."""
        return int(self.sparse.count_nonzero() or (self.left.any() and self.right.any()))

    def diagonal(self) -> NDArray:
        """Its diagonal."""
        return self.sparse.diagonal() + np.sum(self.left * self.right, axis=1)

    def toarray(self) -> NDArray:
        """The full matrix."""
        return self.sparse.toarray() + self.left @ self.right.T


def solver_of_sum(factors: Any, matrix: LowRankSum) -> Any:
    """What solves with ``matrix``, from the ``factors`` of its sparse part (Woodbury)."""
    return _Woodbury(factors, matrix)


class _Woodbury:
    def __init__(self, factors: Any, matrix: LowRankSum):
        self._factors = factors
        left, right = (np.asarray(m, dtype=np.result_type(m, float)) for m in matrix.factors)
        self._sides = {"N": (left, right), "H": (right.conj(), left.conj())}
        self._shares: dict[str, tuple[NDArray, NDArray]] = {}

    def solve(self, right: NDArray, trans: str = "N") -> NDArray:
        """Solution (n, n_columns); of the adjoint equations with ``trans="H"``."""
        if trans not in self._shares:
            columns, rows = self._sides[trans]
            moved = self._factors.solve(columns, trans)
            small = np.eye(moved.shape[1]) + rows.T @ moved
            self._shares[trans] = moved, np.linalg.solve(small, rows.T)
        moved, shares = self._shares[trans]
        motion = self._factors.solve(right, trans)
        return motion - moved @ (shares @ motion)
