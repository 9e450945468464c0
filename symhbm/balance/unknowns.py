"""What the unknowns of a balance are: coefficients of degrees of freedom and of contacts."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.balance.equations import Equations
from symhbm.model import Structure, Symmetry
from symhbm.numerics import FloatArray, FourierBasis


class Unknowns:
    """Numbers and meaning of the unknowns of `HarmonicBalance`."""

    model: Structure
    basis: FourierBasis
    symmetry: Symmetry | None
    _equations: Equations

    @property
    def harmonics(self) -> tuple[int, ...]:
        """The harmonics of the response."""
        return self.basis.harmonics

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom that are unknown: all, or those of one sector."""
        return len(self._equations.dofs)

    @property
    def n_contacts(self) -> int:
        """Number of contacts that are located: all, or those of one sector."""
        return len(self._equations.contacts)

    @property
    def n_unknowns(self) -> int:
        """Number of Fourier coefficients."""
        return self.n_dof * self.basis.n_components

    def coefficients(self, unknowns: FloatArray) -> FloatArray:
        """Unknowns as ``(n_dof, n_components)``."""
        return unknowns.reshape(self.n_dof, self.basis.n_components)

    def everywhere(self, unknowns: FloatArray) -> FloatArray:
        """Coefficients of all degrees of freedom of the structure, ``(.., n_components)``.

        ``unknowns`` (..., n_unknowns) may be those of several points.
        """
        whole = unknowns if self.symmetry is None else (self._equations.expansion @ unknowns.T).T
        return whole.reshape(*unknowns.shape[:-1], self.model.n_dof, self.basis.n_components)

    def relative(self, unknowns: FloatArray) -> FloatArray:
        """Coefficients of the relative displacements, ``(n_rows, n_components)`` [m].

        ``unknowns`` (..., n_unknowns) may be those of several points.
        """
        relative = (self._equations.directions @ unknowns.T).T
        shape = self._equations.n_rows, self.basis.n_components
        return relative.reshape(*unknowns.shape[:-1], *shape)

    @property
    def directions(self) -> Any:
        """Sparse matrix from the unknowns to `relative`, flattened."""
        return self._equations.directions

    def expand(self, row: int, coefficients: FloatArray) -> FloatArray:
        """Derivative by the unknowns from that by a displacement's coefficients (n_components,)."""
        size = self.basis.n_components
        return coefficients @ self._equations.directions[row * size : (row + 1) * size]

    def own(self, name: str, values: Any) -> FloatArray:
        """Values of a named parameter of the blades or contacts that are balanced here."""
        array = np.asarray(values, dtype=float)
        if self.symmetry is None or array.ndim == 0:
            return array
        if name in self.model.contact_parameters:
            return self._own(name, array, self.model.group_of(name).contacts)
        return self.symmetry.own_of_dofs(name, array)

    def _own(self, name: str, values: FloatArray, contacts: NDArray[np.intp]) -> FloatArray:
        if self.symmetry is None:
            return values
        return self.symmetry.own_of_contacts(name, values, contacts)
