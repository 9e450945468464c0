"""Linear algebra of dense and sparse Jacobians."""

from collections.abc import Callable
from contextlib import suppress
from functools import cached_property, partial
from math import sqrt
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import get_lapack_funcs
from scipy.sparse.linalg import splu

from symhbm.numerics.check import FloatArray


def relative_difference(value: FloatArray, reference: FloatArray) -> float:
    """Largest difference over the largest reference."""
    return float(np.abs(value - reference).max() / (np.abs(reference).max() or 1.0))


_DGETRF, _DGETRS, _DSYTRF = get_lapack_funcs(("getrf", "getrs", "sytrf"), dtype=np.float64)
(_ZHETRF,) = get_lapack_funcs(("hetrf",), dtype=np.complex128)
DENSE_LIMIT = 500
"""Largest number of unknowns for which LAPACK on a full matrix is faster than SuperLU."""

_ALWAYS_FULL = 200
"""Unknowns up to which that holds whatever the entries."""
_FILLED = 0.08
"""Share of entries from which on it holds up to that limit."""
SMALL = 20_000
"""Entries of a full matrix whose product with a vector takes less time than a sparse one's call."""


def bordered(jacobian: Any, column: FloatArray, row: FloatArray, scale: Any = 1.0) -> Any:
    """The matrix ``[jacobian scale, column; row]``, dense or sparse as ``jacobian`` is."""
    if sp.issparse(jacobian):
        top = sp.hstack([jacobian * scale, sp.csc_array(column[:, None])])
        return sp.vstack([top, sp.csc_array(row[None, :])]).tocsc()
    size = len(column)
    matrix = np.empty((size + 1, size + 1), order="F")
    np.multiply(jacobian, scale, out=matrix[:size, :size])
    matrix[:size, size] = column
    matrix[size] = row
    return matrix


def saddle(hessian: Any, constraints: Any) -> Any:
    """The symmetric matrix ``[hessian, -constraints'; -constraints, 0]``, dense or sparse."""
    if sp.issparse(hessian):
        return sp.block_array([[hessian, -constraints.T], [-constraints, None]], format="csc")
    size = len(hessian)
    matrix = np.zeros((size + len(constraints),) * 2, order="F")
    matrix[:size, :size] = hessian
    matrix[:size, size:] = -constraints.T
    matrix[size:, :size] = -constraints
    return matrix


def by_size(matrix: Any) -> Any:
    """The matrix in the form of the fastest factorisation: full up to a size, sparse above."""
    if matrix.shape[0] > DENSE_LIMIT:
        return sp.csc_array(matrix)
    return full(matrix)


def full(matrix: Any) -> FloatArray:
    """The matrix as an array."""
    return matrix.toarray(order="F") if sp.issparse(matrix) else matrix


def is_full(size: int, n_entries: int) -> bool:
    """Whether a square matrix is factorised faster as a full one."""
    dense = size <= _ALWAYS_FULL or n_entries > _FILLED * size**2
    return size <= DENSE_LIMIT and dense


def compact(matrix: Any) -> Any:
    """A sparse matrix in the form whose products with vectors are faster: full up to a size."""
    rows, columns = matrix.shape
    return matrix.toarray() if rows * columns <= SMALL else matrix


def length_of(vector: FloatArray) -> float:
    """Euclidean norm of a vector, faster than `numpy.linalg.norm` for a short one."""
    return sqrt(vector.dot(vector))


def negative_eigenvalues(matrix: NDArray) -> int:
    """Number of negative eigenvalues of a real symmetric or complex Hermitian matrix.

    As many as the factor ``D`` of ``L D L^H`` has (Sylvester's law of inertia). Of its blocks of
    two rows, marked by negative numbers, each has one of either sign (Bunch and Kaufman).
    """
    if len(matrix) == 1:
        return int(matrix[0, 0].real < 0)
    factors, rows, _ = (_ZHETRF if np.iscomplexobj(matrix) else _DSYTRF)(matrix, lower=True)
    single = rows > 0
    negative = np.count_nonzero(factors.diagonal().real[single] < 0)
    return int(negative + np.count_nonzero(~single) // 2)


class Factorisation:
    """LU factors of a square matrix."""

    def __init__(self, matrix: Any):
        self._solve: Callable[[FloatArray], FloatArray] | None = None
        if sp.issparse(matrix):
            with suppress(RuntimeError):  # SuperLU: exactly singular
                # An ordering for symmetric patterns, as of structures, but for a border.
                factors = splu(
                    sp.csc_matrix(matrix),
                    "MMD_AT_PLUS_A",
                    diag_pivot_thresh=0.1,
                    options=dict(SymmetricMode=True),
                )
                self._solve, self._factors = factors.solve, factors
        else:
            lu, pivot, info = _DGETRF(matrix)
            if info == 0:
                self._solve, self._factors = partial(_solve_columns, lu, pivot), (lu, pivot)

    @cached_property
    def sign(self) -> int:
        """The sign of the determinant, 0 of a singular matrix."""
        if self._solve is None:
            return 0
        if isinstance(self._factors, tuple):
            lu, pivot = self._factors
            pivots, exchanges = lu.diagonal(), np.count_nonzero(pivot != np.arange(len(pivot)))
        else:
            factors = self._factors
            pivots = factors.U.diagonal()
            exchanges = sum(map(_exchanges, (factors.perm_r, factors.perm_c)))
        if not np.all(np.isfinite(pivots)):
            return 0
        return 1 - 2 * int((exchanges + np.count_nonzero(pivots < 0)) % 2)

    def solve(self, right: FloatArray) -> FloatArray | None:
        """Solution for one or several right-hand sides, None if there is no finite one."""
        if self._solve is None or not np.isfinite(right).all():
            return None
        solution = self._solve(right)
        return solution if np.isfinite(solution).all() else None


def _solve_columns(lu: FloatArray, pivot: NDArray, right: FloatArray) -> FloatArray:
    """Solution from factors, one column at a time.

    OpenBLAS starts threads for several, and waits for them longer than such a matrix takes, the
    more so on a busy machine.
    """
    solution = np.array(right, order="F")
    for column in solution.T if solution.ndim > 1 else (solution,):
        _DGETRS(lu, pivot, column, overwrite_b=True)
    return solution


def _exchanges(permutation: NDArray) -> int:
    """How many exchanges make a permutation: a cycle of ``n`` entries takes ``n - 1``."""
    following, count = permutation.tolist(), 0
    for place in range(len(following)):
        while (other := following[place]) != place:
            following[place], following[other] = following[other], other
            count += 1
    return count
