"""Mass matrices: kinetic energy is nowhere negative, and where motions need some of it everywhere.

Harmonic balance takes degrees of freedom without inertia, as lumped masses leave to rotations:
`check_semidefinite` is all it asks. What integrates motions in time, or has natural frequencies,
divides by the mass matrix: `positive_definite` factorises it or says so.
"""

from contextlib import suppress
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import ArpackNoConvergence, eigsh

from symhbm.model.linear.low_rank import definite
from symhbm.numerics import FloatArray

_SYMMETRIC = 1e-9
_SINGULAR = 1e-10
"""Eigenvalue, relative to a diagonal of ones, that is 0 but for round-off."""
_NO_PIVOT = 1e-14
"""Square of a pivot, relative to the diagonal, that is 0 but for round-off."""
_DENSE = 500
_DIRECTIONS = 6
"""Parts of a mass matrix that nothing couples, at most: displacements and rotations."""
_LARGE = 50_000
"""Size from which factors take much longer than the lowest eigenvalue to a few digits."""


def check_semidefinite(mass: Any) -> None:
    """Raise ValueError unless a sparse mass matrix is symmetric and positive semidefinite."""
    asymmetry = abs(mass - mass.T).tocoo()
    if asymmetry.nnz and asymmetry.max() > _SYMMETRIC * abs(mass).max():
        at = int(np.argmax(asymmetry.data))
        i, j = int(asymmetry.row[at]), int(asymmetry.col[at])
        raise ValueError(
            f"mass_matrix: expected a symmetric matrix, entry {i, j} is "
            f"{mass[i, j]:.9g}, entry {j, i} is {mass[j, i]:.9g}"
        )
    diagonal = mass.diagonal()
    beside = np.asarray(abs(mass).sum(axis=0)).ravel() - np.abs(diagonal)
    coupled = (diagonal == 0) & (beside > 0)
    if coupled.any():
        i = int(np.argmax(coupled))
        raise ValueError(
            f"mass_matrix: expected a positive semidefinite matrix, entry {i, i} of its diagonal "
            "is 0 and its row is not"
        )
    # Rows that are led by their diagonals need no factors: lumped masses, chains of elements.
    if np.all(diagonal >= beside):
        return
    moving = np.flatnonzero(diagonal)
    scale = sp.diags_array(diagonal[moving] ** -0.5)
    scaled = (scale @ mass[moving][:, moving] @ scale).tocsc()
    if not _is_semidefinite(scaled):
        raise ValueError(
            "mass_matrix: expected a positive semidefinite matrix, this one gives some motions "
            "a negative kinetic energy"
        )


def dissipates(damping: Any) -> bool:
    """Whether a damping matrix gives energy to no motion, but for round-off."""
    if not sp.issparse(damping):
        return True  # that of modes, whose damping ratios are not negative
    part = (damping + damping.conj().T).tocsc() / 2
    part.eliminate_zeros()
    diagonal = part.diagonal().real
    beside = np.asarray(abs(part).sum(axis=0)).ravel() - np.abs(diagonal)
    if np.all(diagonal >= beside):
        return True
    if np.any(diagonal < 0) or np.any((diagonal == 0) & (beside > 0)):
        return False
    moving = np.flatnonzero(diagonal)
    scale = sp.diags_array(diagonal[moving] ** -0.5)
    return _is_semidefinite((scale @ part[moving][:, moving] @ scale).tocsc())


def _is_semidefinite(scaled: Any) -> bool:
    """Whether a symmetric sparse matrix with a diagonal of ones is, but for round-off."""
    size = scaled.shape[0]
    if size <= _DENSE:
        return bool(np.linalg.eigvalsh(scaled.toarray())[0] >= -_SINGULAR * size)
    if size > _LARGE:
        with suppress(ArpackNoConvergence):
            return all(_lowest(block) >= -_SINGULAR * size for block in _different_blocks(scaled))
    return definite(scaled + _SINGULAR * size * sp.eye_array(size)) is not None


def _lowest(matrix: Any) -> float:
    """The lowest eigenvalue, to a few digits."""
    start = np.random.default_rng(0).normal(size=matrix.shape[0])
    [lowest] = eigsh(matrix, 1, which="SA", tol=1e-2, v0=start, return_eigenvectors=False)  # type: ignore
    return float(lowest)


def _different_blocks(matrix: Any) -> list[Any]:
    """The parts of a matrix that nothing couples, without those equal to the first.

    Masses of solids couple no two directions, and are the same along all of them.
    """
    from scipy.sparse.csgraph import connected_components  # slow to import

    count, part = connected_components(matrix, directed=False)
    if not 1 < count <= _DIRECTIONS:
        return [matrix]
    rows = (np.flatnonzero(part == k) for k in range(count))
    first, *others = (matrix[at][:, at] for at in rows)
    names = "indptr", "indices", "data"
    same = [all(np.array_equal(getattr(first, n), getattr(b, n)) for n in names) for b in others]
    return [first, *(block for block, one in zip(others, same, strict=True) if not one)]


def positive_definite(mass: FloatArray) -> FloatArray:
    """Lower Cholesky factor of a mass matrix.

    LinAlgError, a ValueError, unless it is positive definite: where stability is told unasked, it
    is unknown, and all else goes on.
    """
    try:
        factor = np.asarray(np.linalg.cholesky(mass), dtype=float)
    except np.linalg.LinAlgError:
        factor = np.zeros(mass.shape)
    if np.any(factor.diagonal() ** 2 <= _NO_PIVOT * mass.diagonal()):
        raise np.linalg.LinAlgError(
            "mass_matrix: expected a positive definite matrix, as every motion needs inertia here; "
            "frf, follow and solve take degrees of freedom without"
        )
    return factor
