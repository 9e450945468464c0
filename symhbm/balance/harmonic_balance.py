"""The multi-harmonic balance equations, Eq. (9), compiled once for every parameter set."""

import warnings
from collections.abc import Iterable
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.balance.contact_states import ContactStates
from symhbm.balance.dynamic_stiffness import DynamicStiffness
from symhbm.balance.equations import (
    MATRIX_INPUTS,
    BalancedGroup,
    Equations,
    balanced_groups,
    identifier,
)
from symhbm.balance.evaluation import Evaluation
from symhbm.balance.unknowns import Unknowns
from symhbm.model import (
    PARAMETERS,
    Excitation,
    Model,
    SliderContacts,
    Structure,
    Symmetry,
    find_symmetry,
)
from symhbm.model.contacts import Parameter
from symhbm.numerics import FloatArray, FourierBasis, check, check_harmonics

LARGE = 100_000
"""Entries of a stiffness matrix from which compiling it takes longer (5 s) than condensing it."""
_FEW = 4
"""Degrees of freedom for each one that contacts touch, from which condensing is worth it."""


class HarmonicBalance(Unknowns):
    """Multi-harmonic balance of a model under an excitation, Eq. (9).

    Parameters
    ----------
    model, excitation
        What vibrates, and what drives it.
    harmonics
        Harmonics of the response, for example ``(1,)``, ``(1, 3, 5)`` or ``(0, 1, 2, 3)``.
    samples
        March the friction law over so many samples of the period (alternating frequency and time)
        instead of locating its switching angles: a cross-check, with a sampling error that
        results state.
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
    groups
        The groups of contacts as they are balanced.

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
    >>> problem = sh.HarmonicBalance(blade, sh.PointForce())
    >>> problem.with_parameters(normal_load=5, force_amplitude=2.0).parameters["normal_load"]
    array([5.])
    """

    def __init__(
        self,
        model: Structure,
        excitation: Excitation,
        harmonics: Iterable[int] = (1,),
        samples: int | None = None,
        symmetry: Symmetry | None = None,
    ):
        if not isinstance(model, Structure):
            raise TypeError(f"model={check.shown(model)}: expected a Model")
        if isinstance(excitation, type) or not callable(getattr(excitation, "shape", None)):
            raise TypeError(f"excitation={check.shown(excitation)}: expected an excitation")
        self.model = model
        self.excitation = excitation
        self.basis = FourierBasis(check_harmonics(harmonics))
        if samples is not None:
            samples = check.integer("samples", samples, minimum=2 * self.basis.highest + 1)
        self.samples = samples
        self.symmetry = symmetry
        self._structure: DynamicStiffness | None = None
        if not model.has_matrices:
            if symmetry is not None:
                raise ValueError("symmetry: expected None for a structure without matrices")
            self._structure = DynamicStiffness(model, excitation, self.basis)
        elif isinstance(model, Model):
            _advise(model)
        # Shared by all copies of this problem: each is compiled once.
        self._compiled: dict[tuple, Equations] = {}
        self.groups = balanced_groups(model, symmetry, samples)
        self._equations = self._compile(self._busy())
        self._set_arguments()

    @property
    def parameters(self) -> dict[str, Any]:
        """The named parameters of model and excitation and their values."""
        return self.model.parameters | self.excitation.parameters

    @property
    def records(self) -> dict[str, Parameter]:
        """What the parameters of model and excitation are."""
        return PARAMETERS | self.model.records

    def about(self, name: str) -> Parameter:
        """What a parameter of model or excitation is."""
        return self.model.about(name)

    def dims_of(self, name: str) -> tuple[str, ...]:
        """Dimensions of one value of a parameter in a dataset."""
        return self.model.dims_of(name)

    @property
    def differentiable(self) -> list[str]:
        """Names of the parameters that may vary continuously, of contacts that do something."""
        idle = {
            name
            for group in self.groups
            if group.name not in self._names()
            for name in group.parameters.values()
        }
        values = self.parameters.items()
        return [n for n, value in values if not isinstance(value, int) and n not in idle]

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
        the parameters only for a condensed structure: TypeError for the others.
        """
        if name in {"unknowns", "frequency"}:
            self._check_compiled(f"derivative({name!r})")
        else:
            name = self.parameter_name(name)
        if name not in self._equations.parameter_names and name in self.model.contact_parameters:
            owner = self.model.group_of(name).name
            self._equations = self._compile({*self._names(), owner})
            self._set_arguments()
        return self._equations.derivative(name)

    def _check_compiled(self, what: str) -> None:
        if self._structure is not None:
            raise TypeError(
                f"{what}: a structure without matrices has no such CasADi function; use evaluate, "
                "or of a condensed one a HarmonicBalance of the attribute structure of its model"
            )

    def check_frequencies(self, name: str, values: Any) -> None:
        """Raise ValueError unless frequencies [Hz] are among those that the model is made for."""
        self.model.check_frequencies(name, values)

    def parameter_name(self, name: str) -> str:
        """What a parameter of model or excitation is called here; KeyError for none or several."""
        if name in self.excitation.parameters:
            return name
        try:
            return self.model.parameter_name(name)
        except KeyError:
            if "." not in name and not any(name in group.parameters for group in self.groups):
                check.known(name, self.parameters)
            raise

    def _busy(self) -> set[str]:
        """The groups whose contacts do something, whose switches count in any case."""
        return {
            group.name
            for group in self.model.groups
            if group.law.switches or group.law.acts(self.model.values_of(group)).any()
        }

    def _names(self) -> set[str]:
        """The groups that are compiled."""
        return {group.name for group in self._equations.groups}

    def _compile(self, active: set[str]) -> Equations:
        """The equations of this structure, harmonic set and sector, with some of its groups."""
        key = self.harmonics, self.symmetry, self.samples, *sorted(active)
        if key not in self._compiled:
            groups = [group for group in self.groups if group.name in active]
            self._compiled[key] = Equations(self.model, self.basis, groups, self.symmetry)
        return self._compiled[key]

    def with_harmonics(self, harmonics: tuple[int, ...]) -> "HarmonicBalance":
        """Copy with other harmonics, compiled once for all copies of this problem."""
        return self._with(basis=FourierBasis(harmonics))

    def of_sector(self, symmetry: Symmetry) -> "HarmonicBalance":
        """Balance of the first of equal sectors, compiled once for all copies of this problem."""
        return self._with(symmetry=symmetry)

    def _with(self, **changes: Any) -> "HarmonicBalance":
        other = object.__new__(HarmonicBalance)
        other.__dict__.update(self.__dict__, **changes)
        other.groups = balanced_groups(other.model, other.symmetry, other.samples)
        other._equations = other._compile(self._names())
        if not other.model.has_matrices:
            other._structure = DynamicStiffness(other.model, other.excitation, other.basis)
        other._set_arguments()
        return other

    @property
    def single_valued(self) -> bool:
        """Whether there is one response at every frequency.

        With constant normal loads and dissipative damping friction responses are unique; other
        contact laws may make several.
        """
        return self.model.unique

    def single_valued_over(self, names: Iterable[str]) -> bool:
        """The same whatever the values of some parameters are."""
        return not self.many_valued_laws(names)

    def many_valued_laws(self, names: Iterable[str] = ()) -> str:
        """Contact laws that make several responses, whatever the values of some parameters are."""
        named = {*map(self.parameter_name, names)}
        return ", ".join(
            repr(group.law)
            for group in self.model.groups
            if group.n
            and not group.law.monotone(values := self.model.values_of(group))
            and (named & {*group.parameters.values()} or group.law.acts(values).any())
        )

    @property
    def margins_move(self) -> bool:
        """Whether margins of switches depend on the frequency at a given motion."""
        return any(group.law.margins_move for group in self._equations.groups)

    def margin_slopes(self, frequency: float) -> tuple[FloatArray, dict[str, FloatArray]]:
        """Derivatives of the margins at a given motion: by the frequency and by parameters.

        (n_switches,), and by name (n_switches, n) for the n contacts of the parameter.
        """
        groups = self._equations.groups
        n_switches, first = sum(group.n_switches for group in groups), 0
        by_frequency, by_values = np.zeros(n_switches), {}
        for group in groups:
            at = first + np.arange(group.n_switches)
            first += group.n_switches
            slopes = group.law.margin_slopes(frequency, self.values_of(group))
            by_frequency[at] = slopes[0].ravel()
            owner = np.repeat(np.arange(group.n), len(group.law.switches))
            for name, values in zip(group.parameters.values(), slopes[1], strict=True):
                by_values[name] = np.zeros((n_switches, group.n))
                by_values[name][at, owner] = values.ravel()
        return by_frequency, by_values

    def switch(self, number: int) -> tuple[BalancedGroup, int, int]:
        """The group of a switch, the contact within, and which of the law's switches it is."""
        for group in self._equations.groups:
            if number < group.n_switches:
                return group, *divmod(number, len(group.law.switches))
            number -= group.n_switches
        raise IndexError(f"number={number}: expected one of the switches of all contacts")

    @property
    def contacts_of_switches(self) -> NDArray[np.intp]:
        """The contact of each switch, (n_switches,)."""
        groups = self._equations.groups
        each = [np.repeat(group.contacts, len(group.law.switches)) for group in groups]
        return np.concatenate([np.zeros(0, dtype=int), *each])

    def margin_gradient(self, contacts: ContactStates, switch: int) -> FloatArray:
        """Derivative of the margin of one switch by the unknowns, (n_unknowns,)."""
        group, contact, place = self.switch(switch)
        by_motion = contacts.groups[group.name].margins_by_motion[contact, place]
        return self.by_unknowns(group, contact, by_motion)

    def by_unknowns(self, group: BalancedGroup, contact: int, by_motion: FloatArray) -> FloatArray:
        """Derivatives (..., n_unknowns) from those by a contact's motion, (..., m n_components)."""
        rows = group.rows[contact].tolist()
        if len(rows) == 1:
            return self.expand(rows[0], by_motion)
        parts = np.split(by_motion, len(rows), axis=-1)
        return np.sum([self.expand(row, part) for row, part in zip(rows, parts, strict=True)], 0)

    def margin_rate(self, contacts: ContactStates, direction: FloatArray) -> FloatArray:
        """Derivative of all margins along a direction of the unknowns, (n_switches,)."""
        relative, rates = self.relative(direction), [np.zeros(0)]
        for group in self._equations.groups:
            motion = self.motions(group, relative)
            by_motion = contacts.groups[group.name].margins_by_motion
            each = [
                np.einsum("cm,cm->c", by_motion[:, q], motion) for q in range(by_motion.shape[1])
            ]
            rates += [np.stack(each, axis=1).ravel()] if each else []
        return np.concatenate(rates)

    @property
    def in_closed_form(self) -> bool:
        """Whether the events of contacts are closed forms, compiled with the balance."""
        return self._equations.closed

    @property
    def structure(self) -> DynamicStiffness | None:
        """Of a condensed structure, its linear part beside the compiled forces."""
        return self._structure

    @property
    def compiled(self) -> tuple[Equations, list[FloatArray]]:
        """The compiled equations, and their parameters in the order of ``parameter_names``."""
        return self._equations, self._arguments

    def arguments(
        self,
        unknowns: FloatArray,
        frequency: float,
        slip: NDArray[np.bool_] | None = None,
        friction: ContactStates | None = None,
    ) -> dict[str, FloatArray]:
        """Named inputs of `residual` and `derivative` at a point, its contact events located.

        ``unknowns`` (n_unknowns,) [m], ``frequency`` in rad/s; ``slip`` (n_switches,) imposes
        states of contacts, see `symhbm.ContactLaw.locate`; ``friction`` are the events where known.
        """
        if friction is None:
            friction = self.locate(unknowns, frequency, slip)
        names = map(identifier, self._equations.parameter_names)
        named: dict[str, FloatArray] = dict(zip(names, self._arguments, strict=True))
        for group in self._equations.located:
            named[identifier(group.events)] = friction.groups[group.name].events.T
        if self._structure is not None:
            named["force_shape"] = self._structure.shape(frequency)
        return {"unknowns": unknowns, "frequency": np.array([frequency])} | named

    def with_parameters(self, **values: Any) -> "HarmonicBalance":
        """Copy with other values of named parameters, sharing the compiled equations.

        Raises KeyError for a name that is no parameter, ValueError or TypeError for bad values.
        """
        values = {self.parameter_name(name): value for name, value in values.items()}
        own = self.model.parameters
        of_model = {k: v for k, v in values.items() if k in own}
        of_force = {k: v for k, v in values.items() if k not in of_model}
        other = object.__new__(HarmonicBalance)
        other.__dict__.update(self.__dict__)
        if of_model:
            other.model = self.model.with_parameters(**of_model)
            if not other._busy() <= self._names():
                other._equations = other._compile(other._busy() | self._names())
        if of_force:
            other.excitation = self.excitation.with_parameters(**of_force)
            if not other.model.has_matrices and {*of_force} != {"force_amplitude"}:
                other._structure = DynamicStiffness(other.model, other.excitation, self.basis)
        other._set_arguments()
        common = {*self.model.contact_parameters, "force_amplitude"}  # compared when they are set
        if self.symmetry is not None and not {*values} <= common:
            found = find_symmetry(other.model, other.excitation, self.basis)
            if found != self.symmetry:
                raise ValueError(f"{', '.join(values)}: expected a structure of equal sectors")
        return other

    def values_of(self, group: BalancedGroup) -> dict[str, FloatArray]:
        """Values of the parameters of a group's contacts that are balanced, by names of the law."""
        return self._values[group.name]

    def motions(self, group: BalancedGroup, relative: FloatArray) -> FloatArray:
        """Of displacements (..., n_rows, n_components) a group's, (..., n, m n_components)."""
        rows = group.rows.ravel()
        if len(rows) != self._equations.n_rows:
            relative = relative[..., rows, :]
        size = group.rows.shape[1] * self.basis.n_components
        return relative.reshape(*relative.shape[:-2], group.n, size)

    def locate(
        self, unknowns: FloatArray, frequency: float, slip: NDArray[np.bool_] | None = None
    ) -> ContactStates:
        """Events of all contacts at the unknowns; ``slip`` (n_switches,) imposes states."""
        relative, located, first = self.relative(unknowns), {}, 0
        for group in self._equations.groups:
            held, q = None, len(group.law.switches)
            if slip is not None:
                held = slip[first : first + group.n_switches].reshape(group.n, q)
            first += group.n_switches
            motion = self.motions(group, relative)
            arguments = motion, frequency, self.values_of(group), held
            located[group.name] = group.law.locate(self.basis, *arguments)
        return ContactStates(located)

    def sliders(self, frequency: float = 0.0) -> SliderContacts:
        """The balanced contacts that are springs in series with sliders, at a frequency [rad/s]."""
        parts = [(*np.zeros((2, 0), dtype=int), *np.zeros((2, 0)))]
        for group in self._equations.groups:
            sliders = group.law.sliders(frequency, self.values_of(group))
            if sliders is not None:
                parts.append((group.contacts, group.rows[:, 0], *sliders))
        return SliderContacts(*map(np.concatenate, zip(*parts, strict=True)))

    @property
    def stuck_springs(self) -> FloatArray:
        """Largest stiffness of the balanced contacts that have one, (n_rows,) [N/m]."""
        everywhere = self.model.stuck_springs
        if self.symmetry is None:
            return everywhere
        return everywhere[self.model.rows_of(self.symmetry.contacts)]

    def released(self) -> "HarmonicBalance":
        """The same problem with contacts that slide freely, where they can."""
        values = {
            group.parameters[own]: value
            for group in self.groups
            for own, value in group.law.released().items()
        }
        return self.with_parameters(**values)

    def located(self) -> "HarmonicBalance":
        """The same problem with located events."""
        return self._with(samples=None)

    def evaluate(
        self,
        unknowns: FloatArray,
        frequency: float,
        slip: NDArray[np.bool_] | None = None,
        friction: ContactStates | None = None,
    ) -> Evaluation:
        """Residual and derivatives at ``unknowns`` [m] and angular ``frequency`` [rad/s].

        ``slip`` (n_switches,) imposes states of contacts, see `symhbm.ContactLaw.locate`;
        ``friction`` are the events of the contacts where they are known.
        """
        at = unknowns, frequency, self._arguments
        if self.in_closed_form:
            imposed = slip if friction is None else friction.slip
            found, friction = self._equations.in_closed_form(*at, imposed)
        else:
            friction = self.locate(unknowns, frequency, slip) if friction is None else friction
            found = self._equations(*at, friction)
        residual, magnitude, values, by_parameter = found
        result = Evaluation(
            residual,
            float(magnitude[0]),
            self._equations.assemble(values),
            by_parameter,
            friction,
        )
        if self._structure is None:
            return result
        return self._structure.added(result, unknowns, frequency, self.excitation.amplitude)

    def force(self, frequency: float) -> FloatArray:
        """Coefficients of the force at an angular frequency, ``(n_dof, n_components)`` [N]."""
        shape = self._arguments[-1] if self._structure is None else self._structure.shape(frequency)
        return self.coefficients(self.excitation.amplitude * shape)

    def contact_forces(self, unknowns: FloatArray) -> FloatArray:
        """Forces of the contacts of a condensed structure, ``(n_dof, n_components)`` [N]."""
        alone = object.__new__(HarmonicBalance)
        alone.__dict__.update(self.__dict__, _structure=None)
        return self.coefficients(alone.evaluate(unknowns, 0.0).residual)

    def amplification(self, unknowns: FloatArray, frequency: float) -> float:
        """Largest inertia force over the largest exciting force (0 without one)."""
        if self._structure is not None:
            return self._structure.amplification(unknowns, frequency, self.excitation.amplitude)
        force = abs(self.excitation.amplitude) * np.abs(self._arguments[-1]).max()
        inertia = self.model.mass_matrix @ (self.everywhere(unknowns) * self.basis.order**2)
        return float(frequency**2 * np.abs(inertia).max() / force) if force > 0 else 0.0

    def _set_arguments(self) -> None:
        model, excitation, equations = self.model, self.excitation, self._equations
        named = {name: equations.rows(model, name).data for name in MATRIX_INPUTS}
        self._values = {}
        for group in model.groups:
            values = {
                own: self._own(name, getattr(model, name), group.contacts)
                for own, name in group.parameters.items()
            }
            self._values[group.name] = values
            named |= {group.parameters[own]: array for own, array in values.items()}
        named["force_amplitude"] = np.array([excitation.amplitude])
        if self._structure is None:
            shape = excitation.shape(model.n_dof, self.basis)[equations.dofs]
        else:
            shape = np.zeros((self.n_dof, self.basis.n_components))  # it adds the force itself
        named["force_shape"] = shape.ravel()
        self._arguments = [
            np.ascontiguousarray(named[name], dtype=float)
            for name in self._equations.parameter_names
        ]

    def __reduce__(self):
        given = self.model, self.excitation, self.harmonics, self.samples, self.symmetry
        return HarmonicBalance, given

    def __repr__(self) -> str:
        law = "" if self.samples is None else f", friction over {self.samples} samples"
        return (
            f"HarmonicBalance: harmonics {self.harmonics}, {self.n_unknowns} unknowns{law}\n"
            f"{self.model!r}\n{self.excitation!r}"
        )


def _advise(model: Model) -> None:
    """Say of a large structure with few contacts that it is better condensed."""
    entries = int(model.stiffness_matrix.nnz)
    touched = len(model.touched)
    if entries <= LARGE or _FEW * touched > model.n_dof:
        return
    warnings.warn(
        f"a structure of {model.n_dof:,} degrees of freedom, of which contacts touch {touched}, "
        f"and {entries:,} entries of its stiffness matrix: it takes about {entries / 2e4:.0f} s to "
        "compile, and every point some factorisations of all its equations; symhbm.condense(model, "
        "excitation, frequency, harmonics, dofs=...) gives the same responses of what contacts "
        "touch and of dofs, and each point in milliseconds",
        stacklevel=3,
    )


def check_problem(problem: object, whole: bool = False) -> None:
    """Raise TypeError unless it is a HarmonicBalance, of a ``whole`` structure where needed."""
    if not isinstance(problem, HarmonicBalance):
        raise TypeError(f"problem={check.shown(problem)}: expected a HarmonicBalance")
    if whole and not problem.model.has_matrices:
        raise TypeError(f"problem: {problem.model.WITHOUT_MATRICES}")
