"""The multi-harmonic balance equations, Eq. (9), compiled once for every parameter set."""

from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.balance.contacts import BalancedContacts, BalancedGroup, balanced_groups
from symhbm.balance.equations import Equations, identifier
from symhbm.balance.evaluation import ContactStates, Evaluation, Observed, UnknownLayout
from symhbm.balance.problem import Problem, without_derivative
from symhbm.model import as_table, rows_of
from symhbm.model.contacts import Group
from symhbm.numerics import FloatArray, check


class HarmonicBalance(Problem):
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

    def _compile(self) -> None:
        _ = self.contacts  # what cannot be compiled raises here, and sectors that differ

    @cached_property
    def groups(self) -> tuple[BalancedGroup, ...]:
        """The groups of contacts as they are balanced."""
        given = self.model, self.symmetry, self.samples
        return self._once(("groups", *given[1:]), lambda: balanced_groups(*given))

    @cached_property
    def equations(self) -> Equations:
        """What is compiled, once for all copies of the same."""
        powers, active = tuple(self._driven.shapes), self._active
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
        return self.equations.layout

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
        return BalancedContacts.of(self.layout, self.equations.groups, values)

    @cached_property
    def arguments_in_order(self) -> list[FloatArray]:
        """The parameters of the compiled equations, in the order of ``parameter_names``."""
        model, dofs = self.model, self.equations.dofs
        shapes = [each[dofs].ravel() for each in self._driven.shapes.values()]
        named = self.equations.linear.values(model) | dict(
            force_amplitude=np.array([self.excitation.amplitude]),
            force_shape=np.concatenate(shapes),
            static_force=self._at_rest(self._driven.static[dofs]),
        )
        named |= {name: getattr(model, name) for name in model.matrix_terms}
        for group in self.contacts.groups:
            own = self.contacts.values_of(group)
            named |= {name: own[of] for of, name in group.parameters.items()}
        names = self.equations.parameter_names
        return [np.ascontiguousarray(named[name], dtype=float) for name in names]

    def _at_rest(self, static: FloatArray) -> FloatArray:
        """A static force as the balance takes it: nothing where it leaves out harmonic 0."""
        return static if 0 in self.harmonics else static[:0]

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom that are unknown: all, or those of one sector."""
        return self.layout.n_dof

    @property
    def n_contacts(self) -> int:
        """Number of contacts that are balanced: all, or those of one sector."""
        return len(self.equations.contacts)

    @property
    def n_unknowns(self) -> int:
        """Number of Fourier coefficients."""
        return self.layout.n_unknowns

    @cached_property
    def peaking(self) -> Observed:
        """What has peaks: displacements, or the rows of an output."""
        peaks_of = self.peaks_of
        return self.observed[peaks_of] if isinstance(peaks_of, str) else Observed(self.layout)

    @cached_property
    def observed(self) -> dict[str, Observed]:
        """The outputs by name."""
        outputs = self.model.outputs.items()
        return {name: Observed(self.layout, output.rows) for name, output in outputs}

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
    def _acting(self) -> list[tuple[Group, dict[str, FloatArray], bool]]:
        """Groups whose contacts do something, values, and whether they are springs and sliders."""
        groups = [(group, group.values) for group in self.model.groups if group.n]
        return [
            (group, values, group.law.spring_sliders(0.0, values) is not None)
            for group, values in groups
            if group.law.acts(values).any()
        ]

    @cached_property
    def curved_groups(self) -> list[Group]:
        """The groups whose contacts do something and are no springs and sliders."""
        return [group for group, _, slides in self._acting if not slides]

    @cached_property
    def planar_groups(self) -> list[Group]:
        """The groups of springs and sliders with two tangential directions that do something."""
        return [g for g, _, slides in self._acting if slides and "across" in g.law.directions]

    @cached_property
    def loads_move(self) -> bool:
        """Whether contacts open, or the normal load of springs and sliders moves."""
        return any(
            slides and group.law.sliders(0.0, values) is None
            for group, values, slides in self._acting
        )

    @property
    def residual(self) -> ca.Function:
        """CasADi function of Eq. (9): unknowns, frequency and parameters to forces [N].

        TypeError for a condensed structure, whose linear part is none; `evaluate` has all of it.
        """
        self._check_compiled("residual")
        return self.equations.residual

    def derivative(self, name: str) -> ca.Function:
        """CasADi function of the sparse exact derivative of the residual by one of its inputs.

        ``name`` is ``unknowns``, ``frequency`` or a parameter; KeyError lists the names. Those by
        the parameters only for a condensed structure: TypeError for the others. ValueError by a
        parameter of the matrices with which the force of a moving base changes, and by deviations
        under a loss factor.
        """
        if name in {"unknowns", "frequency"}:
            self._check_compiled(f"derivative({name!r})")
            return self.equations.derivative(name)
        name = self.parameter_name(name)
        if reason := without_derivative(self.model, self.excitation).get(name):
            raise ValueError(reason)
        self.activate(name)
        return self.equations.derivative(name)

    def check_equations(self, balance: ca.Function) -> None:
        """Raise ValueError unless its `residual` is this function."""
        if self.equations.residual is not balance:
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
    def compiled(self) -> tuple[Equations, list[FloatArray]]:
        """The compiled equations, and their parameters in the order of ``parameter_names``."""
        return self.equations, self.arguments_in_order

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
        names = map(identifier, self.equations.parameter_names)
        named: dict[str, FloatArray] = dict(zip(names, self.arguments_in_order, strict=True))
        for group in self.equations.located:
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
        at = unknowns, frequency, self.arguments_in_order
        if self.equations.closed:
            imposed = switches if states is None else states.switches
            found, states = self.equations.in_closed_form(*at, imposed)
        else:
            states = self.locate(unknowns, frequency, switches) if states is None else states
            found = self.equations(*at, states)
        residual, magnitude, values, by_frequency = found
        jacobian = self.equations.assemble(values)
        size = float(magnitude[0]) + self.load_at_rest(frequency)
        return Evaluation(residual, size, jacobian, by_frequency, states)

    def load_at_rest(self, frequency: float) -> float:
        """Largest normal load [N] of what nothing drives, 0 of other problems.

        The round-off of loads is then all that is left of the balance.
        """
        return 0.0 if self.excitation.amplitude else self.contacts.largest_load(frequency)

    def force(self, frequency: float) -> FloatArray:
        """Coefficients of the force at an angular frequency, ``(n_dof, n_components)`` [N]."""
        shape, static = self._driven.force(frequency)
        force = self.excitation.amplitude * shape[: self.n_dof]
        if 0 in self.harmonics:
            force[:, self.basis.component(0)] += static[: self.n_dof]
        return force

    def contact_forces(self, unknowns: FloatArray, frequency: float) -> FloatArray:
        """Forces of the contacts of a condensed structure, ``(n_dof, n_components)`` [N]."""
        return self.layout.coefficients(self._evaluate_compiled(unknowns, frequency).residual)

    def amplification(self, unknowns: FloatArray, frequency: float) -> float:
        """Largest inertia force over the largest exciting force (0 without one)."""
        if self.structure is not None:
            return self.structure.amplification(unknowns, frequency, self.excitation.amplitude)
        shape = self._driven.force(frequency)[0][: self.n_dof]
        force = abs(self.excitation.amplitude) * np.abs(shape).max()
        if force == 0:
            return 0.0
        return self.equations.inertia(unknowns, frequency, self.arguments_in_order) / float(force)

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


def check_problem(problem: object, whole: bool = False, bends: bool = False) -> None:
    """Raise TypeError unless it is a HarmonicBalance, of a ``whole`` structure where needed.

    One that ``bends`` has matrices, or a dynamic stiffness with second derivatives.
    """
    problem = check.instance("problem", problem, HarmonicBalance, "a HarmonicBalance")
    known = problem.model.has_matrices or (bends and problem.model.bends)
    if (whole or bends) and not known:
        raise TypeError(f"problem: {problem.model.WITHOUT_MATRICES}")
