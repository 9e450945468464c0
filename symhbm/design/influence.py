"""How an optimal design and its response move with every parameter of the problem."""

from dataclasses import replace

import numpy as np

from symhbm.balance import SecondOrder
from symhbm.design.cases import Cases
from symhbm.design.optimum import LEVEL, ActiveSet
from symhbm.numerics import FloatArray
from symhbm.peaks import Conditions


def parameters_of(problem) -> list[str]:
    """Names of the parameters that may vary continuously."""
    named = problem.parameters
    springs = problem.model.has_cubic_springs
    return [
        name
        for name, value in named.items()
        if not isinstance(value, int) and (name != "cubic_stiffness" or springs)
    ]


def influence(cases: Cases, held: ActiveSet) -> dict[str, tuple[float, FloatArray]]:
    """Derivatives of the statistic [m] and of the variables by each parameter, all values alike.

    Those of the variables (n_variables,) are in units of the variable over that of the parameter;
    NaN where the response is level in some direction, so that the optimum has no one place.
    """
    names = parameters_of(cases.response(held.cases[0]).at(held.x))
    by_value = np.empty((len(held.pieces), len(names)))
    by_gradient = np.empty((len(held.pieces), len(held.x), len(names)))
    compiled: dict[int, SecondOrder] = {}
    for k, (case, piece) in enumerate(zip(held.cases, held.pieces, strict=True)):
        response = cases.response(case)
        problem = response.at(held.x)
        key = id(problem.residual)
        if key not in compiled:
            compiled[key] = SecondOrder(problem, names)
        second_order = compiled[key]
        summit = replace(piece.summit, problem=problem)
        conditions = Conditions(second_order, summit, piece.multipliers)
        first = problem.n_unknowns + 1
        alike = np.zeros((second_order.n_variables - first, len(names)))
        for number, name in enumerate(names):
            place = second_order.places[name]
            alike[place.start - first : place.stop - first, number] = 1.0
        chosen = response.space.derivative(problem, second_order.places)
        amplitude, slope = summit.amplitude, conditions.gradient
        mixed = chosen.T @ conditions.hessian @ alike
        # The entries of a designed parameter are proportional to its variable.
        by_value[k] = slope @ alike / amplitude
        by_gradient[k] = mixed / amplitude - np.outer(piece.gradient, by_value[k])
    top = held.program.value(held.heights)
    by_statistic = np.exp(top) * (held.weights @ by_value)
    moved = held.derivative(by_gradient, by_value)
    moved *= held.program.space.values(held.x)[:, None]
    if not held.curvature > LEVEL:
        moved[:] = np.nan
    return {
        name: (float(by_statistic[number]), moved[:, number]) for number, name in enumerate(names)
    }
