"""The balance at one point: its unknowns, what they tell, states of contacts, and residuals."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.contacts import Located
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


@dataclass(frozen=True)
class Observed:
    """Coefficients of the displacements that are unknown, or of an output, from the unknowns.

    ``rows`` (n, n_dof of the structure) are those of an output, None for displacements.
    """

    layout: UnknownLayout
    rows: Any = None

    @cached_property
    def _matrix(self) -> Any:
        """The coefficients by the unknowns, sparse."""
        if self.rows is None:
            return sp.csr_array(sp.eye_array(self.layout.n_unknowns))
        each = sp.kron(self.rows, sp.eye_array(self.layout.basis.n_components))
        return sp.csr_array(each @ self.layout.expansion)

    @property
    def n(self) -> int:
        """How many quantities there are."""
        return self.layout.n_dof if self.rows is None else self.rows.shape[0]

    def of(self, unknowns: FloatArray) -> FloatArray:
        """Coefficients (.., n, n_components) from unknowns (.., n_unknowns)."""
        values = unknowns
        if self.rows is not None:
            values = (self._matrix @ unknowns.reshape(-1, self.layout.n_unknowns).T).T
        return values.reshape(*unknowns.shape[:-1], self.n, self.layout.basis.n_components)

    def by_unknowns(self, row: int) -> Any:
        """Coefficients of one quantity by the unknowns, sparse (n_components, n_unknowns)."""
        size = self.layout.basis.n_components
        return self._matrix[row * size : (row + 1) * size]

    @property
    def scale(self) -> float:
        """Bound of the quantities over the size of the response."""
        if self.rows is None:
            return 1.0
        return float(np.sqrt(self._matrix.power(2).sum(axis=1).max()))


@dataclass(frozen=True)
class ContactStates:
    """Events of all contacts by group.

    Switches are numbered group by group and contact by contact.
    """

    groups: dict[str, Located]

    @cached_property
    def switches(self) -> NDArray[np.bool_]:
        """Whether each switch is on, (n_switches,)."""
        return _joined([located.states for located in self.groups.values()], bool)

    @cached_property
    def margins(self) -> FloatArray:
        """Margins of the switches, (n_switches,)."""
        return _joined([located.margins for located in self.groups.values()], float)

    def split(self, count: int) -> list["ContactStates"]:
        """The events of ``count`` points of as many contacts each."""
        parts = {name: _split(located, count) for name, located in self.groups.items()}
        return [
            ContactStates({name: of_group[i] for name, of_group in parts.items()})
            for i in range(count)
        ]


def _joined(parts: Sequence[np.ndarray], kind: type) -> np.ndarray:
    if len(parts) == 1:
        return parts[0].ravel()
    return np.concatenate([np.zeros(0, kind), *(part.ravel() for part in parts)])


def _split(located: Located, count: int) -> list[Located]:
    """The same contacts at ``count`` points."""
    *arrays, details = located
    details = [None] * count if details is None else details.split(count)
    parts = zip(*(np.split(array, count) for array in arrays), details, strict=True)
    return [Located(*part) for part in parts]


@dataclass(frozen=True)
class Evaluation:
    """The equations at one point: residual and derivatives.

    ``residual`` (n_unknowns,) [N]; ``magnitude``, the largest sum of the absolute force terms of
    one equation [N]; ``jacobian`` by the unknowns [N/m], dense or sparse by size;
    ``by_parameter`` (n_unknowns,), the derivative by the moving parameter, for
    `HarmonicBalance.evaluate` the angular frequency [N s]; ``states``, the events of the
    contacts; ``margins_by_parameter`` (n_switches,), the derivative of the margins of their
    switches by the moving parameter at constant unknowns.
    """

    residual: FloatArray
    magnitude: float
    jacobian: Any
    by_parameter: FloatArray
    states: ContactStates
    margins_by_parameter: FloatArray | float = 0.0

    @cached_property
    def norm(self) -> float:
        """Largest residual relative to the largest sum of absolute force terms."""
        largest = float(np.abs(self.residual).max())
        return largest / self.magnitude if self.magnitude > 0 else largest
