"""A model whose blades deviate from each other, by parameters that its matrices depend on."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from symhbm.model.contacts import Parameter
from symhbm.model.damping import StructuralDamping
from symhbm.model.excitation import Excitation, ForceSum, HarmonicForce, StaticLoad
from symhbm.model.frame import DENSE
from symhbm.model.matrices import Model
from symhbm.model.parameters import records_of_blade_modes
from symhbm.model.structure import Structure
from symhbm.numerics import FloatArray, FourierBasis, check

_SQUARED = {1: 2.0, 2: 1.0}
"""``(1 + d)^2 - 1`` by powers of ``d``."""


class Deviation(NamedTuple):
    """What a parameter of blades changes, one that is 0 of a tuned disk.

    A ``matrix``, "mass" or "stiffness", by a ``part`` of each blade, "mass", "stiffness" or
    "mode_<k>", times the sum of ``powers`` of the parameter with these factors.
    """

    matrix: str
    part: str
    powers: dict[int, float]


_OF_WHOLE_BLADES = {
    "stiffness_deviation": Deviation("stiffness", "stiffness", {1: 1.0}),
    "frequency_deviation": Deviation("stiffness", "stiffness", _SQUARED),
    "mass_deviation": Deviation("mass", "mass", {1: 1.0}),
}


def deviations_of(n_modes: int) -> dict[str, Deviation]:
    """The deviations of blades by the names of the parameters, of ``n_modes`` modes of each."""
    names = enumerate(records_of_blade_modes(n_modes))
    of_modes = {name: Deviation("stiffness", f"mode_{mode}", _SQUARED) for mode, name in names}
    return _OF_WHOLE_BLADES | of_modes


class DeviatingModel(Model):
    """A `Model` with deviations of the stiffness, frequency and mass of each of its blades.

    ``base`` are its tuned matrices by name, "mass", "damping" and "stiffness", sparse, and with
    ``structural`` damping "loss", what the factor makes of the stiffness; ``blades`` by the
    ``part`` of a `Deviation` what it is among the stored entries of the matrix, of each blade,
    sparse (n_entries, n_blades); ``contacts`` as of `Model`, by name.

    Attributes
    ----------
    stiffness_deviation, frequency_deviation, mass_deviation : (n_blades,)
        Those of each blade [-].
    frequency_deviation_0, frequency_deviation_1, .. : (n_blades,)
        Those of the frequencies of the modes of each blade alone [-], where it has any.
    """

    stiffness_deviation: FloatArray
    frequency_deviation: FloatArray
    mass_deviation: FloatArray
    blades: dict[str, Any]
    _base: dict[str, Any]

    def __init__(
        self,
        base: dict[str, Any],
        blades: dict[str, Any],
        contacts: Any,
        structural: StructuralDamping | None = None,
        **values: Any,
    ):
        if structural is not None:
            self._store(damping=structural)
        self._store(lumped=False, blades=blades, _base=base, damping_matrix=base["damping"])
        for name in values:
            what = f"deviation of blades, of which {self.n_blade_modes} modes are kept"
            check.known(name, self.deviations, what)
        self._store(**{name: np.zeros(self.n_blades) for name in self.deviations})
        self._store(**{name: self._checked(name, value) for name, value in values.items()})
        self._check_together()
        self._set_matrices()
        self._set_contacts(contacts)

    def fields(self) -> dict[str, Any]:
        """The tuned matrices, what is the blades' of them, a loss factor and the speed."""
        structural = self.damping
        return dict(base=self._base, blades=self.blades, structural=structural, speed=self.speed)

    @classmethod
    def of_fields(cls, **fields: Any) -> Self:
        """The model of its `fields`, tuned and without contacts."""
        speed = fields.pop("speed")
        made = cls(contacts={}, **fields)
        made._store(speed=speed)
        return made

    @property
    def n_blades(self) -> int:
        """Number of blades."""
        return self.blades["stiffness"].shape[1]

    @property
    def n_blade_modes(self) -> int:
        """Number of modes of each blade alone that deviate by themselves."""
        return sum(part.startswith("mode_") for part in self.blades)

    @property
    def deviations(self) -> dict[str, Deviation]:
        """What each deviation changes, by the name of the parameter."""
        return deviations_of(self.n_blade_modes)

    @cached_property
    def records(self) -> dict[str, Parameter]:
        """What each parameter of the contacts is, and of modes of the blades."""
        return super().records | records_of_blade_modes(self.n_blade_modes)

    def loss_stiffness(self, nodal_diameter: int | None = None) -> Any:
        """What a loss factor makes of the stiffness of the tuned disk, without the air."""
        return self._base["loss"]

    def _own_parameters(self) -> dict[str, FloatArray]:
        """Deviations per blade."""
        own = {name: getattr(self, name) for name in self.deviations}
        return own | super()._own_parameters()

    @property
    def matrix_terms(self) -> dict[str, tuple[str, dict[int, Any]]]:  # type: ignore[override]
        """By deviation the matrix it changes, and its stored entries by powers of it."""
        return {
            name: (matrix, {power: share * self.blades[part] for power, share in powers.items()})
            for name, (matrix, part, powers) in self.deviations.items()
        }

    def constant_part(self, name: str) -> Any:
        """A matrix without deviations, with places for them."""
        return self._base[name]

    def with_values(self, named: Mapping[str, ArrayLike]) -> Self:
        """As of all structures; ValueError also for deviations that leave no stiffness."""
        other = super().with_values(named)
        other._check_together()
        return other

    def _check_together(self) -> None:
        """Raise ValueError where deviations add up to blades, or modes of them, without stiffness.

        Each of them alone leaves some.
        """
        added: dict[str, Any] = {}
        for name, (matrix, part, powers) in self.deviations.items():
            if matrix == "stiffness":
                values = getattr(self, name)
                share = sum(factor * values**power for power, factor in powers.items())
                added[part] = added.get(part, 0.0) + share
        whole = 1.0 + added.pop("stiffness")
        least = whole + np.min([np.zeros(self.n_blades), *added.values()], axis=0)
        if np.any(least <= 0):
            worst = int(np.argmin(least))
            raise ValueError(
                "stiffness_deviation, frequency_deviation: expected those of the blade and of its "
                f"modes to leave some stiffness, with those of blade {worst} it is "
                f"{least[worst]:g} of the tuned one"
            )

    def _put(self, name: str, value: ArrayLike) -> None:
        if name not in self.deviations:
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
        changed = {of: self._base[of].data.copy() for of in ("mass", "stiffness")}
        for name, (of, terms) in self.matrix_terms.items():
            for power, entries in terms.items():
                changed[of] += entries @ getattr(self, name) ** power
        for of, data in changed.items():
            data.setflags(write=False)
            base = self._base[of]
            matrix = sp.csc_array((data, base.indices, base.indptr), shape=base.shape)
            self._store(**{f"{of}_matrix": matrix})
        vars(self).pop(DENSE, None)


def force_as_felt(model: Structure, excitation: Excitation, basis: FourierBasis) -> Excitation:
    """An excitation as the degrees of freedom of a structure feel it."""
    if isinstance(excitation, ForceSum):
        parts = [force_as_felt(model, part, basis) for part in excitation.parts]
        return replace(sum(parts[1:], parts[0]), amplitude=excitation.amplitude)  # type: ignore
    shapes = model.felt_shapes(excitation, basis)
    mean = model.felt_static(excitation, basis)
    if "force_amplitude" not in excitation.parameters:
        return StaticLoad(mean)
    if not excitation.changes:
        return _harmonic(shapes[0], basis, excitation.amplitude, mean if mean.any() else None)
    forces: dict[int, Excitation] = {
        power: _harmonic(shape, basis) for power, shape in shapes.items()
    }
    felt = excitation.with_forces(forces)
    return felt + StaticLoad(mean) if mean.any() else felt


def _harmonic(
    shape: FloatArray, basis: FourierBasis, amplitude: float = 1.0, mean: Any = None
) -> HarmonicForce:
    """The force of coefficients (n_dof, n_components) at unit amplitude."""
    tables: tuple[dict[int, FloatArray], dict[int, FloatArray]] = {}, {}
    for harmonic in basis.harmonics[int(basis.harmonics[0] == 0) :]:
        for table, sine in zip(tables, (False, True), strict=True):
            table[harmonic] = shape[:, basis.component(harmonic, sine)]
    return HarmonicForce(*tables, amplitude, mean)
