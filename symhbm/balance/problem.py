"""What is balanced: a structure, what drives it, and the harmonics of its response."""

from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from symhbm.balance.dynamic_stiffness import DynamicStiffness
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
    check_excitation,
    check_size,
    find_symmetry,
)
from symhbm.model.contacts import ContactLaw, Parameter
from symhbm.model.cyclic import check_speed
from symhbm.numerics import FloatArray, FourierBasis, check, check_harmonics


class Driven(NamedTuple):
    """A structure under an excitation of unit amplitude, which copies of a problem share.

    ``part`` is its linear part by numbers, None where its matrices are compiled: then the force has
    ``shapes`` (n_dof, n_components) by ascending powers of the frequency and a ``static`` part
    (n_dof,).
    """

    part: DynamicStiffness | None
    shapes: dict[int, FloatArray]
    static: FloatArray

    @classmethod
    def of(cls, model: Structure, excitation: Excitation, basis: FourierBasis) -> "Driven":
        """The structure as the excitation drives it."""
        if not is_symbolic(model, basis):
            # It adds the force itself.
            part = DynamicStiffness(model, excitation, basis)
            nothing = np.zeros((model.n_dof, basis.n_components))
            return cls(part, {0: nothing}, np.zeros(model.n_dof))
        shapes = dict(sorted(model.felt_shapes(excitation, basis).items()))
        return cls(None, shapes, model.felt_static(excitation, basis))

    def force(self, frequency: float) -> tuple[FloatArray, FloatArray]:
        """Coefficients of the force (n_dof, n_components) at a frequency [rad/s], and static."""
        if self.part is not None:
            return self.part.shape(frequency).reshape(self.shapes[0].shape), self.part.load
        shape = sum(frequency**power * each for power, each in self.shapes.items())
        return np.asarray(shape), self.static


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
    linear: Driven | None = None
    active: frozenset[str] = frozenset()


class Problem:
    """A structure under an excitation and the harmonics of its response, with all values.

    Parameters, and what they raise, are those of `symhbm.HarmonicBalance`. Copies with other values
    share what is compiled.
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
        check.instance("model", model, Structure, "a Model")
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
            check_size(model)
        _check_peaks_of(peaks_of, model, basis.harmonics)
        by_sector = check.flag("by_sector", by_sector)
        given = model, excitation, basis, samples, symmetry, peaks_of, by_sector
        self._set(_Given(*given, shared={}))
        self._compile()

    def _set(self, given: _Given) -> None:
        """Store all of it."""
        model, excitation, basis, samples, symmetry, peaks_of, by_sector = given[:7]
        self.model, self.excitation, self.basis = model, excitation, basis
        self.harmonics = basis.harmonics
        self.samples, self.symmetry, self.peaks_of = samples, symmetry, peaks_of
        self.by_sector = by_sector
        self.goal = peaks_of if isinstance(peaks_of, Goal) else None
        self._shared, linear = given.shared, given.linear
        if linear is None:
            check_speed(model, excitation)
            linear = Driven.of(model, excitation, basis)
        self._driven = linear
        self.structure = self._driven.part
        self._given = given._replace(linear=self._driven)

    @cached_property
    def _active(self) -> frozenset[str]:
        """The groups of contacts that are compiled."""
        # The switches of contacts that do nothing count, too.
        busy = {group.name for group in self.model.groups if group.law.switches or group.acts}
        return self._given.active | busy

    def _once(self, key: tuple, make: Callable[[], Any]) -> Any:
        if key not in self._shared:
            self._shared[key] = make()
        return self._shared[key]

    def _copy(self, **changes: Any) -> Self:
        """Copy of what is given but for changes."""
        other = object.__new__(type(self))
        other._set(self._given._replace(**{"active": self._active} | changes))
        if other.symmetry is not None:
            other._compile()
        return other

    def _compile(self) -> None:
        """What is compiled as soon as it is made: nothing of a problem alone."""

    @property
    def loaded(self) -> bool:
        """Whether a static force acts."""
        return bool(self.model.static_load(self.excitation).any())

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
            for group in self.model.groups
            if group.name not in self._active
            for name in group.parameters.values()
        }
        unknown = idle | without_derivative(self.model, self.excitation).keys()
        values = self.parameters.items()
        return [n for n, value in values if not isinstance(value, int) and n not in unknown]

    def with_parameters(self, **values: Any) -> Self:
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

    def with_harmonics(self, harmonics: Iterable[int]) -> Self:
        """Copy with other harmonics, compiled once for all copies; raises as the constructor."""
        return self._copy(basis=FourierBasis(check_harmonics(harmonics)), linear=None)

    def with_excitation(self, excitation: Excitation) -> Self:
        """Copy under another excitation; raises as the constructor."""
        excitation = excitation.placed(self.model.number_of)
        model = self.model.under(excitation)
        changes = dict(excitation=excitation, linear=None)
        if model is not self.model:  # in another wave
            changes |= dict(model=model, shared={})
        return self._copy(**changes)

    def with_peaks_of(self, peaks_of: str | Goal | None) -> Self:
        """Copy whose peaks are those of an output or of a goal, None for displacements.

        Raises KeyError for another name; TypeError, ValueError or KeyError for a goal that the
        model does not have.
        """
        _check_peaks_of(peaks_of, self.model, self.harmonics)
        return self._copy(peaks_of=peaks_of)

    def with_by_sector(self, by_sector: bool) -> Self:
        """The same problem, whose sectors that move alike are solved for by one, or all."""
        return self._copy(by_sector=check.flag("by_sector", by_sector))

    @property
    def peaking_words(self) -> tuple[str, str]:
        """What has peaks in the place of displacements, in words, and its unit."""
        if self.goal is not None:
            return self.goal.meaning, self.goal.units
        name = str(self.peaks_of)
        return name.replace("_", " "), self.model.outputs[name].units

    def with_model(self, model: Structure) -> Self:
        """Copy with another description of the same structure and contacts."""
        return self._copy(model=model, linear=None)

    @cached_property
    def equal_sectors(self) -> Symmetry | None:
        """The symmetry of sectors that move alike, as of `symhbm.model.find_symmetry`."""
        if not self.by_sector or (self.goal is not None and not self.goal.additive):
            return None
        return find_symmetry(self.model, self.excitation, self.basis)

    def of_sector(self, symmetry: Symmetry) -> Self:
        """Balance of the first of equal sectors, compiled once for all copies of this problem."""
        if symmetry not in self._by_symmetry:
            self._by_symmetry[symmetry] = self._copy(symmetry=symmetry)
        return self._by_symmetry[symmetry]

    @cached_property
    def _by_symmetry(self) -> dict[Symmetry, Self]:
        return {}

    @cached_property
    def whole(self) -> Self:
        """Balance of all sectors, of a problem of one of them; else the problem itself."""
        return self if self.symmetry is None else self._copy(symmetry=None)

    def located(self) -> Self:
        """The same problem with located events."""
        return self._copy(samples=None)

    def released(self) -> Self:
        """The same problem with contacts that slide freely, where they can."""
        return self._with_values(lambda law: law.released())

    def closed(self) -> Self:
        """The same problem with contacts that touch where nothing moves, where they can."""
        return self._with_values(lambda law: law.closed())

    def _with_values(self, of_law: Callable[[ContactLaw], dict[str, float]]) -> Self:
        values = {
            group.parameters[own]: value
            for group in self.model.groups
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

    def activate(self, name: str) -> None:
        """Compile the contacts of a parameter, though they may do nothing so far."""
        groups = self.model.groups
        if name in groups.owners and groups.owner(name).name not in self._active:
            other = self._copy(active=self._active | {groups.owner(name).name})
            vars(self).clear()
            vars(self).update(vars(other))

    def __reduce__(self):
        given = self.model, self.excitation, self.harmonics, self.samples, self.symmetry
        return type(self), (*given, self.peaks_of, self.by_sector)


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


def without_derivative(model: Structure, excitation: Excitation) -> dict[str, str]:
    """Parameters of matrices by which no derivatives are known, and why."""
    of = {name: of for name, (of, _) in model.matrix_terms.items()}
    of_losses = {} if model.has_matrices else dict.fromkeys(
        of,
        "expected viscous damping, under a loss factor derivatives by deviations are not known; "
        "sweep it by over=",
    )  # fmt: skip
    reason = (
        "expected a parameter that the force of a moving base does not change with, it is made of "
        f"the {' and '.join(sorted(excitation.of_matrices))} matrix; sweep it by over=, or give "
        "the force as a symhbm.forces.FrequencyForce"
    )
    of |= {name: name for name in MATRIX_INPUTS}
    of_force = [name for name, matrix in of.items() if matrix in excitation.of_matrices]
    return {n: f"{n}: {why}" for n, why in (of_losses | dict.fromkeys(of_force, reason)).items()}
