"""The linear part of Eq. (9), ``sum_k omega^k Z_k x``, by the entries of its matrices.

``x`` are the Fourier coefficients of all degrees of freedom. Where there are mass, damping and
stiffness, their entries are inputs: ``Z_0`` has ``K`` for each coefficient, ``Z_1`` has ``n C``
between cosine and sine of harmonic ``n``, ``Z_2`` has ``-n^2 M``. Where the matrices differ from
harmonic to harmonic, as in the waves of a sector, the inputs are the entries of the ``Z_k``.
"""

from typing import Any

import casadi as ca
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model import Structure
from symhbm.model.cyclic import displacements
from symhbm.numerics import FloatArray, FourierBasis, sparsity_of

MATRIX_INPUTS = ("mass", "damping", "stiffness")
MOST = 10_000
"""Entries of matrices that differ from harmonic to harmonic from which numbers are faster."""


class OfMatrices:
    """Of mass, damping and stiffness, the same for all harmonics.

    ``dofs``, the first of all, are balanced. Matrices ``Z_k`` (n_balanced, n_all) of the
    coefficients, by their powers ``k``.

    Attributes
    ----------
    counts
        The names of the inputs, and how many entries each has.
    conservative
        The powers of what does no work over a cycle.
    """

    conservative: tuple[int, ...] = (0, 2)

    def __init__(self, model: Structure, basis: FourierBasis, dofs: NDArray[np.intp]):
        self._n_balanced = len(dofs)
        self._rows = self._balanced(model)
        self.counts = {name: rows.nnz for name, rows in self._rows.items()}
        turned = basis.derivative_matrix
        factors = np.eye(basis.n_components), turned, turned @ turned
        self._acting = dict(zip(("stiffness", "damping", "mass"), factors, strict=True))

    def _balanced(self, model: Structure) -> dict[str, Any]:
        """The rows of the matrices that are balanced, by columns."""

        def made() -> dict[str, Any]:
            matrices = {name: model.constant_part(name) for name in MATRIX_INPUTS}
            if self._n_balanced == model.n_dof:
                return matrices
            return {name: each[: self._n_balanced].tocsc() for name, each in matrices.items()}

        return model.of_matrices(("balanced", self._n_balanced), made)

    def values(self, model: Structure) -> dict[str, FloatArray]:
        """Stored entries of the matrices."""
        return {name: rows.data for name, rows in self._balanced(model).items()}

    def matrices(self, entries: dict[str, Any]) -> dict[int, Any]:
        """``K``, ``C`` and ``M``, each acting on components as its factor does."""
        result = {}
        for power, (name, factor) in enumerate(self._acting.items()):
            rows = self._rows[name]
            numbered = np.arange(rows.nnz) + 1.0, rows.indices, rows.indptr
            place = sp.csc_array(sp.kron(sp.csc_array(numbered, rows.shape), factor != 0))
            ones = np.ones(rows.nnz), rows.indices, rows.indptr
            weights = sp.csc_array(sp.kron(sp.csc_array(ones, rows.shape), sp.coo_array(factor)))
            chosen = ca.vec(entries[name][(place.data - 1).astype(int).tolist()])
            result[power] = ca.SX(sparsity_of(place), chosen * ca.DM(weights.data))
        return result


class OfHarmonics:
    """As `OfMatrices`, of matrices that differ from harmonic to harmonic, or have other powers.

    None of them where `DynamicStiffness` adds numbers to the compiled forces of contacts.
    """

    def __init__(self, model: Structure, basis: FourierBasis):
        self._basis, self._compiled = basis, is_symbolic(model, basis)
        self._sparsity = {k: sparsity_of(z) for k, z in self._forms(model).items()}
        self._names = {k: f"power_{k}" for k in self._sparsity}
        self.conservative = tuple(self._sparsity)
        self.counts = {self._names[k]: part.nnz() for k, part in self._sparsity.items()}

    def _forms(self, model: Any) -> dict[int, Any]:
        return real_forms(model, self._basis) if self._compiled else {}

    def values(self, model: Structure) -> dict[str, FloatArray]:
        """Stored entries of the ``Z_k``."""
        return {self._names[k]: z.data for k, z in self._forms(model).items()}

    def matrices(self, entries: dict[str, Any]) -> dict[int, Any]:
        """The ``Z_k`` as they are."""
        return {k: ca.SX(pattern, entries[self._names[k]]) for k, pattern in self._sparsity.items()}


def is_symbolic(model: Structure, basis: FourierBasis) -> bool:
    """Whether the linear part is compiled: there are matrices, and not too many entries."""
    if model.has_matrices:
        return True
    return model.is_polynomial and sum(z.nnz for z in real_forms(model, basis).values()) <= MOST


def real_forms(model: Any, basis: FourierBasis) -> dict[int, Any]:
    """The ``Z_k`` of structures of `powers`, by the complex ``A_k`` of their harmonics."""

    def made() -> dict[int, Any]:
        by_harmonic = {n: model.powers(n) for n in basis.harmonics}
        nothing = sp.csc_array((model.n_dof, model.n_dof))
        result = {}
        for k in sorted({k for powers in by_harmonic.values() for k in powers}):
            of_harmonic = {n: powers.get(k, nothing) for n, powers in by_harmonic.items()}
            result[k] = sp.csc_array(displacements(of_harmonic.__getitem__, basis))
            result[k].sort_indices()
        return result

    return model.of_matrices(("real forms", basis.harmonics), made)
