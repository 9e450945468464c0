"""What the unknowns of a balance are: coefficients of degrees of freedom and of contacts."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from symhbm.numerics import FloatArray, FourierBasis, compact


@dataclass(frozen=True)
class UnknownLayout:
    """Numbers and meaning of the unknowns of a balance.

    ``n_dof`` degrees of freedom of ``n_whole`` are unknown, all or those of one sector;
    ``expansion`` (sparse) gives the coefficients of all from the unknowns, ``directions`` (sparse)
    those of the ``n_rows`` relative displacements.
    """

    basis: FourierBasis
    n_dof: int
    n_whole: int
    n_rows: int
    expansion: Any
    directions: Any

    @cached_property
    def _relative(self) -> Any:
        return compact(self.directions)

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
        whole = unknowns if self.n_dof == self.n_whole else (self.expansion @ unknowns.T).T
        return whole.reshape(*unknowns.shape[:-1], self.n_whole, self.basis.n_components)

    def relative(self, unknowns: FloatArray) -> FloatArray:
        """Coefficients of the relative displacements, ``(n_rows, n_components)`` [m].

        ``unknowns`` (..., n_unknowns) may be those of several points.
        """
        relative = (self._relative @ unknowns.T).T
        return relative.reshape(*unknowns.shape[:-1], self.n_rows, self.basis.n_components)

    def by_unknowns(self, row: int, by_motion: FloatArray) -> FloatArray:
        """Derivatives (..., n_unknowns) from those by one displacement, (..., n_components)."""
        size = self.basis.n_components
        return by_motion @ self.directions[row * size : (row + 1) * size]
