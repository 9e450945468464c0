"""Structures whose dynamic stiffness is a polynomial of the frequency, harmonic by harmonic."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np
import scipy.sparse as sp

from symhbm.model.linear import hermitian, lowest_modes
from symhbm.model.structure import Matrices, NearModes, Structure, weighted
from symhbm.numerics import ComplexArray, FloatArray, negative_eigenvalues


class PolynomialStructure(Structure):
    """A structure of ``Z = sum_k omega^k A_k`` in each harmonic, and of an inertia.

    Models, what rotates, and sectors of both tell their `powers`.
    """

    @abstractmethod
    def matrices_in(self, harmonic: int) -> Matrices:
        """Matrices of a harmonic, sparse, of motions ``Re(x exp(i n omega t))``."""

    @abstractmethod
    def loss_in(self, harmonic: int) -> Any:
        """The stiffness times the loss factor in a harmonic, sparse (n_dof, n_dof) [N/m]."""

    def rotation_powers(self, harmonic: int) -> dict[int, Any]:
        """What rotation adds to the ``A_k``, sparse (n_dof, n_dof) by ``k``."""
        return {}

    def powers(self, harmonic: int) -> dict[int, Any]:
        """Sparse ``A_k`` (n_dof, n_dof) by ``k``: ``K + i n omega C - (n omega)^2 M`` and more."""
        mass, damping, stiffness = self.matrices_in(harmonic)
        result = {0: stiffness, 1: 1j * harmonic * damping, 2: -(harmonic**2) * mass}
        if harmonic and self.loss_factor:
            result[0] = stiffness + 1j * self.loss_in(harmonic)
        for power, added in self.rotation_powers(harmonic).items():
            result[power] = result[power] + added if power in result else added
        return result

    def _dense(self, harmonic: int) -> tuple[dict[int, ComplexArray], ComplexArray]:
        """``A_k`` and directions of the contacts as arrays."""

        def made() -> tuple[dict[int, ComplexArray], ComplexArray]:
            powers = self.powers(harmonic).items()
            dense = {k: part.toarray().astype(complex) for k, part in powers}
            return dense, self.directions_in(harmonic).toarray()

        return self.of_matrices(harmonic, made)

    def dynamic_stiffness(
        self, harmonic: int, frequency: float
    ) -> tuple[ComplexArray, ComplexArray]:
        """The polynomial and its derivative by the frequency, dense."""
        parts, _ = self._dense(harmonic)
        value, slope = np.zeros((2, self.n_dof, self.n_dof), dtype=complex)
        for power, part in parts.items():
            value += frequency**power * part
            if power:
                slope += power * frequency ** (power - 1) * part
        return value, slope

    @property
    def bends(self) -> bool:
        """That it does: second derivatives of a polynomial are known."""
        return True

    def forces_curvature(self, harmonic: int, frequency: float) -> ComplexArray:
        """Second derivative of the dynamic stiffness by the frequency, (n_dof, n_dof)."""
        result = np.zeros((self.n_dof, self.n_dof), dtype=complex)
        for power, part in self._dense(harmonic)[0].items():
            if power > 1:
                result += power * (power - 1) * frequency ** (power - 2) * part
        return result

    def _undamped(self, harmonic: int, frequency: float, springs: FloatArray) -> ComplexArray:
        _, directions = self._dense(harmonic)
        whole = self.dynamic_stiffness(harmonic, frequency)[0]
        return hermitian(whole + weighted(directions.conj().T, springs) @ directions)

    def modes_below(self, harmonic: int, frequency: float, springs: FloatArray) -> int | None:
        """Number of natural frequencies below a harmonic, counted exactly."""
        return negative_eigenvalues(self._undamped(harmonic, frequency, springs))

    def modes_near(
        self, harmonic: int, frequency: float, springs: FloatArray, losses: FloatArray
    ) -> NearModes | None:
        """All modes of a harmonic, with springs and losses; None where a motion has no inertia."""
        exciting, inertia = harmonic * frequency, self.matrices_in(harmonic).mass_matrix
        elastic = self._undamped(harmonic, frequency, springs) + exciting**2 * inertia.toarray()
        try:
            squares, shapes = lowest_modes(sp.csc_array(elastic), inertia)
        except ValueError:
            return None
        if len(squares) < self.n_dof:
            return None
        natural = np.sqrt(np.maximum(squares, 1e-300))
        _, directions = self._dense(harmonic)
        whole = self.dynamic_stiffness(harmonic, frequency)[0]
        loss = (whole - whole.conj().T) / 2j + weighted(directions.conj().T, losses) @ directions
        width = np.einsum("ik,ij,jk->k", shapes.conj(), loss / exciting, shapes, optimize=True)
        near = np.ones(len(natural), dtype=bool)
        return NearModes(natural - exciting, width.real / 2, near, shapes)
