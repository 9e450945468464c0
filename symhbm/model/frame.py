"""Where degrees of freedom are: contacts on them, places, and the whole that forces name.

A contact acts on relative displacements ``y = w^T x``, mostly of two degrees of freedom, or of one
and the ground. Forces and outputs are those of the whole: of the structure that one was reduced or
condensed from, of all sectors of a disk.
"""

from collections.abc import Callable, Hashable, Mapping
from functools import cached_property
from types import MappingProxyType
from typing import Any, Self

import numpy as np
import scipy.sparse as sp

from symhbm.model.contacts import ContactGroups, weights_of
from symhbm.model.excitation import Excitation, check_whole, static_force
from symhbm.model.linear import displacements
from symhbm.model.outputs import Output
from symhbm.model.places import NextSector, Place, Places, check_places, number_of
from symhbm.model.records import Record
from symhbm.numerics import FloatArray, FourierBasis, check

AT_REST = FourierBasis((0,))
"""What does not oscillate."""
DENSE = "_of_matrices"
"""Where a structure keeps what is made of its matrices."""
OF_CONTACTS = {"directions", "records"}
"""Attributes that are computed from the contacts, whatever the values of parameters are."""
CACHED = {*OF_CONTACTS, "parameters", DENSE}
"""Attributes that are computed from the others."""


class Frame(Record):
    """Degrees of freedom with contacts, and how they feel the forces of the whole.

    Parameters
    ----------
    n_dof
        Number of degrees of freedom.
    places
        Where they are, as of `symhbm.Model`.
    """

    contacts: tuple[Any, ...] = ()
    groups: ContactGroups
    _n_dof: int
    places: Any = None
    """Where its degrees of freedom are, as `Places`, if known."""
    outputs: Mapping[str, Output] = MappingProxyType({})
    """Its linear outputs by name."""
    beneath: Any = None
    """The structure that forces and outputs are of, None where they are of this one."""
    _lift: Any = None
    """Motion of the structure beneath by that of this one, (n_whole, n_dof), None for the same."""
    _n_whole: int | None = None
    """Number of degrees of freedom that forces act on, where nothing beneath tells it."""
    kept: Any = None
    """Numbers of the degrees of freedom in the structure this one was made from, if any."""
    interfaces: Any = None
    """How the sectors of a disk join; None for a whole structure."""
    order: int | None = None
    """Engine order that moves a sector."""
    masters: Any = slice(None)
    """Which of the degrees of freedom of a sector that are not right are there."""

    def __init__(self, n_dof: int, *, places: Any = None):
        self._store(_n_dof=check.integer("n_dof", n_dof, minimum=1))
        self._store(places=check_places(places, self.n_dof))

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom."""
        return self._n_dof

    def number_of(self, place: Place) -> int:
        """The number of a degree of freedom that contacts and forces may act on.

        ``place`` is a number, or a name as ``"tip:y"`` where the structure has places. Raises
        KeyError for unknown names, ValueError for numbers out of range.
        """
        if isinstance(place, NextSector):
            if self.interfaces is None:
                raise TypeError(
                    f"{place!r}: only a symhbm.Sector has a next one; give it these contacts"
                )
            return self.n_whole + self.number_of(place.place)
        if self.beneath is not None:
            return self.beneath.number_of(place)
        return number_of(self.places, place, self.n_whole)

    @property
    def n_whole(self) -> int:
        """Number of degrees of freedom that forces act on: those of the structure beneath."""
        below = self if self.beneath is None else self.beneath
        return self._n_whole or below.n_dof

    @property
    def n_numbered(self) -> int:
        """How many degrees of freedom have a number that forces and outputs may name."""
        return self.n_whole if self.beneath is None else self.beneath.n_whole

    @property
    def _n_named(self) -> int:
        """How many degrees of freedom contacts may name, of a sector those of the next one too."""
        return self.n_dof if self.interfaces is None else 2 * self.n_whole

    @property
    def _places_of_contacts(self) -> Places | None:
        """Where the degrees of freedom are that contacts may name, None where it is not known."""
        if self.interfaces is not None:
            return self.beneath.places
        known = self.places is not None and self.places.n_dof == self._n_named
        return self.places if known else None

    @property
    def n_contacts(self) -> int:
        """Number of contacts."""
        return len(self.contacts)

    @property
    def contact_coordinates(self) -> FloatArray:
        """Where contacts are, amid the nodes that they act on, (n_contacts, 3) [m].

        Of one to the next sector amid those in this one.
        """
        if self._lift is not None and self.beneath is not None and self.beneath.contacts:
            return self.beneath.contact_coordinates  # degrees of freedom here are displacements
        places = self._places_of_contacts
        assert places is not None
        assert places.coordinates is not None
        result = np.zeros((self.n_contacts, 3))
        for j, rows in enumerate(self.groups.rows):
            named = {dof for row in rows for dof in weights_of(self.groups.row_ends[row])[0]}
            inside = {dof for dof in named if dof < places.n_dof} or named
            dofs = np.array(sorted(inside)) % places.n_dof
            _, first = np.unique(places.node[dofs], return_index=True)
            result[j] = places.coordinates[dofs][first].mean(axis=0)
        return result

    @property
    def touched(self) -> set[int]:
        """Degrees of freedom that contacts act on, of a sector those that are not right."""
        if self.interfaces is not None:
            return self.interfaces.touched(self._directions_as_named)
        return {dof for ends in self.groups.row_ends for dof in weights_of(ends)[0]}

    @cached_property
    def directions(self) -> sp.csr_array:
        """Directions ``w`` of all displacements as rows, shape ``(n_rows, n_dof)``.

        Of a sector of a disk they are those of a constant motion.
        """
        return self._directions_as_named if self.interfaces is None else self.directions_of(0)

    @property
    def _directions_as_named(self) -> sp.csr_array:
        return self.groups.directions(self._n_named)

    @property
    def nodal_diameters(self) -> Any:
        """Nodal diameters that differ, 0 to N / 2, of a sector; None for a whole structure."""
        return None if self.interfaces is None else range(self.interfaces.n_sectors // 2 + 1)

    def wave(self, harmonic: int) -> Any:
        """Nodal diameters of a harmonic, 0 to N - 1, of a sector; None for a whole structure.

        ValueError for a sector under no engine order.
        """
        if self.interfaces is None:
            return None
        if self.order is None and harmonic:
            raise ValueError("order=None: expected a sector under an engine order")
        return harmonic * (self.order or 0) % self.interfaces.n_sectors

    def _wave_of(self, nodal_diameter: int | None) -> int:
        if nodal_diameter is None:
            raise ValueError(
                "nodal_diameter=None: expected a number of nodal diameters, a sector moves in waves"
            )
        return check.integer("nodal_diameter", nodal_diameter) % self.interfaces.n_sectors

    def directions_of(self, nodal_diameter: int | None = None) -> Any:
        """Directions (n_rows, n_dof), of a sector of a disk those of a wave, complex."""
        if self.interfaces is None:
            return self.directions
        n = self._wave_of(nodal_diameter)
        return self.interfaces.displacements(n, self._directions_as_named)[:, self.masters]

    def directions_in(self, harmonic: int) -> Any:
        """Directions in one harmonic (n_rows, n_dof), complex for a sector of a disk."""
        wave = self.wave(harmonic)
        return self.of_matrices(("directions", wave), lambda: self.directions_of(wave))

    def displacements(self, basis: FourierBasis) -> Any:
        """Coefficients of all displacements from those of all degrees of freedom, flattened."""
        if self.interfaces is not None:
            return displacements(self.directions_in, basis)
        return sp.kron(self.directions, sp.eye_array(basis.n_components))

    def seen(self, output: Output) -> Any:
        """Rows (n_rows, n_dof) of an output over all degrees of freedom that forces name.

        ValueError where it reads what is right of a sector, or not kept.
        """
        rows = output.rows if self.beneath is None else self.beneath.seen(output)
        rows = rows if self._lift is None else rows @ self._lift
        return rows if self.interfaces is None else self.interfaces.seen(output.name, rows)

    def expanded(self, motion: Any, nodal_diameter: int | None = None) -> Any:
        """Motion (n_whole, n) of the whole structure, or of a sector in a wave, from (n_dof, n)."""
        if self.interfaces is not None:
            return self.interfaces.expansion(self._wave_of(nodal_diameter)) @ motion
        motion = motion if self._lift is None else self._lift @ motion
        return motion if self.beneath is None else self.beneath.expanded(motion)

    def force_shape(self, excitation: Any, basis: FourierBasis) -> FloatArray:
        """Coefficients of an excitation of unit amplitude, (n_whole, n_components)."""
        if self.beneath is not None:
            return self.beneath.felt(self.beneath.force_shape(excitation, basis), basis)
        return excitation.shape(self.n_whole, basis)

    def force_shapes(self, excitation: Any, basis: FourierBasis) -> dict[int, FloatArray]:
        """Coefficients (n_whole, n_components) of an excitation of unit amplitude.

        By the power of the angular frequency that they go with, 0 where they do not change.
        """
        if self.beneath is not None:
            return self.beneath.felt_shapes(excitation, basis)
        return excitation.shapes(self, basis)

    def static_load(self, excitation: Any, basis: FourierBasis = AT_REST) -> FloatArray:
        """What of an excitation does not oscillate, (n_whole,) [N].

        ValueError for one that is not 0 where a basis leaves out harmonic 0.
        """
        if self.beneath is not None:
            return self.beneath.felt_static(excitation, basis)
        return static_force(excitation, self.n_whole, basis)

    def split_force(
        self, shape: FloatArray, basis: FourierBasis
    ) -> list[tuple[FloatArray, FloatArray]]:
        """Coefficients (n_whole, n_components) of a force, harmonic by harmonic.

        On the degrees of freedom (n_dof, 1 or 2), and shares of known patterns (n_patterns, ..).
        """
        parts = zip(basis.harmonics, basis.by_harmonic(shape), strict=True)
        largest = float(np.abs(shape).max(initial=0.0))
        return [self._split(part, harmonic, largest) for harmonic, part in parts]

    def _split(
        self, part: FloatArray, harmonic: int, largest: float
    ) -> tuple[FloatArray, FloatArray]:
        """One harmonic (n_whole, 1 or 2) of a force whose ``largest`` coefficient is told."""
        if self.interfaces is not None:
            part = self.interfaces.felt(part, self.wave(harmonic), harmonic)
        elif self._lift is not None:
            part = self._lift.T @ part
        return part, np.zeros((0, part.shape[1]))

    def felt(self, shape: FloatArray, basis: FourierBasis) -> FloatArray:
        """A force (n_whole, n_components) as the degrees of freedom feel it."""
        return np.hstack([own for own, _ in self.split_force(shape, basis)])

    def felt_static(self, excitation: Any, basis: FourierBasis = AT_REST) -> FloatArray:
        """The static part of an excitation as the degrees of freedom feel it, (n_dof,) [N]."""
        return self.felt(self.static_load(excitation, basis)[:, None], AT_REST)[:, 0]

    def felt_coefficients(
        self, excitation: Any, basis: FourierBasis, frequency: float
    ) -> FloatArray:
        """All of an excitation as the degrees of freedom feel it, (n_dof, n_components) [N].

        ``frequency`` in rad/s.
        """
        shapes = self.felt_shapes(excitation, basis).items()
        result = excitation.amplitude * sum(frequency**power * shape for power, shape in shapes)
        static = self.felt_static(excitation, basis)
        if 0 in basis.harmonics:
            result[:, basis.component(0)] += static
        return result

    def felt_shapes(self, excitation: Any, basis: FourierBasis) -> dict[int, FloatArray]:
        """What `force_shapes` tells, as the degrees of freedom feel it."""
        shapes = self.force_shapes(excitation, basis).items()
        return {power: self.felt(shape, basis) for power, shape in shapes}

    def as_felt(self, excitation: Any, basis: FourierBasis) -> Any:
        """An excitation that a structure of the same matrices alone takes, for its archive."""
        return excitation

    def under(self, excitation: Excitation) -> Self:
        """The structure as an excitation moves it; ValueError for one that does not fit."""
        if self.beneath is not None:
            self.beneath.under(excitation)
            return self
        check_whole(excitation)
        return self.along(excitation)

    def along(self, excitation: Any) -> Self:
        """What it is along the engine order of an excitation, where speed changes it."""
        return self

    def of_matrices(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """What is made of the matrices, once for all copies that have the same."""
        known = vars(self).setdefault(DENSE, {})
        if key not in known:
            known[key] = make()
        return known[key]

    def _copy(self, **changes: Any) -> Self:
        """A copy with other attributes, without what was computed from those before."""
        other = object.__new__(type(self))
        kept = {name: value for name, value in vars(self).items() if name not in CACHED}
        other._store(**kept | changes)
        return other

    def _store(self, **values: Any) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def _forget(self) -> None:
        """Leave out what was computed from other attributes."""
        for name in CACHED:
            vars(self).pop(name, None)

    def __reduce__(self) -> Any:
        kept = {name: value for name, value in vars(self).items() if name not in CACHED}
        return restored, (kept, type(self))


def restored(values: dict[str, Any], kind: Any) -> Any:
    """The structure of attributes that were checked when it was made; arrays become read-only."""
    for value in values.values():
        array = value.data if sp.issparse(value) else value
        if isinstance(array, np.ndarray):
            array.setflags(write=False)
    structure = object.__new__(kind)
    structure._store(**values)
    return structure
