"""What a force tells the equations of motion, and sums of forces.

An excitation has an ``amplitude`` [N] and a ``shape``, the Fourier coefficients of what oscillates
per degree of freedom at unit amplitude, and a ``static`` part [N] that no amplitude scales.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Self

import numpy as np

from symhbm.model.excitation.values import check_contained, numbered
from symhbm.model.places import Place
from symhbm.model.records import Record
from symhbm.numerics import FloatArray, FourierBasis, check


class Excitation(Record, ABC):
    """A periodic force. Forces add: ``EngineOrder(3) + StaticLoad({0: 20.0})``.

    TypeError for a sum with anything else.
    """

    _fields: ClassVar[dict[str, str]] = {"force_amplitude": "amplitude"}
    _of_places: ClassVar[tuple[str, ...]] = ()
    """Fields that name degrees of freedom."""
    amplitude: float
    """Factor of the shape [N]."""
    units: str = "N"
    """Units of its amplitude."""
    meaning: str = "amplitude of the exciting force"
    """What its amplitude is."""
    changes: bool = False
    """Whether it changes with the frequency at constant amplitude."""

    def __repr__(self) -> str:
        texts = (f"{f.name}={check.brief(getattr(self, f.name))}" for f in fields(self))  # type: ignore[arg-type]
        return f"{type(self).__name__}({', '.join(texts)})"

    @property
    def speed_ratios(self) -> frozenset[float]:
        """Frequencies over the speed of rotation that engine orders in it tell."""
        parts: tuple[Excitation, ...] = getattr(self, "parts", ())
        return frozenset[float]().union(*(part.speed_ratios for part in parts))

    @property
    def parameters(self) -> dict[str, Any]:
        """The named parameters and their values."""
        return {name: getattr(self, attribute) for name, attribute in self._fields.items()}

    def with_parameters(self, **values: Any) -> Self:
        """Return a copy with other values; raises KeyError for a name that is no parameter."""
        for name in values:
            check.known(name, self._fields, "parameter of this excitation")
            if name == "force_amplitude":
                check.scalar(name, values[name])
        return replace(self, **{self._fields[name]: value for name, value in values.items()})  # type: ignore

    @abstractmethod
    def shape(self, n_dof: int, basis: FourierBasis) -> FloatArray:
        """Coefficients at unit amplitude, ``(n_dof, n_components)``; ValueError if they misfit."""

    @property
    def of_matrices(self) -> frozenset[str]:
        """Matrices of the structure that make it, so that it changes with them.

        Of "mass", "damping" and "stiffness".
        """
        return frozenset()

    def shapes(self, structure: Any, basis: FourierBasis) -> dict[int, FloatArray]:
        """Coefficients at unit amplitude by the power of the angular frequency that they go with.

        Each (n_whole, n_components) on the degrees of freedom that forces on a structure name.
        """
        return {0: structure.force_shape(self, basis)}

    def on(self, structure: Any) -> Excitation:
        """The same force with what matrices of a structure make of it."""
        return self

    def along_base(self, translation: Callable[[Any], Any]) -> Excitation:
        """The same force, its motions of the base with where they take a reduced structure."""
        return self

    def with_forces(self, forces: dict[int, Excitation]) -> Excitation:
        """A force that changes by these forces of unit amplitude instead, by powers."""
        raise TypeError(f"{check.shown(self)}: expected a force that changes with the frequency")

    def static(self, n_dof: int) -> FloatArray:
        """What does not oscillate, ``(n_dof,)`` [N]; ValueError if it misfits."""
        return np.zeros(n_dof)

    @property
    def still(self) -> Excitation | None:
        """What of it does not oscillate, as a force of its kind; None where all of it does."""
        return None

    def placed(self, number_of: Callable[[Place], int]) -> Self:
        """The same force with numbers of degrees of freedom for their names.

        ``number_of`` tells the number of a place, or raises KeyError.
        """
        given = {name: getattr(self, name) for name in self._of_places}
        placed = {name: numbered(name, value, number_of) for name, value in given.items()}
        return self if placed == given else replace(self, **placed)  # type: ignore[type-var]

    def __add__(self, other: Excitation) -> ForceSum:
        for force in (self, other):
            if not isinstance(force, Excitation):
                raise TypeError(
                    f"{check.shown(force)}: expected an excitation to add, as "
                    "symhbm.forces.StaticLoad(values)"
                )
        return ForceSum((*_parts(self), *_parts(other)))

    def __radd__(self, other: Any) -> ForceSum:
        return Excitation.__add__(other, self)


class Changing(Excitation):
    """A force that changes with the frequency at constant amplitude."""

    changes = True

    def shape(self, n_dof: int, basis: FourierBasis) -> FloatArray:
        """Raise TypeError: there is no one shape, see `shapes`."""
        raise TypeError(
            "excitation: expected a force of one shape, this one changes with the frequency"
        )


@dataclass(frozen=True, repr=False)
class ForceSum(Excitation):
    """The sum of forces; ``+`` makes it.

    ``amplitude`` [N] is that of the first part that oscillates; the others keep their ratio to it.
    Other parameters are those that one part alone has.
    """

    parts: tuple[Excitation, ...]
    amplitude: float = None  # type: ignore[assignment]

    def __post_init__(self):
        given = self._leading.amplitude if self.amplitude is None else self.amplitude
        object.__setattr__(self, "amplitude", check.scalar("amplitude", given))

    @property
    def _owners(self) -> dict[str, int]:
        """Number of the part that has a parameter, by the names of those that one part has."""
        names = [(name, k) for k, part in enumerate(self.parts) for name in part.parameters]
        count = Counter(name for name, _ in names)
        return {n: k for n, k in names if count[n] == 1 and n != "force_amplitude"}

    @property
    def parameters(self) -> dict[str, Any]:
        """The common amplitude, if anything oscillates, and what one part alone has."""
        of_parts = {name: self.parts[k].parameters[name] for name, k in self._owners.items()}
        oscillates = any("force_amplitude" in part.parameters for part in self.parts)
        return ({"force_amplitude": self.amplitude} if oscillates else {}) | of_parts

    def with_parameters(self, **values: Any) -> Self:
        """Return a copy with other values; raises KeyError for a name that is no parameter."""
        parts, amplitude = [*self.parts], self.amplitude
        for name, value in values.items():
            check.known(name, self.parameters, "parameter of this excitation")
            if name == "force_amplitude":
                amplitude = check.scalar(name, value)
            else:
                k = self._owners[name]
                parts[k] = parts[k].with_parameters(**{name: value})
        return replace(self, parts=tuple(parts), amplitude=amplitude)

    @property
    def _ratios(self) -> list[float]:
        """Amplitudes of the parts over the common one; 1 each where all of them are 0."""
        first = self._leading.amplitude
        return [part.amplitude / first if first else 1.0 for part in self.parts]

    @property
    def scaled(self) -> tuple[Excitation, ...]:
        """The parts with the amplitudes that they have in the sum."""
        if self.amplitude == self._leading.amplitude:
            return self.parts
        return tuple(
            part.with_parameters(force_amplitude=self.amplitude * ratio)
            if "force_amplitude" in part.parameters
            else part
            for part, ratio in zip(self.parts, self._ratios, strict=True)
        )

    def shape(self, n_dof: int, basis: FourierBasis) -> FloatArray:
        """Coefficients at unit amplitude, ``(n_dof, n_components)``; ValueError if they misfit."""
        pairs = zip(self.parts, self._ratios, strict=True)
        return np.sum([ratio * part.shape(n_dof, basis) for part, ratio in pairs], axis=0)

    @property
    def _leading(self) -> Excitation:
        """The first part that has an amplitude."""
        return next((part for part in self.parts if part.amplitude), self.parts[0])

    @property
    def units(self) -> str:  # type: ignore[override]
        """Units of the amplitude of the first part that oscillates."""
        return self._leading.units

    @property
    def meaning(self) -> str:  # type: ignore[override]
        """What the amplitude of the first part that oscillates is."""
        return self._leading.meaning

    @property
    def changes(self) -> bool:  # type: ignore[override]
        """Whether a part changes with the frequency."""
        return any(part.changes for part in self.parts)

    @property
    def of_matrices(self) -> frozenset[str]:
        """Matrices that make any part."""
        return frozenset[str]().union(*(part.of_matrices for part in self.parts))

    def shapes(self, structure: Any, basis: FourierBasis) -> dict[int, FloatArray]:
        """Coefficients at unit amplitude by the power of the angular frequency."""
        if not self.changes:
            return super().shapes(structure, basis)
        result: dict[int, FloatArray] = {}
        for part, ratio in zip(self.parts, self._ratios, strict=True):
            for power, shape in part.shapes(structure, basis).items():
                result[power] = result.get(power, 0.0) + ratio * shape
        return result

    def along_base(self, translation: Callable[[Any], Any]) -> Excitation:
        """The same sum, its motions of the base with where they take a reduced structure."""
        return replace(self, parts=tuple(part.along_base(translation) for part in self.parts))

    def with_forces(self, forces: dict[int, Excitation]) -> Excitation:
        """The first part that changes, by these forces instead."""
        changing = next(part for part in self.scaled if part.changes)
        return replace(changing.with_forces(forces), amplitude=self.amplitude)  # type: ignore

    def on(self, structure: Any) -> Excitation:
        """The same sum with what matrices of a structure make of its parts."""
        return replace(self, parts=tuple(part.on(structure) for part in self.parts))

    def static(self, n_dof: int) -> FloatArray:
        """What does not oscillate, ``(n_dof,)`` [N]; ValueError if it misfits."""
        return np.sum([part.static(n_dof) for part in self.parts], axis=0)

    @property
    def still(self) -> Excitation | None:
        """The sum of what does not oscillate."""
        parts = [part.still for part in self.parts if part.still is not None]
        return sum(parts[1:], parts[0]) if parts else None

    def placed(self, number_of: Callable[[Place], int]) -> Self:
        """The same sum with numbers of degrees of freedom for their names."""
        return replace(self, parts=tuple(part.placed(number_of) for part in self.parts))

    def __repr__(self) -> str:
        return " + ".join(map(repr, self.scaled))


def _parts(force: Excitation) -> tuple[Excitation, ...]:
    return force.scaled if isinstance(force, ForceSum) else (force,)


def check_excitation(name: str, force: object) -> None:
    """Raise TypeError unless it is an excitation."""
    check.instance(name, force, Excitation, "an excitation, as symhbm.forces.PointForce()")


def static_force(force: Excitation, n_dof: int, basis: FourierBasis) -> FloatArray:
    """Its static part (n_dof,) [N]; ValueError if it misfits, or harmonic 0 is left out."""
    static = force.static(n_dof)
    if static.any():
        check_contained(0, basis)
    return static


def force_coefficients(force: Excitation, n_dof: int, basis: FourierBasis) -> FloatArray:
    """Coefficients of all of a force, ``(n_dof, n_components)`` [N]; ValueError if they misfit."""
    result = force.amplitude * force.shape(n_dof, basis)
    static = static_force(force, n_dof, basis)
    if 0 in basis.harmonics:
        result[:, basis.component(0)] += static
    return result
