"""What vibrates, seen from its contacts.

A contact acts on relative displacements ``y = w^T x``, mostly of two degrees of freedom, or of one
and the ground. Contacts of one law are a group; groups may act side by side on the same contacts.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from symhbm.model.contacts import CONTACT_PARAMETERS, ContactGroups, Parameter, weights_of
from symhbm.model.excitation import Excitation, check_whole, static_force
from symhbm.model.linear import displacements
from symhbm.model.mass import dissipates
from symhbm.model.outputs import Output, outputs_of
from symhbm.model.parameters import PARAMETERS, ReadOnly
from symhbm.model.places import NextSector, Place, Places, check_places, number_of
from symhbm.model.records import Record
from symhbm.model.shown import as_table, as_text, rows_of
from symhbm.numerics import ComplexArray, FloatArray, FourierBasis, check

_MATRICES = ("mass_matrix", "damping_matrix", "stiffness_matrix")
AT_REST = FourierBasis((0,))
"""What does not oscillate."""
_INPUTS = {"unknowns", "frequency", "force_shape", "static_force"}
"""What else a balance is compiled for."""


class NearModes(NamedTuple):
    """All modes of a structure with its contacts as springs, ascending, arrays (n_modes,).

    ``detuning``, the natural less the exciting frequency [rad/s]; ``width``, half that of the
    resonance [rad/s]; ``near``, whether a mode is near enough for both to be of it; ``shapes``
    (n_dof, n_near), the motions of those that are, of unit mass.
    """

    detuning: FloatArray
    width: FloatArray
    near: NDArray[np.bool_]
    shapes: FloatArray


class Matrices(NamedTuple):
    """Mass, damping and stiffness matrices of a structure, sparse (n_dof, n_dof)."""

    mass_matrix: Any
    damping_matrix: Any
    stiffness_matrix: Any

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom."""
        return int(self.mass_matrix.shape[0])


class Structure(Record, ABC):
    """A structure by its dynamic stiffness, and its contacts.

    `Model` is one, given by matrices. One of your own derives from this class and tells its
    `dynamic_stiffness`; what else is here has defaults.

    Parameters
    ----------
    n_dof
        Number of degrees of freedom.
    contacts, places, contact_stiffness, friction_coefficient, normal_load, cubic_stiffness
        As of `Model` [N/m, -, N, N/m^3].

    Raises
    ------
    TypeError, ValueError
        As `Model`, for bad contacts.

    Notes
    -----
    Without matrices there are no stability, no exact motion in time, no designs and no
    ``accuracy=``: they say so. Without `modes_below`, resonances that are so narrow that they show
    at neither end of a step of a path can be stepped over. Where the dynamic stiffness has a pole
    that nothing damps, the response passes through zero and a path does not: damp the inside too.

    Examples
    --------
    A rod, clamped at one end, with its force and its damper at the other:

    >>> import numpy as np
    >>> import symhbm as sh
    >>> from symhbm.model import Structure
    >>> class Rod(Structure):  # 1 m long, wave speed 100 m/s, E A = 1e4 N, loss factor 0.02
    ...     def dynamic_stiffness(self, harmonic, frequency):
    ...         speed = 100 * np.sqrt(1 + 0.02j)
    ...         x = max(harmonic * frequency, 1e-6) / speed
    ...         value = 1e4 * (1 + 0.02j) * x / np.tan(x)
    ...         slope = 1e4 * (1 + 0.02j) / speed * (1 / np.tan(x) - x / np.sin(x) ** 2)
    ...         return np.array([[value]]), np.array([[harmonic * slope]])
    >>> rod = Rod(1, [(0,)], contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3)
    >>> response = sh.frf(sh.HarmonicBalance(rod, sh.forces.PointForce()), (10, 40), progress=False)
    >>> response.n_peaks.item()
    1
    """

    contacts: tuple[Any, ...] = ()
    groups: ContactGroups
    contact_stiffness: Any
    friction_coefficient: Any
    normal_load: Any
    cubic_stiffness: Any
    mass_matrix: Any
    damping_matrix: Any
    stiffness_matrix: Any
    _n_dof: int
    WITHOUT_MATRICES = (
        "expected a structure with matrices, this one is given by its dynamic stiffness; sweep its "
        "parameters with over= of frf, or describe it by a Model"
    )
    """What is said where mass, damping and stiffness matrices are needed."""
    has_matrices: bool = False
    """Whether mass, damping and stiffness matrices are known."""
    loss_factor: float = 0.0
    """Loss factor of structural damping."""
    is_polynomial: bool = False
    """Whether it is a ``PolynomialStructure``, which tells its ``powers``."""
    bends: bool = False
    """Whether ``forces_curvature`` is known: maxima over the frequency can be followed."""
    matrix_terms: Mapping[str, tuple[str, dict[int, Any]]] = MappingProxyType({})
    """Parameters that change a matrix: by name which one, and how.

    "mass", "damping" or "stiffness", and by powers of the values (n,) what they add to its stored
    entries, sparse (n_entries, n).
    """
    modal: Any = None
    """Matrices of what is condensed, in coordinates of its modes, None without."""
    inertia: FloatArray | None = None
    """A mass matrix (n_dof, n_dof) [kg] that tells how large inertia forces are, if known."""
    pole_residues: Any = None
    """By harmonic, ``[Z, G]`` as functions with poles, for compiled corrections, if known."""
    engine_order: float | None = None
    """Engine order along which its matrices change with the speed of rotation, None without."""
    speed: float | None = None
    """Speed of rotation [1/min] that all of it is at, None where it is at none alone."""
    frequency: Any = None
    """Band [Hz] that it is made for, None for any."""
    harmonics: Any = None
    """Harmonics that it is made for, None for any."""
    lumped = False
    """Whether every degree of freedom is a blade with parameters of its own."""
    stiffness_of_air: Any = 0
    """The part of the stiffness matrix that forces of air make, which need not be symmetric."""
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
    reduced_from: int | None = None
    """Number of degrees of freedom of the whole one that it is reduced from by its modes."""
    interfaces: Any = None
    """How the sectors of a disk join; None for a whole structure."""
    order: int | None = None
    """Engine order that moves a sector."""
    masters: Any = slice(None)
    """Which of the degrees of freedom of a sector that are not right are there."""
    made_by: str = ""
    """The verb that made it of a whole structure and its contacts, "reduce" or "condense"."""
    stored: ClassVar[Collection[str] | None] = None
    """The attributes that archives hold, None for all that are not computed from others."""

    def __init__(self, n_dof: int, contacts: Any = (), *, places: Any = None, **parameters: Any):
        self._store(_n_dof=check.integer("n_dof", n_dof, minimum=1))
        self._store(places=check_places(places, self.n_dof))
        for name in parameters:
            check.known(name, CONTACT_PARAMETERS, "parameter of contacts")
        self._set_contacts(contacts, **parameters)

    def __getattr__(self, name: str) -> Any:
        if name in _MATRICES:
            raise TypeError(f"{name}: {self.WITHOUT_MATRICES}")
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    @abstractmethod
    def dynamic_stiffness(
        self, harmonic: int, frequency: float
    ) -> tuple[ComplexArray, ComplexArray]:
        """Force over motion in one harmonic, and its derivative by the angular frequency [rad/s].

        Complex, (n_dof, n_dof) [N/m, N s/m], for motions ``Re(x exp(i n omega t))``.
        """

    def _set_contacts(self, contacts: Any, **parameters: Any) -> None:
        self._forget()
        named = self._n_named, contacts, parameters, self.number_of, self._places_of_contacts
        groups = ContactGroups.of(*named)
        self._check_names(groups.owners)
        groups = groups if self.speed is None else groups.at(self.speed)
        self._store(**groups.attributes)

    def _forget(self) -> None:
        """Leave out what was computed from other attributes."""
        for name in CACHED:
            vars(self).pop(name, None)

    def _check_names(self, names: Collection[str]) -> None:
        """Raise ValueError for parameters of contacts whose names are taken."""
        of_structure = {*PARAMETERS, *_INPUTS, *self.matrix_terms}
        for kind in type(self).__mro__:
            of_structure |= {*vars(kind), *vars(kind).get("__annotations__", {})}
        for name in sorted(names):
            if name in of_structure - {*CONTACT_PARAMETERS}:
                raise ValueError(
                    f"contacts: the parameter {name!r} needs a name of its own, a structure or "
                    "what excites it has another one of this name"
                )

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

    def with_contacts(self, **groups: Any) -> Self:
        """Return a copy with these groups of contacts, as `symhbm.Contacts`, and no others.

        Contacts of a sector name places of the next one by `symhbm.next_sector`, or by the columns
        ``n_dof`` to ``2 n_dof - 1`` of arrays of weights. Raises as `Model` does, and TypeError for
        what is reduced or condensed.
        """
        if verb := self.made_by:
            raise TypeError(
                f"with_contacts: expected a whole structure, this one is {verb.rstrip('e')}ed to "
                f"its contacts; {verb} the structure with the others"
            )
        other = self._copy()
        for name in self.groups.owners:
            vars(other).pop(name)
        other._set_contacts(groups)
        return other

    def _copy(self, **changes: Any) -> Self:
        """A copy with other attributes, without what was computed from those before."""
        other = object.__new__(type(self))
        kept = {name: value for name, value in vars(self).items() if name not in CACHED}
        other._store(**kept | changes)
        return other

    def with_outputs(self, outputs: Any, units: Any) -> Self:
        """Return a copy with linear outputs ``S x``, and no others.

        ``outputs`` maps names to the weights S: ``{dof: weight}`` by numbers or names or an array
        (n_dof,) for one value, a list of such mappings or a matrix (n, n_dof), dense or
        `scipy.sparse`, for several. ``units`` is a text, or one by name. On what is reduced or
        condensed, degrees of freedom are those of the whole structure.

        Datasets have ``<name>_amplitude``, ``<name>_peak_to_peak`` and ``<name>_coefficient`` of
        each. Raises TypeError, ValueError or KeyError for bad weights, names and units.
        """
        rows = outputs_of(outputs, units, self.n_numbered, self.number_of)
        return self._seeing({name: output.of(self.seen(output)) for name, output in rows.items()})

    def _seeing(self, outputs: Mapping[str, Output]) -> Self:
        """A copy with outputs of its own degrees of freedom."""
        return self._copy(outputs=dict(outputs))

    def seen(self, output: Output) -> Any:
        """Rows (n_rows, n_dof) of an output over all degrees of freedom that forces name.

        ValueError where it reads what is right of a sector, or not kept.
        """
        rows = output.rows if self.beneath is None else self.beneath.seen(output)
        rows = rows if self._lift is None else rows @ self._lift
        return rows if self.interfaces is None else self.interfaces.seen(output.name, rows)

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
    def n_numbered(self) -> int:
        """How many degrees of freedom have a number that forces and outputs may name."""
        return self.n_whole if self.beneath is None else self.beneath.n_whole

    @property
    def n_contacts(self) -> int:
        """Number of contacts."""
        return len(self.contacts)

    @cached_property
    def records(self) -> dict[str, Parameter]:
        """What each parameter is that not all structures have: those of the contacts."""
        return self.groups.records

    def about(self, name: str) -> Parameter:
        """What a parameter of a structure or an excitation is."""
        return self.records.get(name) or PARAMETERS[name]

    def dims_of(self, name: str) -> tuple[str, ...]:
        """Dimensions of one value of a parameter in a dataset."""
        return self.groups.dims.get(name) or self.about(name).dims

    def dissipates(self, harmonics: Sequence[int]) -> bool:
        """Whether damping gives energy to no motion of some harmonics."""
        if not self.has_matrices:
            return True  # condensed: it did
        return self.of_matrices("dissipates", lambda: dissipates(self.damping_matrix))

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

    def matrices(self, nodal_diameter: int | None = None) -> Matrices:
        """Matrices, of a sector of a disk those of a wave of so many nodal diameters.

        TypeError for a structure without, ValueError for nodal diameters of a whole one.
        """
        if nodal_diameter is not None:
            raise ValueError(
                f"nodal_diameter={check.shown(nodal_diameter)}: expected None, a whole structure "
                "has all of them; a symhbm.Sector has waves"
            )
        return Matrices(*(getattr(self, name) for name in Matrices._fields))

    def without_rule(self) -> Structure:
        """The same without a rule of damping, which its modes do not feel."""
        return self

    def directions_of(self, nodal_diameter: int | None = None) -> Any:
        """Directions (n_rows, n_dof), of a sector of a disk those of a wave, complex."""
        if self.interfaces is None:
            return self.directions
        n = self._wave_of(nodal_diameter)
        return self.interfaces.displacements(n, self._directions_as_named)[:, self.masters]

    def expanded(self, motion: Any, nodal_diameter: int | None = None) -> Any:
        """Motion (n_whole, n) of the whole structure, or of a sector in a wave, from (n_dof, n)."""
        if self.interfaces is not None:
            return self.interfaces.expansion(self._wave_of(nodal_diameter)) @ motion
        motion = motion if self._lift is None else self._lift @ motion
        return motion if self.beneath is None else self.beneath.expanded(motion)

    def directions_in(self, harmonic: int) -> Any:
        """Directions in one harmonic (n_rows, n_dof), complex for a sector of a disk."""
        wave = self.wave(harmonic)
        return self.of_matrices(("directions", wave), lambda: self.directions_of(wave))

    def displacements(self, basis: FourierBasis) -> Any:
        """Coefficients of all displacements from those of all degrees of freedom, flattened."""
        if self.interfaces is not None:
            return displacements(self.directions_in, basis)
        return sp.kron(self.directions, sp.eye_array(basis.n_components))

    def under(self, excitation: Excitation) -> Structure:
        """The structure as an excitation moves it; ValueError for one that does not fit."""
        if self.beneath is not None:
            self.beneath.under(excitation)
            return self
        check_whole(excitation)
        return self.along(excitation)

    def along(self, excitation: Any) -> Self:
        """What it is along the engine order of an excitation, where speed changes it."""
        return self

    @cached_property
    def parameters(self) -> dict[str, FloatArray]:
        """Named parameters: per blade where it has such, and one value per contact."""
        return ReadOnly(self._own_parameters() | self.groups.values)

    def _own_parameters(self) -> dict[str, FloatArray]:
        """Those that are not of contacts."""
        return {}

    def with_parameters(self, **values: ArrayLike) -> Self:
        """Return a copy with other values, one or one per blade or contact, of named parameters.

        Raises KeyError for a name that is no parameter, and as the constructor for bad values.
        """
        return self.with_values({self.parameter_name(name): v for name, v in values.items()})

    def with_values(self, named: Mapping[str, ArrayLike]) -> Self:
        """The same of parameters by what they are called here."""
        # What does not change was checked when this structure was made, and copies share it.
        shared = {*_OF_CONTACTS}
        if {*named} <= {*self.groups.owners}:
            vars(self).setdefault(DENSE, {})
            shared.add(DENSE)
        other = self._copy(**{n: value for n, value in vars(self).items() if n in shared})
        for name, value in named.items():
            other._put(name, value)
        return other

    def of_matrices(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """What is made of the matrices, once for all copies that have the same."""
        known = vars(self).setdefault(DENSE, {})
        if key not in known:
            known[key] = make()
        return known[key]

    def parameter_name(
        self,
        name: str,
        allowed: Collection[str] | None = None,
        what: str = "parameter of this model",
    ) -> str:
        """What a parameter is called here: by its name alone where one group has it.

        Raises KeyError for the name of several, and for none of those ``allowed``, by default of
        all, calling it ``what``.
        """
        allowed = self.parameters if allowed is None else allowed
        if isinstance(name, str):
            if name in allowed:
                return name
            of_groups = [f"{g.name}.{name}" for g in self.groups if name in g.parameters]
            if len(of_groups) > 1:
                several = f"{name!r} is a parameter of several groups; say "
                raise KeyError(several + " or ".join(of_groups))
            group, _, own = name.partition(".")
            alone = [
                g.parameters[own] for g in self.groups if g.name == group and own in g.parameters
            ]
            name = alone[0] if alone else name
        check.known(name, allowed, what)
        return name

    def _put(self, name: str, value: ArrayLike) -> None:
        self._store(**self.groups.with_value(name, value).attributes)

    def _store(self, **values: Any) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def n_whole(self) -> int:
        """Number of degrees of freedom that forces act on: those of the structure beneath."""
        below = self if self.beneath is None else self.beneath
        return self._n_whole or below.n_dof

    @property
    def static_stiffness(self) -> Any:
        """Stiffness at rest, sparse (n_dof, n_dof) [N/m]."""
        return sp.csc_array(self.dynamic_stiffness(0, 0.0)[0].real)

    def check_frequencies(self, name: str, values: ArrayLike) -> None:
        """Raise ValueError for frequencies [Hz] that the structure is not made for."""
        if self.frequency is None:
            return
        low, high = self.frequency
        frequencies = np.asarray(values, dtype=float)
        if frequencies.min() < low or frequencies.max() > high:
            raise ValueError(
                f"{name}={check.shown(values)}: expected frequencies within the band of the "
                f"condensed structure, {low:g} to {high:g} Hz; condense it for a wider one"
            )

    def check_harmonics(self, harmonics: tuple[int, ...]) -> None:
        """Raise ValueError for harmonics that the structure is not made for."""
        if self.harmonics is not None and not {*harmonics} <= {*self.harmonics}:
            raise ValueError(
                f"harmonics={harmonics}: expected harmonics that the structure was condensed "
                f"for, {self.harmonics}"
            )

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

    def constant_part(self, name: str) -> Any:
        """A matrix, "mass", "damping" or "stiffness", without what `matrix_terms` add to it."""
        return getattr(self, f"{name}_matrix")

    def linear_forces(self, harmonic: int, frequency: float) -> tuple[ComplexArray, ComplexArray]:
        """``[Z, G]``, forces by motions and by force patterns, and its derivative by frequency."""
        return self.dynamic_stiffness(harmonic, frequency)

    def modes_below(self, harmonic: int, frequency: float, springs: FloatArray) -> int | None:
        """Number of natural frequencies below a harmonic, with springs at the contacts.

        ``springs`` [N/m]: (n_rows,), one per row of the contacts, or (n_rows, n_rows), which
        couples them. None if nobody knows.
        """
        return None

    def modes_near(
        self, harmonic: int, frequency: float, springs: FloatArray, losses: FloatArray
    ) -> NearModes | None:
        """Modes near a harmonic, with springs and losses [N/m]; None if unknown.

        Each is (n_rows,), one per row of the contacts, or (n_rows, n_rows), which couples them.
        """
        return None

    def fields(self) -> dict[str, Any]:
        """What makes it again, without contacts, outputs and values of parameters."""
        apart = {*CACHED, *_BESIDE, *self.parameters}
        fields = {name: value for name, value in super().fields().items() if name not in apart}
        return {n: v for n, v in fields.items() if self.stored is None or n in self.stored}

    @classmethod
    def of_fields(cls, **fields: Any) -> Self:
        """The structure of its `fields`, without contacts."""
        made = restored(fields, cls)
        made._set_contacts({})
        return made

    def __reduce__(self) -> Any:
        kept = {name: value for name, value in vars(self).items() if name not in CACHED}
        return restored, (kept, type(self))

    def __repr__(self) -> str:
        return as_text(self)

    def _repr_html_(self) -> str:
        return as_table(type(self).__name__, rows_of(self))


class PlacesAlone(Structure):
    """A structure of which nothing is known but its size and its places."""

    WITHOUT_MATRICES = (
        "those of the whole structure are not known to a reduced one; expected "
        "BaseMotion(...).on(structure) with the whole structure"
    )

    def dynamic_stiffness(
        self, harmonic: int, frequency: float
    ) -> tuple[ComplexArray, ComplexArray]:
        """Raise TypeError: nobody knows."""
        raise TypeError("structure: expected the whole structure, its matrices are not known here")


DENSE = "_of_matrices"
"""Where a structure keeps what is made of its matrices."""
_OF_CONTACTS = {"directions", "records"}
"""Attributes that are computed from the contacts, whatever the values of parameters are."""
CACHED = {*_OF_CONTACTS, "parameters", DENSE}
"""Attributes that are computed from the others."""
_BESIDE = {"contacts", "groups", "outputs"}
"""What archives hold of a structure beside its record."""


def restored(values: dict[str, Any], kind: Any) -> Any:
    """The structure of attributes that were checked when it was made; arrays become read-only."""
    for value in values.values():
        array = value.data if sp.issparse(value) else value
        if isinstance(array, np.ndarray):
            array.setflags(write=False)
    structure = object.__new__(kind)
    structure._store(**values)
    return structure


def weighted(columns: NDArray, factors: NDArray) -> NDArray:
    """Columns (n, m) times their factors (m,), or times a matrix (m, m) that couples them."""
    return columns * factors if factors.ndim == 1 else columns @ factors
