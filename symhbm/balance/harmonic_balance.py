"""The multi-harmonic balance equations, Eq. (9), compiled once for every parameter set."""

from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.balance.contacts import BalancedContacts, BalancedGroup, balanced_groups
from symhbm.balance.dynamic_stiffness import DynamicStiffness
from symhbm.balance.equations import Equations, identifier
from symhbm.balance.evaluation import ContactStates, Evaluation, UnknownLayout
from symhbm.balance.goals import Goal
from symhbm.balance.linear_part import MATRIX_INPUTS, is_symbolic
from symhbm.model import (
    PARAMETERS,
    EngineOrder,
    Excitation,
    Model,
    ReadOnly,
    StaticLoad,
    Structure,
    Symmetry,
    amplitude_of,
    as_table,
    check_excitation,
    find_symmetry,
    rows_of,
)
from symhbm.model.contacts import ContactLaw, NormalLaw, Parameter
from symhbm.model.cyclic import check_speed
from symhbm.numerics import FloatArray, FourierBasis, check, check_harmonics

LARGE = 100_000
"""Entries of a stiffness matrix from which compiling it takes longer (5 s) than condensing it."""
MANY = 400
"""Unknowns from which second derivatives and stability take minutes, or are not computed."""
_FEW = 4
"""Degrees of freedom for each one that contacts touch, from which condensing is worth it."""


class _Linear(NamedTuple):
    """What copies of a problem share of a structure under an excitation of unit amplitude.

    ``structure`` is None where its matrices are compiled: then the force has ``shapes`` (n_dof,
    n_components) by ascending powers of the frequency and a ``static`` part (n_dof,).
    """

    structure: DynamicStiffness | None
    shapes: dict[int, FloatArray]
    static: FloatArray

    @classmethod
    def of(cls, model: Structure, excitation: Excitation, basis: FourierBasis) -> "_Linear":
        check_speed(model, excitation)
        if not is_symbolic(model, basis):
            structure = DynamicStiffness(model, excitation, basis)
            return cls(structure, {0: np.zeros((0, 0))}, np.zeros(0))
        shapes = dict(sorted(model.felt_shapes(excitation, basis).items()))
        return cls(None, shapes, model.felt_static(excitation, basis))


class _Given(NamedTuple):
    """What makes a problem. What is ``shared`` by its copies is made once.

    ``active`` are groups of contacts that are compiled though they may do nothing.
    """

    model: Structure
    excitation: Excitation
    basis: FourierBasis
    samples: int | None
    symmetry: Symmetry | None
    peaks_of: str | Goal | None
    by_sector: bool
    shared: dict[tuple, Any]
    linear: _Linear | None = None
    active: frozenset[str] = frozenset()


class HarmonicBalance:
    """Multi-harmonic balance of a model under an excitation, Eq. (9).

    Parameters
    ----------
    model, excitation
        What vibrates, and what drives it; None for a structure whose free motions are looked for.
    harmonics
        Harmonics of the response, for example ``(1,)``, ``(1, 3, 5)`` or ``(0, 1, 2, 3)``. By
        default the first, with the mean where contacts or static loads make one.
    samples
        March the friction law over so many samples of the period (alternating frequency and time)
        instead of locating its switching angles: a cross-check, with a sampling error that
        results state.
    peaks_of
        The output of the model, by name, whose peaks are looked for in place of those of
        displacements, see `symhbm.Model.with_outputs`; or a goal, one of ``symhbm.goals``.
    by_sector
        Solve one sector where all of them move alike (a tuned disk under an engine order), and give
        the results of all ``n_sectors``. False solves all sectors: a cross-check.
    symmetry
        Balance the first of the sectors that `symhbm.model.find_symmetry` tells: the unknowns
        are its coefficients alone, the contacts its own.

    Raises
    ------
    TypeError, ValueError
        For a bad harmonic set, an excitation that does not fit the model or the set, or samples
        too few for the harmonics.

    Attributes
    ----------
    layout
        What the unknowns are, see `symhbm.balance.UnknownLayout`.
    groups
        The groups of contacts as they are balanced.
    contacts
        Those that do something, see `symhbm.balance.BalancedContacts`.

    Notes
    -----
    The unknowns are the Fourier coefficients [m], degree of freedom by degree of freedom,
    component by component within one. ``residual`` is one CasADi function of the unknowns, the
    angular frequency [rad/s] and all physical parameters; ``mass``, ``damping`` and ``stiffness``
    are the stored entries of the matrices in column order, which for a lumped model is one value
    per blade. Its inputs ``events_of_<group>`` are the located events of contacts.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> problem.with_parameters(normal_load=5, force_amplitude=2.0).parameters["normal_load"]
    array([5.])
    """

    def __init__(
        self,
        model: Structure,
        excitation: Excitation | None = None,
        harmonics: Iterable[int] | None = None,
        samples: int | None = None,
        symmetry: Symmetry | None = None,
        peaks_of: str | Goal | None = None,
        by_sector: bool = True,
    ):
        if not isinstance(model, Structure):
            raise TypeError(f"model={check.shown(model)}: expected a Model")
        if excitation is None:
            excitation = nothing_on(model)
        check_excitation("excitation", excitation)
        excitation = excitation.placed(model.number_of)
        model = model.under(excitation)
        if harmonics is None:
            moves_mean = not model.groups.odd or model.static_load(excitation).any()
            harmonics = (0, 1) if moves_mean else (1,)
        basis = FourierBasis(check_harmonics(harmonics))
        if samples is not None:
            samples = check.integer("samples", samples, minimum=2 * basis.highest + 1)
        if symmetry is not None and not model.has_matrices:
            raise ValueError("symmetry: expected None for a structure without matrices")
        if isinstance(model, Model):
            _check_entries(model)
            _advise(model)
        _check_peaks_of(peaks_of, model, basis.harmonics)
        by_sector = check.flag("by_sector", by_sector)
        given = model, excitation, basis, samples, symmetry, peaks_of, by_sector
        self._set(_Given(*given, shared={}))
        _ = self.contacts  # what cannot be compiled raises here

    def _set(self, given: _Given) -> None:
        """Store all of it."""
        model, excitation, basis, samples, symmetry, peaks_of, by_sector = given[:7]
        self.model, self.excitation, self.basis = model, excitation, basis
        self.harmonics = basis.harmonics
        self.samples, self.symmetry, self.peaks_of = samples, symmetry, peaks_of
        self.by_sector = by_sector
        self.goal = peaks_of if isinstance(peaks_of, Goal) else None
        self._peaking_output = peaks_of if isinstance(peaks_of, str) else None
        self._shared, linear = given.shared, given.linear
        self.groups: tuple[BalancedGroup, ...] = self._once(
            ("groups", symmetry, samples), lambda: balanced_groups(model, symmetry, samples)
        )
        self._linear = _Linear.of(model, excitation, basis) if linear is None else linear
        self.structure = self._linear.structure
        self._given = given._replace(linear=self._linear)
        if symmetry is not None:
            _ = self.contacts  # sectors whose contacts differ raise here

    @cached_property
    def _active(self) -> frozenset[str]:
        """The groups of contacts that are compiled."""
        # The switches of contacts that do nothing count, too.
        busy = {group.name for group in self.model.groups if group.law.switches or group.acts}
        return self._given.active | busy

    @cached_property
    def _equations(self) -> Equations:
        """What is compiled, once for all copies of the same."""
        powers, active = tuple(self._linear.shapes), self._active
        return self._once(
            ("equations", self.harmonics, self.symmetry, self.samples, powers, *sorted(active)),
            lambda: Equations(
                self.model,
                self.basis,
                [group for group in self.groups if group.name in active],
                self.symmetry,
                powers,
            ),
        )

    @cached_property
    def layout(self) -> UnknownLayout:
        """What the unknowns are."""
        return self._equations.layout

    def _once(self, key: tuple, make: Callable[[], Any]) -> Any:
        if key not in self._shared:
            self._shared[key] = make()
        return self._shared[key]

    def _copy(self, **changes: Any) -> "HarmonicBalance":
        """Copy of what is given but for changes."""
        other = object.__new__(HarmonicBalance)
        other._set(self._given._replace(**{"active": self._active} | changes))
        return other

    @cached_property
    def contacts(self) -> BalancedContacts:
        """The contacts that do something, with their values."""
        values = {group.name: group.values for group in self.model.groups}
        if self.symmetry is not None:
            values = {
                group.name: {
                    of: self.own(name, values[group.name][of])
                    for of, name in group.parameters.items()
                }
                for group in self.groups
            }
        return BalancedContacts(self.layout, self._equations.groups, values)

    @cached_property
    def _arguments(self) -> list[FloatArray]:
        """The parameters of the compiled equations, in the order of ``parameter_names``."""
        model, (shape, static) = self.model, self._force
        named = self._equations.linear.values(model)
        named = named | {name: getattr(model, name) for name in model.matrix_terms}
        for group in self.contacts.groups:
            own = self.contacts.values_of(group)
            named |= {name: own[of] for of, name in group.parameters.items()}
        amplitude = np.array([self.excitation.amplitude])
        named |= dict(force_amplitude=amplitude, force_shape=shape.ravel(), static_force=static)
        names = self._equations.parameter_names
        return [np.ascontiguousarray(named[name], dtype=float) for name in names]

    @cached_property
    def _force(self) -> tuple[FloatArray, FloatArray]:
        """Compiled shapes of the force, a row for each power, and its static part."""
        dofs, linear = self._equations.dofs, self._linear
        if self.structure is not None:  # it adds the force itself
            return np.zeros((1, self.n_unknowns)), self._at_rest(np.zeros(self.n_dof))
        shapes = np.array([each[dofs].ravel() for each in linear.shapes.values()])
        return shapes, self._at_rest(linear.static[dofs])

    def _at_rest(self, static: FloatArray) -> FloatArray:
        """A static force as the balance takes it: nothing where it leaves out harmonic 0."""
        return static if 0 in self.harmonics else static[:0]

    @property
    def loaded(self) -> bool:
        """Whether a static force acts."""
        return bool(self.model.static_load(self.excitation).any())

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom that are unknown: all, or those of one sector."""
        return self.layout.n_dof

    @property
    def n_contacts(self) -> int:
        """Number of contacts that are balanced: all, or those of one sector."""
        return len(self._equations.contacts)

    @property
    def n_unknowns(self) -> int:
        """Number of Fourier coefficients."""
        return self.layout.n_unknowns

    @cached_property
    def parameters(self) -> dict[str, Any]:
        """The named parameters of model and excitation and their values."""
        return ReadOnly(self.model.parameters | self.excitation.parameters)

    def parameter_name(
        self, name: str, allowed: Collection[str] | None = None, what: str = "parameter"
    ) -> str:
        """What a parameter of model or excitation is called here; raises as `Structure` does."""
        allowed = self.parameters if allowed is None else allowed
        return self.model.parameter_name(name, allowed, what)

    @cached_property
    def records(self) -> dict[str, Parameter]:
        """What the parameters of model and excitation are."""
        force = self.excitation
        of_force = {} if not force.changes else amplitude_of(force.units, force.meaning)
        return PARAMETERS | self.model.records | of_force

    def own(self, name: str, values: Any) -> FloatArray:
        """Values of a named parameter of the blades or contacts that are balanced here."""
        array = np.asarray(values, dtype=float)
        if self.symmetry is None or array.ndim == 0:
            return array
        if name in self.model.groups.owners:
            contacts = self.model.groups.owner(name).contacts
            return self.symmetry.own_of_contacts(name, array, contacts)
        return self.symmetry.own_of_dofs(name, array)

    @property
    def differentiable(self) -> list[str]:
        """Names of the parameters by which derivatives are known.

        Those of contacts that do something, none that a moving base changes the force with, and
        of blades that deviate none under a loss factor.
        """
        idle = {
            name
            for group in self.groups
            if group.name not in self._active
            for name in group.parameters.values()
        }
        idle |= self._in_force | self._in_losses
        values = self.parameters.items()
        return [n for n, value in values if not isinstance(value, int) and n not in idle]

    @property
    def _in_losses(self) -> set[str]:
        """Parameters of matrices that are not all there is, as under a loss factor."""
        return set() if self.model.has_matrices else {*self.model.matrix_terms}

    @property
    def _in_force(self) -> set[str]:
        """Parameters of matrices that make the force of a moving base."""
        names = {name: of for name, (of, _) in self.model.matrix_terms.items()}
        names |= {name: name for name in MATRIX_INPUTS}
        return {name for name, of in names.items() if of in self.excitation.of_matrices}

    def with_parameters(self, **values: Any) -> "HarmonicBalance":
        """Copy with other values of named parameters, sharing the compiled equations.

        Raises KeyError for a name that is no parameter, ValueError or TypeError for bad values.
        """
        values = {self.parameter_name(name): value for name, value in values.items()}
        own, changes = self.model.parameters, dict[str, Any]()
        of_model, of_force = {}, {}
        for name, value in values.items():
            (of_model if name in own else of_force)[name] = value
        # The force and matrices of others change, and what was compared sector by sector.
        others = {*values} - {*self.model.groups.owners, "force_amplitude"}
        if others:
            changes["linear"] = None
        if of_model:
            changes["model"] = self.model.with_values(of_model)
        if of_force:
            changes["excitation"] = self.excitation.with_parameters(**of_force)
        if others & {*of_force}:
            model = changes.get("model", self.model).under(changes["excitation"])
            if model is not changes.get("model", self.model):  # in another wave
                changes |= dict(model=model, shared={})
        other = self._copy(**changes)
        may_differ = self.symmetry is not None and others
        if may_differ and self._lagging(other.equal_sectors, bool(of_force)) != self.symmetry:
            raise ValueError(f"{', '.join(values)}: expected a structure of equal sectors")
        return other

    def _lagging(self, symmetry: Symmetry | None, forced: bool) -> Symmetry | None:
        """A symmetry in the wave of this problem, unless a change of the force determines that."""
        if symmetry is None or self.symmetry is None or forced:
            return symmetry
        return replace(symmetry, lag=self.symmetry.lag)

    def with_harmonics(self, harmonics: tuple[int, ...]) -> "HarmonicBalance":
        """Copy with other harmonics, compiled once for all copies of this problem."""
        return self._copy(basis=FourierBasis(harmonics), linear=None)

    def with_excitation(self, excitation: Excitation) -> "HarmonicBalance":
        """Copy under another excitation; raises as the constructor."""
        excitation = excitation.placed(self.model.number_of)
        model = self.model.under(excitation)
        changes = dict(excitation=excitation, linear=None)
        if model is not self.model:  # in another wave
            changes |= dict(model=model, shared={})
        return self._copy(**changes)

    def with_peaks_of(self, peaks_of: str | Goal | None) -> "HarmonicBalance":
        """Copy whose peaks are those of an output or of a goal, None for displacements.

        Raises KeyError for another name; TypeError, ValueError or KeyError for a goal that the
        model does not have.
        """
        _check_peaks_of(peaks_of, self.model, self.harmonics)
        return self._copy(peaks_of=peaks_of)

    def with_by_sector(self, by_sector: bool) -> "HarmonicBalance":
        """The same problem, whose sectors that move alike are solved for by one, or all."""
        return self._copy(by_sector=check.flag("by_sector", by_sector))

    def output_of(self, name: str, unknowns: FloatArray) -> FloatArray:
        """Coefficients (.., n_rows, n_components) of an output from unknowns (.., n_unknowns)."""
        values = (self._observation(name) @ unknowns.reshape(-1, self.n_unknowns).T).T
        return values.reshape(*unknowns.shape[:-1], -1, self.basis.n_components)

    def _observation(self, name: str) -> Any:
        """Coefficients of an output by the unknowns, sparse."""
        if name not in self._observations:
            rows = sp.kron(self.model.outputs[name].rows, sp.eye_array(self.basis.n_components))
            self._observations[name] = sp.csr_array(rows @ self.layout.expansion)
        return self._observations[name]

    @cached_property
    def _observations(self) -> dict[str, Any]:
        return {}

    @property
    def n_peaking(self) -> int:
        """How many quantities have peaks: degrees of freedom, or rows of an output."""
        output = self._peaking_output
        return self.n_dof if output is None else self.model.outputs[output].rows.shape[0]

    def peaking(self, unknowns: FloatArray) -> FloatArray:
        """Coefficients (.., n_peaking, n_components) of what has peaks."""
        if self._peaking_output is None:
            return unknowns.reshape(*unknowns.shape[:-1], self.n_dof, self.basis.n_components)
        return self.output_of(self._peaking_output, unknowns)

    def peaking_by_unknowns(self, row: int) -> Any:
        """Coefficients of one that has peaks by the unknowns, sparse (n_components, n_unknowns)."""
        size = self.basis.n_components
        of = slice(row * size, (row + 1) * size)
        if self._peaking_output is None:
            return sp.csr_array(sp.eye_array(self.n_unknowns))[of]
        return self._observation(self._peaking_output)[of]

    @property
    def peaking_scale(self) -> float:
        """Bound of what has peaks over the size of the response."""
        if self._peaking_output is None:
            return 1.0
        return float(np.sqrt(self._observation(self._peaking_output).power(2).sum(axis=1).max()))

    @property
    def peaking_words(self) -> tuple[str, str]:
        """What has peaks in the place of displacements, in words, and its unit."""
        if self.goal is not None:
            return self.goal.meaning, self.goal.units
        name = self._peaking_output or ""
        return name.replace("_", " "), self.model.outputs[name].units

    def with_model(self, model: Structure) -> "HarmonicBalance":
        """Copy with another description of the same structure and contacts."""
        return self._copy(model=model, linear=None)

    @cached_property
    def in_modes(self) -> "HarmonicBalance | None":
        """The same problem by matrices, of a condensed structure with the modes inside.

        None of a structure without matrices, or where those of the modes are large.
        """
        if self.model.has_matrices:
            return self
        if self.structure is None or self.model.modal is None:
            return None
        return self._copy(
            model=self.model.modal.model(self.model),
            excitation=self.structure.modal_force(self.excitation.amplitude),
            shared=self._once(("in modes",), dict),
            linear=None,
        )

    @cached_property
    def equal_sectors(self) -> Symmetry | None:
        """The symmetry of sectors that move alike, as of `symhbm.model.find_symmetry`."""
        if not self.by_sector or (self.goal is not None and not self.goal.additive):
            return None
        return find_symmetry(self.model, self.excitation, self.basis)

    def of_sector(self, symmetry: Symmetry) -> "HarmonicBalance":
        """Balance of the first of equal sectors, compiled once for all copies of this problem."""
        return self._copy(symmetry=symmetry)

    @cached_property
    def whole(self) -> "HarmonicBalance":
        """Balance of all sectors, of a problem of one of them; else the problem itself."""
        return self if self.symmetry is None else self._copy(symmetry=None)

    def located(self) -> "HarmonicBalance":
        """The same problem with located events."""
        return self._copy(samples=None)

    def released(self) -> "HarmonicBalance":
        """The same problem with contacts that slide freely, where they can."""
        return self._with_values(lambda law: law.released())

    def closed(self) -> "HarmonicBalance":
        """The same problem with contacts that touch where nothing moves, where they can."""
        return self._with_values(lambda law: law.closed())

    def _with_values(self, of_law: Callable[[ContactLaw], dict[str, float]]) -> "HarmonicBalance":
        values = {
            group.parameters[own]: value
            for group in self.groups
            for own, value in of_law(group.law).items()
        }
        return self.with_parameters(**values)

    @cached_property
    def single_valued(self) -> bool:
        """Whether there is one response at every frequency.

        With constant normal loads and dissipative damping friction responses are unique; other
        contact laws, and damping that is negative, may make several.
        """
        return not self.may_fold()

    def may_fold(self, names: Iterable[str] = (), values: Iterable[float] = ()) -> bool:
        """Whether there may be several responses, whatever the values of some parameters are.

        ``values`` are those of damping among them.
        """
        gives = min(values, default=0.0) < 0 or not self.model.dissipates(self.harmonics)
        return gives or self.model.groups.many_valued([*map(self.parameter_name, names)])

    @property
    def residual(self) -> ca.Function:
        """CasADi function of Eq. (9): unknowns, frequency and parameters to forces [N].

        TypeError for a condensed structure, whose linear part is none; `evaluate` has all of it.
        """
        self._check_compiled("residual")
        return self._equations.residual

    def derivative(self, name: str) -> ca.Function:
        """CasADi function of the sparse exact derivative of the residual by one of its inputs.

        ``name`` is ``unknowns``, ``frequency`` or a parameter; KeyError lists the names. Those by
        the parameters only for a condensed structure: TypeError for the others. ValueError by a
        parameter of the matrices with which the force of a moving base changes, and by deviations
        under a loss factor.
        """
        if name in {"unknowns", "frequency"}:
            self._check_compiled(f"derivative({name!r})")
            return self._equations.derivative(name)
        name = self.parameter_name(name)
        if name in self._in_force:
            raise ValueError(
                f"{name}: expected a parameter that the force of a moving base does not change "
                f"with, it is made of the {' and '.join(sorted(self.excitation.of_matrices))} "
                "matrix; sweep it by over=, or give the force as a symhbm.forces.FrequencyForce"
            )
        if name in self._in_losses:
            raise ValueError(
                f"{name}: expected viscous damping, under a loss factor derivatives by deviations "
                "are not known; sweep it by over="
            )
        if name in self.model.groups.owners:
            owner = self.model.groups.owner(name).name
            if owner not in self._active:
                other = self._copy(active=self._active | {owner})
                vars(self).clear()
                vars(self).update(vars(other))
        return self._equations.derivative(name)

    def check_equations(self, balance: ca.Function) -> None:
        """Raise ValueError unless its `residual` is this function."""
        if self._equations.residual is not balance:
            raise ValueError(
                "problem: expected the one these equations were built from, or a copy of it by "
                "with_parameters"
            )

    def _check_compiled(self, what: str) -> None:
        if self.structure is not None:
            raise TypeError(
                f"{what}: a structure without matrices, or a large one whose matrices differ from "
                "harmonic to harmonic, has no such CasADi function; use evaluate, "
                "or of a condensed one a HarmonicBalance of the attribute structure of its model"
            )

    @property
    def in_closed_form(self) -> bool:
        """Whether the events of contacts are closed forms, compiled with the balance."""
        return self._equations.closed

    @property
    def compiled(self) -> tuple[Equations, list[FloatArray]]:
        """The compiled equations, and their parameters in the order of ``parameter_names``."""
        return self._equations, self._arguments

    def arguments(
        self,
        unknowns: FloatArray,
        frequency: float,
        switches: NDArray[np.bool_] | None = None,
        states: ContactStates | None = None,
    ) -> dict[str, FloatArray]:
        """Named inputs of `residual` and `derivative` at a point, its contact events located.

        ``unknowns`` (n_unknowns,) [m], ``frequency`` in rad/s; ``switches`` (n_switches,) imposes
        states of contacts, see `symhbm.laws.ContactLaw.locate`; ``states`` are the events where
        known.
        """
        if states is None:
            states = self.locate(unknowns, frequency, switches)
        names = map(identifier, self._equations.parameter_names)
        named: dict[str, FloatArray] = dict(zip(names, self._arguments, strict=True))
        for group in self._equations.located:
            named[identifier(group.events)] = states.groups[group.name].events.T
        if self.structure is not None:
            named["force_shape"] = self.structure.shape(frequency)
            named["static_force"] = self._at_rest(self.structure.load)
        return {"unknowns": unknowns, "frequency": np.array([frequency])} | named

    def locate(
        self, unknowns: FloatArray, frequency: float, switches: NDArray[np.bool_] | None = None
    ) -> ContactStates:
        """Events of all contacts at the unknowns; ``switches`` (n_switches,) imposes states."""
        return self.contacts.locate(unknowns, frequency, switches)

    def evaluate(
        self,
        unknowns: FloatArray,
        frequency: float,
        switches: NDArray[np.bool_] | None = None,
        states: ContactStates | None = None,
    ) -> Evaluation:
        """Residual and derivatives at ``unknowns`` [m] and angular ``frequency`` [rad/s].

        ``switches`` (n_switches,) imposes states of contacts, see `symhbm.laws.ContactLaw.locate`;
        ``states`` are the events of the contacts where they are known.
        """
        of_contacts = self._evaluate_compiled(unknowns, frequency, switches, states)
        if self.structure is None:
            return of_contacts
        return self.structure.added(of_contacts, unknowns, frequency, self.excitation.amplitude)

    def _evaluate_compiled(
        self,
        unknowns: FloatArray,
        frequency: float,
        switches: NDArray[np.bool_] | None = None,
        states: ContactStates | None = None,
    ) -> Evaluation:
        at = unknowns, frequency, self._arguments
        if self.in_closed_form:
            imposed = switches if states is None else states.switches
            found, states = self._equations.in_closed_form(*at, imposed)
        else:
            states = self.locate(unknowns, frequency, switches) if states is None else states
            found = self._equations(*at, states)
        residual, magnitude, values, by_frequency = found
        jacobian = self._equations.assemble(values)
        size = float(magnitude[0]) + self.load_at_rest(frequency)
        return Evaluation(residual, size, jacobian, by_frequency, states)

    def load_at_rest(self, frequency: float) -> float:
        """Largest normal load [N] of what nothing drives, 0 of other problems.

        The round-off of loads is then all that is left of the balance.
        """
        if self.excitation.amplitude:
            return 0.0
        loads = [
            np.abs(group.law.load(frequency, self.contacts.values_of(group))).max(initial=0.0)
            for group in self.contacts.groups
            if isinstance(group.law, NormalLaw)
        ]
        return float(max(loads, default=0.0))

    def force(self, frequency: float) -> FloatArray:
        """Coefficients of the force at an angular frequency, ``(n_dof, n_components)`` [N]."""
        part = self.structure
        shape, static = self._shape_at(frequency), self._force[1]
        if part is not None:
            shape, static = part.shape(frequency), part.load
        force = self.layout.coefficients(self.excitation.amplitude * shape)
        if 0 in self.harmonics:
            force[:, self.basis.component(0)] += static
        return force

    def _shape_at(self, frequency: float) -> FloatArray:
        """Coefficients of the compiled force at unit amplitude, (n_unknowns,)."""
        return frequency ** np.array(self._equations.powers, dtype=float) @ self._force[0]

    def contact_forces(self, unknowns: FloatArray, frequency: float) -> FloatArray:
        """Forces of the contacts of a condensed structure, ``(n_dof, n_components)`` [N]."""
        return self.layout.coefficients(self._evaluate_compiled(unknowns, frequency).residual)

    def amplification(self, unknowns: FloatArray, frequency: float) -> float:
        """Largest inertia force over the largest exciting force (0 without one)."""
        if self.structure is not None:
            return self.structure.amplification(unknowns, frequency, self.excitation.amplitude)
        force = abs(self.excitation.amplitude) * np.abs(self._shape_at(frequency)).max()
        if force == 0:
            return 0.0
        return self._equations.inertia(unknowns, frequency, self._arguments) / float(force)

    def __reduce__(self):
        given = self.model, self.excitation, self.harmonics, self.samples, self.symmetry
        return HarmonicBalance, (*given, self.peaks_of, self.by_sector)

    def __repr__(self) -> str:
        law = "" if self.samples is None else f", friction over {self.samples} samples"
        return (
            f"HarmonicBalance: harmonics {check.brief(self.harmonics)}, {self.n_unknowns} "
            f"unknowns{law}\n{self.model!r}\n{self.excitation!r}"
        )

    def _repr_html_(self) -> str:
        rows = [("harmonics", check.brief(self.harmonics)), ("unknowns", str(self.n_unknowns))]
        if self.samples is not None:
            rows.append(("friction", f"over {self.samples} samples"))
        rows.append(("excitation", repr(self.excitation)))
        return as_table("HarmonicBalance", rows + rows_of(self.model))


def _check_peaks_of(peaks_of: Any, model: Structure, harmonics: tuple[int, ...]) -> None:
    """Raise TypeError, ValueError or KeyError for what peaks are not of, naming it."""
    if isinstance(peaks_of, Goal):
        try:
            peaks_of.check(model, harmonics)
        except (KeyError, TypeError, ValueError) as error:
            raise type(error)(f"peaks_of: {error.args[0]}") from None
    elif peaks_of is not None:
        check.known(check.text("peaks_of", peaks_of), model.outputs, "output of the model")


def nothing_on(model: Structure) -> Excitation:
    """An excitation of a structure that neither moves nor loads it."""
    if model.nodal_diameters is not None and model.is_polynomial:
        return EngineOrder(0, amplitude=0.0, pattern={1: {0: 1.0}})
    return StaticLoad({0: 0.0})


def _check_entries(model: Model) -> None:
    """Raise TypeError for a large structure whose damping is of low rank: no matrix to compile."""
    if not sp.issparse(model.damping_matrix):
        raise TypeError(
            f"model: expected one with damping as a sparse matrix, the modal damping of "
            f"{model.n_dof:,} degrees of freedom is full; use symhbm.condense or "
            "symhbm.craig_bampton of the model"
        )


def _advise(model: Model) -> None:
    """Say of a large structure with few contacts that it is better condensed."""
    entries = int(model.stiffness_matrix.nnz)
    if entries <= LARGE or not _has_few_contacts(model):
        return
    check.warn(
        f"a structure of {model.n_dof:,} degrees of freedom, of which contacts touch "
        f"{len(model.touched)}, "
        f"and {entries:,} entries of its stiffness matrix: it takes about {entries / 2e4:.0f} s to "
        "compile, and every point some factorisations of all its equations; symhbm.condense(model, "
        "excitation, frequency_band, harmonics, places=...) gives the same responses of what "
        "contacts touch and of these places, and each point in milliseconds",
    )


def _has_few_contacts(model: Structure) -> bool:
    return _FEW * len(model.touched) <= model.n_dof


def advise_condensing(problem: HarmonicBalance, what: str, option: str = "") -> None:
    """Say of a problem of many unknowns ``what`` a condensed structure is better for."""
    model = problem.model
    if not model.has_matrices or problem.n_unknowns <= MANY or not _has_few_contacts(model):
        return
    check.warn(
        f"{what} for {problem.n_unknowns:,} unknowns; those of the {len(model.touched)} degrees of "
        f"freedom that contacts touch are enough: symhbm.condense(model, excitation, "
        f"frequency_band, harmonics, places=...{option})",
    )


def check_problem(problem: object, whole: bool = False, bends: bool = False) -> None:
    """Raise TypeError unless it is a HarmonicBalance, of a ``whole`` structure where needed.

    One that ``bends`` has matrices, or a dynamic stiffness with second derivatives.
    """
    if not isinstance(problem, HarmonicBalance):
        raise TypeError(f"problem={check.shown(problem)}: expected a HarmonicBalance")
    known = problem.model.has_matrices or (bends and problem.model.bends)
    if (whole or bends) and not known:
        raise TypeError(f"problem: {problem.model.WITHOUT_MATRICES}")
