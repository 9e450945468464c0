"""The optimisation problem: aims that largest maxima and designs make, with bounds and constraints.

In epigraph form: a height of each response is no less than any of its maxima, each a quadratic
model in the logarithms of the design variables; the aim of the heights is minimised within a box
around the design by IPOPT, with exact derivatives. Of several aims the largest is minimised, as one
more height that is no less than any of them.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.design import tolerances
from symhbm.design.cases import FollowedMaximum, Maxima
from symhbm.design.program.aim import Aim, CaseStatistic, Limits
from symhbm.design.variables import DesignVariables
from symhbm.numerics import FloatArray

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
_FAR = 50.0
"""Logarithm that no height exceeds: one that an aim does not hold would go to infinity."""


@dataclass(frozen=True)
class Step:
    """The best design of the models within a box: ``x`` (n_variables,), ``predicted`` aim.

    Both in logarithms; ``solved`` tells whether IPOPT says so. ``weights`` are the multipliers of
    the contenders, response by response; ``on_bounds`` (n_variables,) and ``on_rows`` those of
    bounds and of the rows of `Program.rows`.
    """

    x: FloatArray
    predicted: float
    solved: bool
    weights: list[FloatArray]
    on_bounds: FloatArray
    on_rows: FloatArray


@dataclass(frozen=True)
class Program:
    """Aims to minimise over design variables, within ``limits``: of several the largest counts.

    Responses are those of all ``cases``, named peak by named peak; the ``statistic`` of the cases
    of each is what aims depend on.
    """

    variables: DesignVariables
    statistic: CaseStatistic
    aims: tuple[Aim, ...]
    limits: Limits
    peaks: tuple[str, ...]

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        """Which named peaks any aim depends on, (n_peaks,)."""
        return np.any([aim.uses for aim in self.aims], axis=0)

    def levels(self, heights: FloatArray) -> FloatArray:
        """Logarithm of the statistic of each named peak, (n_peaks,)."""
        return np.array([self.statistic.value(of_peak) for of_peak in self.by_peak(heights)])

    def by_peak(self, heights: Any) -> Any:
        """Heights or their numbers, (n_peaks, n_cases)."""
        return np.reshape(heights, (len(self.peaks), -1))

    def value(self, states: list[Maxima], x: FloatArray) -> float:
        """What designs compare by: the logarithm of the aim, less its offset and over its scale.

        Of several aims it is that of the largest.
        """
        peaks = self.levels(np.array([state.height for state in states]))
        return max(aim.relative(peaks, x) for aim in self.aims)

    def is_flat(self, maxima: list[FollowedMaximum]) -> bool:
        """Whether maxima, and the aims, do not change with the design, to second order."""
        arrays = [array for followed in maxima for array in (followed.gradient, followed.hessian)]
        still = all(np.abs(array).max() < tolerances.STILL for array in arrays)
        return still and bool(maxima) and not any(aim.by_design for aim in self.aims)

    def alike(self) -> tuple["Program", NDArray[np.intp]]:
        """The program of designs whose values of one parameter are one variable.

        With it, the number there of each variable here.
        """
        names = self.variables.names
        index = np.array([names.index(group.parameter) for group in self.variables.groups])
        variables = self.variables.common()
        aims = tuple(aim.merged(index, len(names)) for aim in self.aims)
        limits = self.limits.merged(index, len(names))
        return replace(self, variables=variables, aims=aims, limits=limits), index

    def nearest(self, x: FloatArray) -> FloatArray:
        """The design within bounds and constraints that is nearest to another, in logarithms.

        Of constraints that are not linear, the nearest that was found, or none that holds.
        """
        x = np.clip(x, self.variables.lower, self.variables.upper)
        if not self.limits.n_rows:
            return x
        d = ca.SX.sym("d", len(x))
        solution = self._solve(d, ca.sumsqr(d), [], np.zeros(len(x)), x, np.inf)
        return np.clip(x + solution["x"].full().ravel(), self.variables.lower, self.variables.upper)

    def step(self, states: list[Maxima], x: FloatArray, radius: float) -> Step:
        """Minimise the models at ``x`` within ``radius``, a factor's logarithm."""
        n = len(x)
        heights = self.by_peak(np.array([state.height for state in states]))
        numbers = self.by_peak(np.arange(len(states)))
        d = ca.SX.sym("d", n)
        symbols, start, rows, others = [d], [np.zeros(n)], [], []
        logarithms, counts = [], np.zeros(len(states), dtype=int)
        for used, of_peak, cases in zip(self.used, heights, numbers, strict=True):
            if not used:
                logarithms.append(ca.SX(0))
                continue
            epigraph = self.statistic.epigraph(of_peak)
            top = float(of_peak.max())
            symbols.append(epigraph.symbols)
            start.append(epigraph.start)
            logarithms.append(top + epigraph.logarithm)
            others += epigraph.rows
            for number, t in zip(cases, epigraph.heights, strict=True):
                for contender in states[number].contenders:
                    bend = ca.mtimes(ca.DM(contender.hessian), d)
                    model = ca.dot(ca.DM(contender.gradient), d) + ca.dot(d, bend) / 2
                    rows.append(contender.value - top + model - t)
                counts[number] = len(states[number].contenders)
        reached = [aim(ca.vertcat(*logarithms), ca.DM(x) + d) for aim in self.aims]
        objective = reached[0]
        if len(reached) > 1:
            objective = ca.SX.sym("largest")
            symbols.append(objective)
            start.append(np.array([self.value(states, x)]))
            others += [value - objective for value in reached]
        y, first = ca.vertcat(*symbols), np.concatenate(start)
        solution = self._solve(y, objective, [*rows, *others], first, x, radius)
        multipliers = solution["lam_g"].full().ravel()
        x_best = x + solution["x"].full().ravel()[:n]
        # IPOPT stays a little inside its bounds.
        for bound in (self.variables.lower, self.variables.upper):
            x_best = np.where(np.abs(x_best - bound) <= tolerances.AT_BOUND, bound, x_best)
        n_aims = len(reached) if len(reached) > 1 else 0
        return Step(
            np.clip(x_best, self.variables.lower, self.variables.upper),
            float(solution["f"]),
            solution["solved"],
            np.split(multipliers[: counts.sum()], np.cumsum(counts)[:-1]),
            solution["lam_x"].full().ravel()[:n],
            multipliers[len(multipliers) - n_aims - self.limits.n_rows :],
        )

    def _solve(self, y, objective, rows, start, x, radius):
        """Minimise over ``y``, the first of which are the change of ``x``; rows are 0 at most."""
        n = len(x)
        low, high = np.full(len(start), -np.inf), np.full(len(start), _FAR)
        low[:n] = np.maximum(self.variables.lower - x, -radius)
        high[:n] = np.minimum(self.variables.upper - x, radius)
        row = ca.vertcat(*rows)
        lower = np.append(np.full(row.shape[0], -np.inf), self.limits.low)
        upper = np.append(np.zeros(row.shape[0]), self.limits.high)
        nlp = {"x": y, "f": objective, "g": ca.vertcat(row, self.limits(ca.DM(x) + y[:n]))}
        solver = ca.nlpsol("design", "ipopt", nlp, _OPTIONS)
        bounds = dict(lbx=low, ubx=high, lbg=lower, ubg=upper)
        solution = solver(x0=np.clip(start, low, high), **bounds)
        return solution | {"solved": bool(solver.stats()["success"])}
