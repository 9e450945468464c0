"""What vibrates: a dynamic stiffness on degrees of freedom with contacts, and its parameters."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar, Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from symhbm.model.contacts import ContactGroups, Parameter
from symhbm.model.frame import CACHED, DENSE, OF_CONTACTS, Frame, restored
from symhbm.model.linear import Matrices, NearModes, dissipates
from symhbm.model.outputs import Output, outputs_of
from symhbm.model.parameters import CONTACT_PARAMETERS, PARAMETERS, SHORT, ReadOnly
from symhbm.model.shown import as_table, as_text, rows_of
from symhbm.numerics import ComplexArray, FloatArray, check

_MATRICES = ("mass_matrix", "damping_matrix", "stiffness_matrix")
_INPUTS = {"unknowns", "frequency", "force_shape", "static_force"}
"""What else a balance is compiled for."""
_BESIDE = {"contacts", "groups", "outputs"}
"""What archives hold of a structure beside its record."""


class Structure(Frame, ABC):
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

    contact_stiffness: Any
    friction_coefficient: Any
    normal_load: Any
    cubic_stiffness: Any
    mass_matrix: Any
    damping_matrix: Any
    stiffness_matrix: Any
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
    reduced_from: int | None = None
    """Number of degrees of freedom of the whole one that it is reduced from by its modes."""
    made_by: str = ""
    """The verb that made it of a whole structure and its contacts, "reduce" or "condense"."""
    stored: ClassVar[Collection[str] | None] = None
    """The attributes that archives hold, None for all that are not computed from others."""

    def __init__(self, n_dof: int, contacts: Any = (), *, places: Any = None, **parameters: Any):
        super().__init__(n_dof, places=places)
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
        known = self.number_of, self._places_of_contacts
        groups = ContactGroups.of(self._n_named, contacts, parameters, SHORT, *known)
        self._check_names(groups.owners)
        groups = groups if self.speed is None else groups.at(self.speed)
        self._store(**groups.attributes)

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
        shared = {*OF_CONTACTS}
        if {*named} <= {*self.groups.owners}:
            vars(self).setdefault(DENSE, {})
            shared.add(DENSE)
        other = self._copy(**{n: value for n, value in vars(self).items() if n in shared})
        for name, value in named.items():
            other._put(name, value)
        return other

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

    def dynamic_stiffness(self, harmonic: int, frequency: float) -> Any:
        """Raise TypeError: nobody knows."""
        raise TypeError("structure: expected the whole structure, its matrices are not known here")
