"""Second derivatives of the balance along a curve: by its unknowns and its moving parameter."""

from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import MANY, Equations, Evaluation, HarmonicBalance, SecondOrder
from symhbm.continuation.problem import ContinuationProblem, FrequencyProblem, ParameterProblem
from symhbm.numerics import FloatArray, full

_MADE: WeakKeyDictionary[Equations, dict[tuple[str, ...], SecondOrder]] = WeakKeyDictionary()
"""Second derivatives by equations and moving parameter: compiled once for all copies."""


class Curvature:
    """Second derivatives of the balance of a curve, weighted by multipliers.

    Raises TypeError, ValueError or NotImplementedError where they are not known, as `SecondOrder`.
    """

    def __init__(self, curve: FrequencyProblem | ParameterProblem):
        self._curve = curve
        names = (curve.name,) if isinstance(curve, ParameterProblem) else ()
        self._second_order = _second_order(curve.problem, names)

    def __call__(
        self,
        point: FloatArray,
        evaluation: Evaluation,
        multipliers: FloatArray,
        switches: NDArray[np.bool_],
    ) -> FloatArray:
        """Second derivatives (n_unknowns + 1, n_unknowns + 1) of the balance times multipliers.

        At a ``point`` (n_unknowns + 1,), unknowns and parameter, with its ``evaluation``;
        ``multipliers`` (n_unknowns,).
        """
        problem, frequency = self._curve.at(float(point[-1]))
        given = problem, point[:-1], frequency, multipliers, switches, evaluation
        hessian = full(self._second_order(*given).hessian)
        n = len(multipliers)
        along = np.zeros((len(hessian), n + 1))
        along[:n, :n] = np.eye(n)
        along[self._moving(problem), n] = self._weights(problem)
        return along.T @ hessian @ along

    def _moving(self, problem: HarmonicBalance) -> slice:
        """Where the moving parameter is among the variables."""
        if isinstance(self._curve, FrequencyProblem):
            return slice(problem.n_unknowns, problem.n_unknowns + 1)
        return self._second_order.places[self._curve.name]

    def _weights(self, problem: HarmonicBalance) -> FloatArray:
        """How much each of its entries moves."""
        if isinstance(self._curve, FrequencyProblem):
            return np.ones(1)
        return np.atleast_1d(self._curve.chosen(problem))


def curvature_of(curve: ContinuationProblem) -> Curvature | None:
    """The second derivatives of a curve; None where they are not known, or take minutes."""
    known = isinstance(curve, FrequencyProblem | ParameterProblem)
    if not known or curve.problem.n_unknowns > MANY:
        return None
    try:
        return Curvature(curve)
    except (TypeError, ValueError, NotImplementedError):
        return None


def _second_order(problem: HarmonicBalance, names: tuple[str, ...]) -> SecondOrder:
    of_equations = _MADE.setdefault(problem.compiled[0], {})
    if names not in of_equations:
        of_equations[names] = SecondOrder(problem, names)
    return of_equations[names]
