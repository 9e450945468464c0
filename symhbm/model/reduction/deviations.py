"""A model whose blades deviate from each other, by parameters that its matrices depend on."""

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from symhbm.model.excitation import Excitation, HarmonicForce
from symhbm.model.matrices import Model
from symhbm.model.structure import DENSE, Structure
from symhbm.numerics import FloatArray, FourierBasis, check

DEVIATIONS = ("stiffness_deviation", "frequency_deviation", "mass_deviation")
"""Parameters of blades, 0 of a tuned disk."""
_POWERS = {
    "stiffness_deviation": ("stiffness", {1: 1.0}),
    "frequency_deviation": ("stiffness", {1: 2.0, 2: 1.0}),
    "mass_deviation": ("mass", {1: 1.0}),
}
"""The matrix that each changes, and the share of what is the blade's by powers of it."""


class DeviatingModel(Model):
    """A `Model` with deviations of the stiffness, frequency and mass of each of its blades.

    ``base`` are its tuned matrices by name, "mass", "damping" and "stiffness", sparse; ``blades``
    by "mass" and "stiffness" what one blade adds to the stored entries of such a matrix for a
    deviation of 1, sparse (n_entries, n_blades); ``contacts`` as of `Model`, by name.

    Attributes
    ----------
    stiffness_deviation, frequency_deviation, mass_deviation : (n_blades,)
        Those of each blade [-].
    """

    stiffness_deviation: FloatArray
    frequency_deviation: FloatArray
    mass_deviation: FloatArray
    blades: dict[str, Any]
    _base: dict[str, Any]

    def __init__(self, base: dict[str, Any], blades: dict[str, Any], contacts: Any, **values: Any):
        self._store(lumped=False, blades=blades, _base=base, damping_matrix=base["damping"])
        self._store(**{name: np.zeros(self.n_blades) for name in DEVIATIONS})
        self._store(**{name: self._checked(name, value) for name, value in values.items()})
        self._set_matrices()
        self._set_contacts(contacts)

    @property
    def numbers(self) -> None:
        """None: its parameters change the matrices."""
        return None

    @property
    def n_blades(self) -> int:
        """Number of blades."""
        return self.blades["stiffness"].shape[1]

    @property
    def parameters(self) -> dict[str, FloatArray]:
        """Named parameters: deviations per blade, and those of the contacts."""
        return {name: getattr(self, name) for name in DEVIATIONS} | super().parameters

    @property
    def matrix_terms(self) -> dict[str, tuple[str, dict[int, Any]]]:
        """By deviation the matrix it changes, and its stored entries by powers of it."""
        return {
            name: (of, {power: share * self.blades[of] for power, share in powers.items()})
            for name, (of, powers) in _POWERS.items()
        }

    def constant_part(self, name: str) -> Any:
        """A matrix without deviations, with places for them."""
        return self._base[name]

    def _put(self, name: str, value: ArrayLike) -> None:
        if name not in DEVIATIONS:
            super()._put(name, value)
            return
        self._store(**{name: self._checked(name, value)})
        self._set_matrices()

    def _checked(self, name: str, value: ArrayLike) -> FloatArray:
        values = check.one_or_each(name, value, self.n_blades, "blade", "any")
        if np.any(values <= -1):
            worst = int(np.argmin(values))
            raise ValueError(
                f"{name}: expected values above -1, that of blade {worst} is {values[worst]:g}"
            )
        return values

    def _set_matrices(self) -> None:
        changed = {of: self._base[of].data.copy() for of in self.blades}
        for name, (of, terms) in self.matrix_terms.items():
            for power, entries in terms.items():
                changed[of] += entries @ getattr(self, name) ** power
        for of, data in changed.items():
            data.setflags(write=False)
            base = self._base[of]
            matrix = sp.csc_array((data, base.indices, base.indptr), shape=base.shape)
            self._store(**{f"{of}_matrix": matrix})
        vars(self).pop(DENSE, None)


def force_as_felt(model: Structure, excitation: Excitation, basis: FourierBasis) -> HarmonicForce:
    """An excitation as the degrees of freedom of a structure feel it."""
    shape, tables = model.felt_shape(excitation, basis), ({}, {})
    for harmonic in basis.harmonics[int(basis.harmonics[0] == 0) :]:
        for table, sine in zip(tables, (False, True), strict=True):
            table[harmonic] = shape[:, basis.component(harmonic, sine)]
    cosine, sine = tables
    mean = model.felt_static(excitation, basis)
    return HarmonicForce(cosine, sine, excitation.amplitude, mean if mean.any() else None)
