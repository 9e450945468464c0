"""Derivatives of an optimal design and its response by every parameter of the problem."""

from dataclasses import replace

import numpy as np

from symhbm.balance import SecondOrder
from symhbm.design import tolerances
from symhbm.design.cases import Cases
from symhbm.design.program import ActiveSet
from symhbm.numerics import FloatArray
from symhbm.peaks import Conditions


def influence(cases: Cases, active: ActiveSet) -> dict[str, tuple[float, FloatArray]]:
    """Derivatives of the statistic [m] and of the variables by each parameter, all values alike.

    Those of the variables (n_variables,) are in units of the variable over that of the parameter;
    NaN where the response is constant in some direction, so that the optimum is not isolated, and
    by parameters that an active constraint depends on by itself.
    """
    names = cases.response(active.cases[0]).at(active.x).differentiable
    by_value = np.empty((len(active.maxima), len(names)))
    by_gradient = np.empty((len(active.maxima), len(active.x), len(names)))
    compiled: dict[int, SecondOrder] = {}
    for k, (case, followed) in enumerate(zip(active.cases, active.maxima, strict=True)):
        response = cases.response(case)
        problem = response.at(active.x)
        key = id(problem.compiled[0].residual)
        if key not in compiled:
            compiled[key] = SecondOrder(problem, names)
        second_order = compiled[key]
        maximum = replace(followed.maximum, problem=problem)
        conditions = Conditions.of(second_order, maximum, followed.multipliers)
        first = problem.n_unknowns + 1
        alike = np.zeros((second_order.n_variables - first, len(names)))
        for number, name in enumerate(names):
            entries = second_order.places[name]
            alike[entries.start - first : entries.stop - first, number] = 1.0
        chosen = response.variables.derivative(problem, second_order.places)
        amplitude, slope = maximum.amplitude, conditions.gradient
        mixed = chosen.T @ conditions.hessian @ alike
        # The entries of a designed parameter are proportional to its variable.
        by_value[k] = slope @ alike / amplitude
        by_gradient[k] = mixed / amplitude - np.outer(followed.gradient, by_value[k])
    [top] = active.program.levels(active.heights)
    by_statistic = np.exp(top) * (active.weights @ by_value)
    moved = active.derivative(by_gradient, by_value)
    moved *= active.program.variables.values(active.x)[:, None]
    if not active.curvature > tolerances.LEVEL:
        moved[:] = np.nan
    if active.held:
        unknown = [name in active.program.limits.others for name in names]
        by_statistic[unknown], moved[:, unknown] = np.nan, np.nan
    return {
        name: (float(by_statistic[number]), moved[:, number]) for number, name in enumerate(names)
    }
