"""Large matrices that are never formed: of low rank beside sparse ones, and of other coordinates.

Displacements of contacts are coordinates in place of as many degrees of freedom. Coefficients of
all sectors follow from those of one, which the others repeat later.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import qr
from scipy.sparse.linalg import splu

from symhbm.model.records import Record, record
from symhbm.numerics import ComplexArray, FloatArray, FourierBasis


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


def factorised(matrix: Any) -> Any:
    """Solver of a matrix of a structure, RuntimeError where it is exactly singular."""
    if isinstance(matrix, LowRankSum):
        return _Woodbury(factorised(matrix.sparse), matrix)
    # An ordering for symmetric patterns, which matrices of structures have.
    options = dict(SymmetricMode=True)
    return splu(sp.csc_array(matrix), "MMD_AT_PLUS_A", diag_pivot_thresh=0.1, options=options)


def definite(matrix: Any) -> Any:
    """Factors of a sparse Hermitian matrix that is positive definite, None of another one."""
    if np.any(matrix.diagonal().real <= 0):
        return None
    options = dict(SymmetricMode=True)
    try:
        factors = splu(
            sp.csc_array(matrix), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options
        )
    except RuntimeError:  # singular
        return None
    # Pivots on the diagonal have the signs of the eigenvalues.
    return factors if np.all(factors.U.diagonal().real > 0) else None


def check_held(stiffness: Any, motion: NDArray, push: Any) -> None:
    """Raise ValueError unless a stiffness holds its motion (n_dof, n) under static forces."""
    rest = np.abs(stiffness @ motion - push).max(initial=0.0)
    terms = abs(stiffness) @ np.abs(motion).max(axis=1, initial=0.0)
    if not np.isfinite(motion).all() or rest > 1e-6 * terms.max(initial=1e-300):
        raise ValueError(
            "stiffness_matrix: expected one that holds all degrees of freedom once the kept ones "
            "are held; add to places one of each part that moves freely"
        )


class _Woodbury:
    """What solves with a matrix, from the ``factors`` of its sparse part."""

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
    def of(cls, directions: Any, held: NDArray[np.intp]) -> RelativeCoordinates:
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


def displacements(directions: Callable[[int], Any], basis: FourierBasis) -> Any:
    """Coefficients of displacements from those of degrees of freedom, sparse, all flattened.

    ``directions`` gives the rows (n_rows, n_dof), complex, of each harmonic, for ``a - i b``.
    """
    size, entries = basis.n_components, list[tuple[Any, Any, Any]]()
    shape: Any = (0, 0)
    for harmonic in basis.harmonics:
        rows: Any = sp.coo_array(directions(harmonic))
        shape = rows.shape
        cosine = basis.component(harmonic)
        real: Any = np.real(rows.data)
        imaginary: Any = np.imag(rows.data)
        parts: list[tuple[int, int, Any]] = [(cosine, cosine, real)]
        if harmonic:
            sine = basis.component(harmonic, sine=True)
            parts += [(sine, sine, real)]
            if np.iscomplexobj(rows.data):
                parts += [(cosine, sine, imaginary), (sine, cosine, -imaginary)]
        entries += [(rows.row * size + i, rows.col * size + j, value) for i, j, value in parts]
    row, column, value = (np.concatenate(each) for each in zip(*entries, strict=True))
    whole = shape[0] * size, shape[1] * size
    result = sp.csr_array((value, (row, column)), shape=whole)
    result.eliminate_zeros()
    return result


def turn(n: int, n_sectors: int) -> complex | float:
    """``exp(-2 pi i n / N)``, real to the bit where it is."""
    n %= n_sectors
    if 2 * n % n_sectors == 0:
        return -1.0 if n else 1.0
    return complex(np.exp(-2j * np.pi * n / n_sectors))


def phasors(components: FloatArray) -> ComplexArray:
    """``a - i b`` of the coefficients (n, 1 or 2) of one harmonic, (n,)."""
    return np.asarray(components @ np.array([1, -1j])[: components.shape[1]], dtype=complex)


def components(phasors: ComplexArray, harmonic: int) -> FloatArray:
    """Coefficients (n, 1 or 2) of one harmonic from ``a - i b`` (n,)."""
    parts = [np.real(phasors), -np.imag(phasors)][: 1 + (harmonic > 0)]
    return np.asarray(np.column_stack(parts), dtype=float)


def lagging(shape: FloatArray, basis: FourierBasis, lag: int, n_sectors: int) -> FloatArray:
    """Coefficients (n, n_components) later by ``lag`` turns over ``n_sectors`` of harmonic 1."""
    each = zip(basis.harmonics, basis.by_harmonic(shape), strict=True)
    return np.hstack([components(phasors(part) * turn(n * lag, n_sectors), n) for n, part in each])
