"""The equations to second order: by unknowns, frequency and any parameters, exactly.

At fixed events of the contacts CasADi differentiates the balance weighted by multipliers. The
events move with motion, frequency and parameters; what that adds each contact law tells. A
structure without matrices adds its own: its dynamic stiffness bends with the frequency.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import scipy.sparse as sp

from symhbm.balance.equations import BalancedGroup, identifier
from symhbm.balance.evaluation import ContactStates, Evaluation
from symhbm.balance.harmonic_balance import HarmonicBalance, check_problem
from symhbm.numerics import DENSE_LIMIT, Assembly, Compiled, FloatArray


@dataclass(frozen=True)
class Expansion:
    """Derivatives at one point, of the variables unknowns, frequency and parameters, in this order.

    ``evaluation`` is that of the balance; ``jacobian`` (n_unknowns, n_variables), its derivative;
    ``hessian`` (n_variables, n_variables), the second derivative of the balance times the
    multipliers: both dense or sparse by the number of variables.
    """

    evaluation: Evaluation
    jacobian: Any
    hessian: Any

    @property
    def by_parameters(self) -> Any:
        """Derivative of the balance by the parameters, (n_unknowns, n_parameters)."""
        return self.jacobian[:, self.jacobian.shape[0] + 1 :]


class SecondOrder:
    """Second derivatives of a problem and all its copies by ``with_parameters``.

    ``names`` are those of the parameters that are variables: their values at each blade or contact
    that is balanced, one name after the other; ``places`` tells where each is among the variables.
    Raises ValueError for friction over samples, which is piecewise linear, and TypeError for a
    structure that does not tell the second derivative of its dynamic stiffness.
    """

    def __init__(self, problem: HarmonicBalance, names: Sequence[str] = ()):
        if problem.samples is not None:
            raise ValueError(
                f"samples={problem.samples}: expected a problem with located switching angles; "
                "friction over samples is piecewise linear and has no second derivative"
            )
        for name in names:
            problem.derivative(name)  # compiles its contacts, though they do nothing so far
        check_problem(problem, bends=True)
        self._balance = problem.equations.residual
        symbol = {
            name: ca.SX.sym(name, self._balance.sparsity_in(name))
            for name in self._balance.name_in()
        }
        (balance,) = self._balance.call(list(symbol.values()))
        self.names = tuple(map(problem.parameter_name, names))
        first = problem.n_unknowns + 1
        self.places: dict[str, slice] = {}
        for name in self.names:
            count = symbol[identifier(name)].nnz()
            self.places[name] = slice(first, first + count)
            first += count
        self.n_variables = first
        variables = self.variables_of(symbol)
        multipliers = ca.SX.sym("multipliers", problem.n_unknowns)
        jacobian = ca.jacobian(balance, variables)
        hessian = ca.hessian(ca.dot(multipliers, balance), variables)[0]
        added, of_events = self.of_events(problem, symbol)
        hessian += of_events
        inputs = [*symbol.values(), multipliers, *added]
        self._compiled = Compiled(ca.Function("second_order", inputs, [jacobian, hessian]))
        by_parameters = ca.densify(jacobian[:, problem.n_unknowns + 1 :])
        self._first = Compiled(ca.Function("by_parameters", [*symbol.values()], [by_parameters]))
        as_full = self.n_variables <= DENSE_LIMIT
        self._assemblies = tuple(Assembly(m.sparsity(), as_full) for m in (jacobian, hessian))

    def __call__(
        self,
        problem: HarmonicBalance,
        unknowns: FloatArray,
        frequency: float,
        multipliers: FloatArray,
        switches: Any = None,
        evaluation: Evaluation | None = None,
    ) -> Expansion:
        """Derivatives at ``unknowns`` (n_unknowns,) [m] and ``frequency`` [rad/s].

        ``multipliers`` (n_unknowns,) weigh the balance; ``switches`` (n_switches,) imposes states
        of contacts; ``evaluation`` is that of the balance there, in
        these states, where it is known.
        """
        problem.check_equations(self._balance)
        if evaluation is None:
            evaluation = problem.evaluate(unknowns, frequency, switches)
        contacts = evaluation.states
        weights = problem.layout.relative(multipliers)
        added = self.added(
            *(problem, unknowns, frequency, contacts),
            lambda group: problem.contacts.motions(group, weights),
        )
        inputs = inputs_at(problem, unknowns, frequency, contacts)
        found = self._compiled(*inputs, multipliers, *added)
        jacobian, hessian = (
            assemble(values) for assemble, values in zip(self._assemblies, found, strict=True)
        )
        if problem.structure is not None:
            bend = problem.structure.curvature(
                unknowns, frequency, problem.excitation.amplitude, multipliers
            )
            jacobian = self._with_structure(jacobian, evaluation)
            hessian = hessian + self._of_structure(*bend)
        return Expansion(evaluation, jacobian, hessian)

    def by_parameters(
        self,
        problem: HarmonicBalance,
        unknowns: FloatArray,
        frequency: float,
        states: ContactStates,
    ) -> FloatArray:
        """First derivatives of the balance by the parameters, (n_unknowns, n_parameters)."""
        (found,) = self._first(*inputs_at(problem, unknowns, frequency, states))
        return found.reshape(-1, problem.n_unknowns).T

    def _with_structure(self, jacobian: Any, evaluation: Evaluation) -> Any:
        """The derivatives with those of a structure without matrices by unknowns and frequency."""
        first = np.column_stack([evaluation.jacobian, evaluation.by_parameter])
        others = jacobian[:, first.shape[1] :]
        return (
            sp.hstack([first, others], "csc") if sp.issparse(others) else np.hstack([first, others])
        )

    def _of_structure(self, mixed: FloatArray, twice: float, with_amplitude: float) -> Any:
        """Second derivatives of a structure without matrices, see `DynamicStiffness.curvature`."""
        unit, row = np.zeros((2, self.n_variables))
        at = len(mixed)
        unit[at], row[:at], row[at] = 1.0, mixed, twice / 2
        if "force_amplitude" in self.places:
            row[self.places["force_amplitude"]] = with_amplitude
        if self.n_variables > DENSE_LIMIT:
            product = sp.csc_array(unit[:, None]) @ sp.csc_array(row[None])
            return product + product.T
        return np.outer(unit, row) + np.outer(row, unit)

    def variables_of(self, symbol: dict[str, Any]) -> Any:
        """The variables, of the symbols of all inputs of the balance."""
        parameters = (symbol[identifier(name)].nz[:] for name in self.names)
        return ca.vertcat(symbol["unknowns"], symbol["frequency"], *parameters)

    def of_events(self, problem: HarmonicBalance, symbol: dict[str, Any]) -> tuple[list[Any], Any]:
        """What events add to second derivatives, and the symbols that it is made of, by `added`."""
        variables, added, result = self.variables_of(symbol), [], ca.SX(*[self.n_variables] * 2)
        for group in problem.contacts.groups:
            if not group.n or not group.law.n_events(problem.basis):
                continue
            motions = problem.equations.motions_of(group, symbol)
            each = [group.law.event_variables(at) for at in motions]
            spread = ca.jacobian(ca.vertcat(*each), variables)
            size = spread.shape[0] // group.n
            added.append(ca.SX.sym(f"added_{group.name}", size, group.n * size))
            blocks = ca.diagcat(*ca.horzsplit(added[-1], size))
            result += ca.mtimes([spread.T, blocks, spread])
        return added, result

    @staticmethod
    def added(
        problem: HarmonicBalance,
        unknowns: FloatArray,
        frequency: float,
        states: ContactStates,
        weights: Callable[[BalancedGroup], FloatArray],
    ) -> list[FloatArray]:
        """Numbers for the symbols of `of_events`; ``weights`` (n, m K) are those of forces."""
        relative = problem.layout.relative(unknowns)
        return [
            group.law.moving_events(
                problem.contacts.at(group, relative, frequency),
                states.groups[group.name],
                weights(group),
            ).ravel()
            for group in problem.contacts.groups
            if group.n and group.law.n_events(problem.basis)
        ]


def inputs_at(
    problem: HarmonicBalance, unknowns: FloatArray, frequency: float, states: ContactStates
) -> list[FloatArray]:
    """Stored entries of the inputs of the residual, in their order."""
    named = problem.arguments(unknowns, frequency, states=states)
    names = problem.equations.residual.name_in()
    return [np.ravel(named[name], order="F") for name in names]
