"""The optimisation problem: a statistic of the largest maxima, with bounds and constraints.

In epigraph form: ``t`` of each response is no less than any of its maxima, each a quadratic model
in the logarithms of the design variables; the statistic of the ``t`` is minimised within a box
around the design by IPOPT, with exact derivatives.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
import scipy

from symhbm.design import tolerances
from symhbm.design.maxima import Maxima
from symhbm.design.variables import DesignVariables
from symhbm.numerics import FloatArray

if TYPE_CHECKING:
    from scipy.optimize import LinearConstraint

_OPTIONS = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-13,
    "ipopt.acceptable_tol": 1e-11,
    "ipopt.max_iter": 300,
    "ipopt.mu_strategy": "adaptive",
    "ipopt.bound_relax_factor": 0.0,
}


class Statistic(StrEnum):
    """Statistic of the largest responses of several cases that is minimised."""

    WORST = "worst"
    MEAN = "mean"
    TAIL = "tail"


@dataclass(frozen=True)
class Step:
    """The best design of the models within a box: ``x`` (n_variables,), ``predicted`` statistic.

    Both in logarithms; ``solved`` tells whether IPOPT says so. ``weights`` are the multipliers of
    the contenders, case by case, which sum to 1; ``on_bounds`` (n_variables,) and ``on_constraint``
    those of bounds and constraint rows.
    """

    x: FloatArray
    predicted: float
    solved: bool
    weights: list[FloatArray]
    on_bounds: FloatArray
    on_constraint: FloatArray


@dataclass(frozen=True)
class Program:
    """A statistic to minimise over design variables.

    ``tail`` is the share of the worst cases that `Statistic.TAIL` averages. ``constraint`` is on
    the values of the variables, not on their logarithms.
    """

    variables: DesignVariables
    statistic: Statistic = Statistic.WORST
    tail: float = 0.1
    constraint: "LinearConstraint | None" = None

    def value(self, heights: FloatArray) -> float:
        """Logarithm of the statistic of amplitudes whose logarithms are ``heights`` (n_cases,)."""
        top = float(np.max(heights))
        if not np.isfinite(top) or self.statistic == Statistic.WORST:
            return top
        return top + float(np.log(self.weights(heights) @ np.exp(heights - top)))

    def weights(self, heights: FloatArray) -> FloatArray:
        """Share of each case in the statistic of amplitudes, (n_cases,)."""
        n_cases = len(heights)
        if self.statistic == Statistic.MEAN:
            return np.full(n_cases, 1 / n_cases)
        share = 1 / n_cases if self.statistic == Statistic.WORST else self.tail
        # The worst cases have each 1 / (share n), until the shares are used up.
        order = np.argsort(-heights)
        left = 1 - np.arange(n_cases) / (share * n_cases)
        result = np.zeros(n_cases)
        result[order] = np.clip(left, 0, 1 / (share * n_cases))
        return result

    def tied(self, heights: FloatArray) -> list[int]:
        """Cases that are equally high at the lower end of the statistic, where it has a kink."""
        if self.statistic == Statistic.MEAN:
            return []
        lowest = heights[self.weights(heights) > 0].min()
        return np.flatnonzero(np.abs(heights - lowest) <= tolerances.TIE).tolist()

    def feasible(self) -> bool:
        """Whether any design satisfies bounds and constraint."""
        if self.constraint is None:
            return True
        rows, low, high = self.rows()
        upper, lower = np.isfinite(high), np.isfinite(low)
        solution = scipy.optimize.linprog(
            np.zeros(self.variables.n_variables),
            A_ub=np.vstack([rows[upper], -rows[lower]]),
            b_ub=np.concatenate([high[upper], -low[lower]]),
            bounds=[(group.lower, group.upper) for group in self.variables.groups],
        )
        return bool(solution.status == 0)

    def nearest(self, x: FloatArray) -> FloatArray:
        """The design within bounds and constraint that is nearest to another, in logarithms."""
        x = np.clip(x, self.variables.lower, self.variables.upper)
        if self.constraint is None:
            return x
        d = ca.SX.sym("d", len(x))
        solution = self._solve(d, ca.sumsqr(d), [], [], np.zeros(len(x)), x, np.inf)
        return np.clip(x + solution["x"].full().ravel(), self.variables.lower, self.variables.upper)

    def step(self, states: list[Maxima], x: FloatArray, radius: float) -> Step:
        """Minimise the models at ``x`` within ``radius``, a factor's logarithm."""
        n = len(x)
        heights = np.array([state.height for state in states])
        top = float(heights.max())
        worst = self.statistic == Statistic.WORST
        n_heights = 1 if worst else len(states)
        y = ca.SX.sym("y", n + n_heights + (1 + n_heights) * (self.statistic == Statistic.TAIL))
        d, t = y[:n], y[n : n + n_heights]
        rows, upper = [], []
        for number, state in enumerate(states):
            for contender in state.contenders:
                hessian = ca.DM(contender.hessian)
                model = ca.dot(ca.DM(contender.gradient), d) + ca.dot(d, ca.mtimes(hessian, d)) / 2
                rows.append(contender.value - top + model - t[0 if worst else number])
                upper.append(0.0)
        start = np.zeros(y.shape[0])
        start[n : n + n_heights] = 0.0 if worst else heights - top
        if worst:
            objective = t[0]
        elif self.statistic == Statistic.MEAN:
            objective = ca.log(ca.sum1(ca.exp(t)) / n_heights)
        else:
            quantile, beyond = y[n + n_heights], y[n + n_heights + 1 :]
            objective = quantile + ca.sum1(beyond) / (self.tail * n_heights)
            # Where the tail holds all cases, the quantile has no other lower bound.
            rows += [ca.exp(t) - quantile - beyond, -beyond, -quantile]
            upper += [0.0] * (2 * n_heights + 1)
            amplitudes = np.exp(heights - top)
            start[n + n_heights] = np.quantile(amplitudes, 1 - self.tail)
            start[n + n_heights + 1 :] = np.maximum(amplitudes - start[n + n_heights], 0)
        solution = self._solve(y, objective, rows, upper, start, x, radius)
        value, scale = float(solution["f"]), 1.0
        if self.statistic == Statistic.TAIL:
            scale, value = max(value, 1e-300), float(np.log(max(value, 1e-300)))
        multipliers = solution["lam_g"].full().ravel() / scale
        counts = [len(state.contenders) for state in states]
        x_best = x + solution["x"].full().ravel()[:n]
        # IPOPT stays a little inside its bounds.
        for bound in (self.variables.lower, self.variables.upper):
            x_best = np.where(np.abs(x_best - bound) <= tolerances.AT_BOUND, bound, x_best)
        return Step(
            np.clip(x_best, self.variables.lower, self.variables.upper),
            top + value,
            solution["solved"],
            np.split(multipliers[: sum(counts)], np.cumsum(counts)[:-1]),
            solution["lam_x"].full().ravel()[:n] / scale,
            multipliers[len(upper) :],
        )

    def _solve(self, y, objective, rows, upper, start, x, radius):
        """Minimise over ``y``, the first of which are the change of ``x``."""
        n = len(x)
        low, high = np.full(len(start), -np.inf), np.full(len(start), np.inf)
        low[:n] = np.maximum(self.variables.lower - x, -radius)
        high[:n] = np.minimum(self.variables.upper - x, radius)
        lower = [-np.inf] * len(upper)
        if self.constraint is not None:
            matrix, at_least, at_most = self.rows()
            values = ca.DM(np.exp(x)) * ca.exp(y[:n])
            rows = [*rows, ca.mtimes(ca.DM(matrix), values)]
            lower, upper = [*lower, *at_least], [*upper, *at_most]
        nlp = {"x": y, "f": objective, "g": ca.vertcat(*rows)}
        solver = ca.nlpsol("design", "ipopt", nlp, _OPTIONS)
        bounds = dict(lbx=low, ubx=high, lbg=lower, ubg=upper)
        solution = solver(x0=np.clip(start, low, high), **bounds)
        return solution | {"solved": bool(solver.stats()["success"])}

    def rows(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Matrix and bounds of the constraint on the values, each row of size 1 at the most."""
        constraint = self.constraint
        if constraint is None:
            return np.zeros((0, self.variables.n_variables)), np.zeros(0), np.zeros(0)
        matrix = np.atleast_2d(np.asarray(constraint.A, dtype=float))
        scale = np.abs(matrix) @ np.exp(self.variables.upper)
        low, high = (
            np.broadcast_to(np.asarray(bound, dtype=float), len(matrix)) / scale
            for bound in (constraint.lb, constraint.ub)
        )
        return matrix / scale[:, None], low, high
