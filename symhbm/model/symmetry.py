"""Sectors of a structure that move alike, one after the other.

A tuned disk under an engine order answers with a travelling wave: each sector repeats the motion of
the one before it a share of the period later, so that one of them tells all. The response with
constant normal loads is unique, hence as symmetric as structure and force are, for any harmonics.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.linear import displacements
from symhbm.numerics import FloatArray, FourierBasis


@dataclass(frozen=True)
class Symmetry:
    """Sectors of a structure, the first of which holds the degrees of freedom 0 to ``n_dof - 1``.

    Each of the ``n_sectors`` lags the one before it by ``lag`` turns over their number.
    ``contact_sector`` (n_contacts,) tells in which sector each contact of the whole structure is,
    ``contact_place`` (n_contacts,) which of that sector's it is.
    """

    n_sectors: int
    n_dof: int
    lag: int
    contact_sector: tuple[int, ...]
    contact_place: tuple[int, ...]

    @cached_property
    def contacts(self) -> NDArray[np.intp]:
        """The contacts of the first sector."""
        first = np.flatnonzero(np.array(self.contact_sector, dtype=int) == 0)
        return first[np.argsort(self._places[first])]

    @cached_property
    def _places(self) -> NDArray[np.intp]:
        return np.array(self.contact_place, dtype=int)

    def images(self, contact: int) -> NDArray[np.intp]:
        """The contacts of all sectors that are alike to one of the first."""
        return np.flatnonzero(self._places == contact)

    def wave(self, harmonic: int) -> int:
        """Turns over the number of sectors by which each lags in one harmonic."""
        return self.lag * harmonic % self.n_sectors

    def expansion(self, basis: FourierBasis) -> sp.csr_array:
        """Coefficients of all degrees of freedom from those of the first sector, all flattened."""
        return displacements(lambda harmonic: self.phases(self.wave(harmonic)), basis)

    def phases(self, wave: int) -> sp.csr_array:
        """``a - i b`` of all degrees of freedom from that of the first sector, in a `wave`."""
        sector = np.repeat(np.arange(self.n_sectors), self.n_dof)
        turns = wave * sector % self.n_sectors / self.n_sectors
        entry = np.arange(len(sector)), np.arange(len(sector)) % self.n_dof
        shape = len(sector), self.n_dof
        return sp.csr_array((np.exp(-2j * np.pi * turns), entry), shape=shape)

    def spread_contacts(self, values: np.ndarray) -> np.ndarray:
        """Values (n_contacts of one sector, ...) of all contacts."""
        return values[self._places]

    def contact_lags(self) -> FloatArray:
        """Angle by which each contact of the whole structure lags that of the first sector."""
        sector = np.array(self.contact_sector, dtype=int)
        return 2 * np.pi * (self.lag * sector % self.n_sectors) / self.n_sectors

    def own_of_dofs(self, name: str, values: FloatArray) -> FloatArray:
        """The first sector's values of a parameter of all dofs; ValueError where they differ."""
        chosen = values[: self.n_dof]
        return self._checked(name, values, chosen, np.tile(chosen, self.n_sectors))

    def own_of_contacts(
        self, name: str, values: FloatArray, contacts: NDArray[np.intp]
    ) -> FloatArray:
        """The first sector's values of a parameter of some ``contacts``; ValueError as above."""
        everywhere = np.full(len(self._places), np.nan)
        has_one = np.zeros(len(self._places), dtype=bool)
        everywhere[contacts], has_one[contacts] = values, True
        chosen = everywhere[self.contacts]
        spread = self.spread_contacts(chosen)[contacts]
        return self._checked(name, values, chosen[has_one[self.contacts]], spread)

    def _checked(
        self, name: str, values: FloatArray, chosen: FloatArray, spread: FloatArray
    ) -> FloatArray:
        if not np.array_equal(spread, values):
            raise ValueError(
                f"{name}: expected the same values in each of {self.n_sectors} sectors"
            )
        return chosen
