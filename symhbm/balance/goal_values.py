"""Values of goals at solutions, and their derivatives to second order.

At fixed events CasADi differentiates the expression of a goal. The events move with the motion;
what that adds to second derivatives is that of forces, weighted by the slope of the goal by them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from symhbm.balance.equations import identifier
from symhbm.balance.evaluation import ContactStates
from symhbm.balance.goals import ContactSymbols, Goal, Solution
from symhbm.balance.harmonic_balance import HarmonicBalance
from symhbm.balance.second_order import SecondOrder, inputs_at
from symhbm.model.contacts import graph_of
from symhbm.numerics import DENSE_LIMIT, RADIANS, Assembly, Compiled, FloatArray

_ROUND_OFF = 1e-12
"""Value over the sum of its absolute terms that is 0: stuck contacts dissipate no less."""


@dataclass(frozen=True)
class _Expression:
    """A goal of one structure: its ``inputs`` by name, contact ``forces`` by group, and symbols.

    ``value`` and the sum ``size`` of its absolute terms; ``weights``, its slopes by the forces of
    each group, a contact a column.
    """

    inputs: dict[str, Any]
    value: Any
    size: Any
    weights: dict[str, Any]

    @classmethod
    def of(cls, goal: Goal, problem: HarmonicBalance) -> _Expression:
        """The expression of a goal, of the inputs of the residual."""
        equations, basis = problem.equations, problem.basis
        residual = equations.residual
        symbol = {name: ca.SX.sym(name, residual.sparsity_in(name)) for name in residual.name_in()}
        parameters = {
            name: symbol[identifier(name)]
            for name in equations.parameter_names
            if name in problem.parameters
        }
        contacts: dict[str, list[ContactSymbols]] = {group.name: [] for group in problem.groups}
        given, found, forces = [], [], {}
        for group in equations.groups:
            kernel, n_events = graph_of(group.law, basis).force, group.law.n_events(basis)
            events = symbol[identifier(group.events)] if n_events else ca.SX(0, group.n)
            size = basis.n_components * len(group.law.directions)
            forces[group.name] = ca.SX.sym(f"force_{group.name}", size, group.n)
            for j, at in enumerate(equations.motions_of(group, symbol)):
                force = forces[group.name][:, j]
                contacts[group.name].append(ContactSymbols(group.law, at, force))
                packed, travel = ca.vertcat(*at.values.values()), ca.DM.zeros(size)
                given.append(force)
                found.append(kernel(at.motion, travel, at.frequency, packed, events[:, j])[0])
        n_dof = len(equations.dofs)
        coefficients = ca.reshape(symbol["unknowns"], basis.n_components, n_dof)
        at = Solution(problem.model, basis, coefficients, symbol["frequency"], parameters, contacts)
        value = ca.SX(goal.value(at))
        symmetry = problem.symmetry if goal.additive else None
        value *= 1 if symmetry is None else symmetry.n_sectors
        slopes = {name: ca.gradient(value, force) for name, force in forces.items()}
        terms = [ca.gradient(value, symbol["unknowns"]) * symbol["unknowns"]]
        terms += [ca.vec(slopes[name] * force) for name, force in forces.items()]
        outputs = [value, ca.sum1(ca.fabs(ca.vertcat(*terms))), *slopes.values()]
        value, size, *weights = ca.substitute(outputs, given, found)
        return cls(symbol, value, size, dict(zip(slopes, weights, strict=True)))


class ValueOf(NamedTuple):
    """A goal at one solution: its value, and the sum ``size`` of its absolute terms.

    ``slope`` (n_unknowns + 1,) is its derivative by unknowns and frequency.
    """

    value: float
    size: float
    slope: FloatArray

    @classmethod
    def at(
        cls,
        goal: Goal,
        problem: HarmonicBalance,
        unknowns: FloatArray,
        frequency: float,
        states: ContactStates,
    ) -> ValueOf:
        """The goal at ``unknowns`` [m] and ``frequency`` [rad/s], of located contacts.

        Raises ArithmeticError where it is no number.
        """

        def made() -> Compiled:
            of = _Expression.of(goal, problem)
            variables = ca.vertcat(of.inputs["unknowns"], of.inputs["frequency"])
            outputs = [of.value, of.size, ca.gradient(of.value, variables)]
            outputs = [ca.densify(output) for output in outputs]
            return Compiled(ca.Function("goal", [*of.inputs.values()], outputs))

        compiled = problem.equations.once((type(goal), repr(goal)), made)
        value, size, slope = compiled(*inputs_at(problem, unknowns, frequency, states))
        if not (np.isfinite(value[0]) and np.all(np.isfinite(slope))):
            raise ArithmeticError(f"{goal!r} is no number at {frequency:g} rad/s")
        if abs(value[0]) <= _ROUND_OFF * size[0]:
            return cls(0.0, float(size[0]), np.zeros(len(slope)))
        return cls(float(value[0]), float(size[0]), slope)

    def checked(self, goal: Goal, frequency: float) -> ValueOf:
        """Itself; ValueError where it is negative, at a solution of a ``frequency`` [rad/s]."""
        if self.value < 0:
            raise ValueError(
                f"{goal!r}: expected a goal of no less than 0, got {self.value:g} {goal.units} at "
                f"{frequency / RADIANS:g} Hz"
            )
        return self


class GoalOrder:
    """Derivatives of a goal by the variables of a `SecondOrder`, for all copies of its problem."""

    @classmethod
    def of(cls, goal: Goal, problem: HarmonicBalance, second_order: SecondOrder) -> GoalOrder:
        """That of a goal of one of the problems of a `SecondOrder`, compiled once."""
        key = type(goal), repr(goal), second_order.names
        return problem.equations.once(key, lambda: cls(goal, problem, second_order))

    def __init__(self, goal: Goal, problem: HarmonicBalance, second_order: SecondOrder):
        of = _Expression.of(goal, problem)
        inputs, self._names = [*of.inputs.values()], [*of.weights]
        weights = [ca.densify(weight) for weight in of.weights.values()]
        self._weights = Compiled(ca.Function("weights", inputs, weights))
        hessian, gradient = ca.hessian(of.value, second_order.variables_of(of.inputs))
        added, of_events = second_order.of_events(problem, of.inputs)
        hessian += of_events
        outputs = [ca.densify(gradient), hessian]
        self._derivatives = Compiled(ca.Function("goal_order", [*inputs, *added], outputs))
        as_full = second_order.n_variables <= DENSE_LIMIT
        self._assemble = Assembly(hessian.sparsity(), as_full)
        self._added = second_order.added

    def __call__(
        self,
        problem: HarmonicBalance,
        unknowns: FloatArray,
        frequency: float,
        states: ContactStates,
    ) -> tuple[FloatArray, Any]:
        """Gradient (n_variables,), and second derivatives, dense or sparse by their number."""
        inputs = inputs_at(problem, unknowns, frequency, states)
        weights = dict(zip(self._names, self._weights(*inputs), strict=True))
        added = self._added(
            *(problem, unknowns, frequency, states),
            lambda group: weights[group.name].reshape(group.n, -1),
        )
        gradient, hessian = self._derivatives(*inputs, *added)
        return gradient, self._assemble(hessian)
