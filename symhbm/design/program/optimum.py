"""First-order conditions of an optimal design: multipliers, the last digits, and derivatives.

With given active maxima, bounds and rows, an optimum solves equations: the weighted gradients
cancel, the maxima of one height are equally high, and active aims and constraints are on their
limits. Newton's method on these gives the last digits, and their derivatives those of the optimum
by any parameter.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from scipy.linalg import null_space

from symhbm.design import tolerances
from symhbm.design.cases import FollowedMaximum, Maxima
from symhbm.design.program.program import Program, Step
from symhbm.numerics import FloatArray

_STILL = 1e-9
"""Share of the variables in a change that is none of theirs."""


@dataclass(frozen=True)
class ActiveSet:
    """Active maxima, bounds and rows of a design ``x`` (n_variables,).

    ``cases`` and ``maxima`` are the active maxima, in the order of responses and frequencies, with
    ``weights`` (n_active,); ``free`` (n_variables,) tells which variables are off their bounds;
    ``rows`` (n_rows,) are the numbers of active rows, first the aims, where there are several, then
    constraints, with their ``row_multipliers`` (n_rows,); ``heights`` (n_responses,) are the
    logarithms of the largest responses.
    """

    program: Program
    x: FloatArray
    cases: list[int]
    maxima: list[FollowedMaximum]
    weights: FloatArray
    free: np.ndarray
    rows: np.ndarray
    row_multipliers: FloatArray
    heights: FloatArray

    @classmethod
    def of(cls, program: Program, x: FloatArray, states: list[Maxima], step: Step) -> "ActiveSet":
        """The active set of a design, by the multipliers of a ``step`` of the models from it."""
        chosen = [
            (case, followed, weight)
            for case, (state, weights) in enumerate(zip(states, step.weights, strict=True))
            for followed, weight in zip(state.contenders, weights, strict=False)
            if weight > tolerances.ACTIVE
        ]
        chosen.sort(key=lambda entry: (entry[0], entry[1].maximum.frequency))
        hold = np.abs(step.on_rows) > tolerances.ACTIVE
        lower, upper = program.variables.lower, program.variables.upper
        at_bound = (x - lower <= tolerances.AT_BOUND) | (upper - x <= tolerances.AT_BOUND)
        return cls(
            program,
            x,
            [case for case, _, _ in chosen],
            [followed for _, followed, _ in chosen],
            np.array([weight for _, _, weight in chosen]),
            ~(at_bound & (np.abs(step.on_bounds) > tolerances.ACTIVE)),
            np.flatnonzero(hold),
            step.on_rows[hold],
            np.array([state.height for state in states]),
        )

    @property
    def n_aims(self) -> int:
        """Number of aims that are rows: all where there are several."""
        return len(self.program.aims) if len(self.program.aims) > 1 else 0

    @property
    def held(self) -> list[str]:
        """Names of the constraints that are active."""
        numbers = self.rows[self.rows >= self.n_aims] - self.n_aims
        return [*dict.fromkeys(self.program.limits.names[number] for number in numbers)]

    @property
    def gradients(self) -> FloatArray:
        """Gradients of the active maxima, (n_active, n_variables)."""
        return np.array([followed.gradient for followed in self.maxima]).reshape(-1, len(self.x))

    @property
    def bound_multipliers(self) -> FloatArray:
        """Slope of the logarithm of the aim that bounds balance, (n_variables,)."""
        slopes = self._smooth.gradient + self.row_multipliers @ self._smooth.slopes
        return self.weights @ self.gradients + slopes[: len(self.x)]

    @property
    def stationarity(self) -> float:
        """Largest slope of the logarithm of the aim along the free variables."""
        return float(np.abs(self.bound_multipliers[self.free]).max(initial=0.0))

    @property
    def curvature(self) -> float:
        """Smallest second derivative of the logarithm of the aim along designs that are free.

        Infinite with as many active conditions as variables: the aim rises linearly all around.
        """
        matrix, _ = self.system()
        n_free = int(self.free.sum())
        last = n_free + len(self._smooth.levels)
        # Changes of variables and heights along which all active conditions stay satisfied.
        kept = null_space(matrix[last:, :last], rcond=1e-9)
        if not kept.shape[1]:
            return np.inf
        # Heights follow from the variables, along which curvatures are measured.
        _, sizes, turned = np.linalg.svd(kept[:n_free], full_matrices=False)
        kept = kept @ (turned.T / sizes)[:, sizes > _STILL]
        return float(np.linalg.eigvalsh(kept.T @ matrix[:last, :last] @ kept).min())

    def step(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Newton's step of the variables, and the weights and row multipliers after it."""
        matrix, right = self.system()
        solution = np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-13)[0], dtype=np.float64)
        change = np.zeros(len(self.x))
        n_free = int(self.free.sum())
        change[self.free] = solution[:n_free]
        last = len(solution) - len(self.rows)
        return change, solution[last - len(self.maxima) : last], solution[last:]

    def derivative(self, by_gradient: FloatArray, by_value: FloatArray) -> FloatArray:
        """Derivatives of the variables by parameters, (n_variables, n_parameters).

        ``by_gradient`` (n_active, n_variables, n_parameters) and ``by_value``
        (n_active, n_parameters) are those of the gradients and values of the active maxima.
        """
        matrix, _ = self.system()
        n_free, last = int(self.free.sum()), len(matrix) - len(self.rows)
        right = np.zeros((len(matrix), by_value.shape[1]))
        right[:n_free] = -np.einsum("k,kvp->vp", self.weights, by_gradient)[self.free]
        right[last - len(self.maxima) : last] = -by_value
        result = np.zeros((len(self.x), by_value.shape[1]))
        result[self.free] = np.linalg.lstsq(matrix, right, rcond=1e-13)[0][:n_free]
        return result

    def system(self) -> tuple[FloatArray, FloatArray]:
        """Matrix and right side of Newton's method on the conditions.

        The unknowns are the changes of the free variables and of the heights, and the weights and
        row multipliers after it.
        """
        smooth, n, n_levels = self._smooth, len(self.x), len(self._smooth.levels)
        hessian = smooth.hessian.copy()
        for weight, followed in zip(self.weights, self.maxima, strict=True):
            hessian[:n, :n] += weight * followed.hessian
        # Maxima less their heights, and rows, are 0 or on their limits.
        equations = np.zeros((len(self.maxima) + len(self.rows), n + n_levels))
        equations[: len(self.maxima), :n] = self.gradients
        equations[: len(self.maxima), n:] = -smooth.of_maxima
        equations[len(self.maxima) :] = smooth.slopes
        values = np.array([followed.value for followed in self.maxima])
        missing = np.append(smooth.of_maxima @ smooth.levels - values, smooth.missing)
        kept = np.append(self.free, np.ones(n_levels, dtype=bool))
        hessian, equations = hessian[np.ix_(kept, kept)], equations[:, kept]
        corner = np.zeros((len(equations), len(equations)))
        matrix = np.block([[hessian, equations.T], [equations, corner]])
        return matrix, np.concatenate([-smooth.gradient[kept], missing])

    @cached_property
    def _smooth(self) -> "_Smooth":
        return _Smooth.of(self)


@dataclass(frozen=True)
class _Smooth:
    """The aim and the active rows as smooth functions of variables and heights.

    Heights are ``levels`` (n_levels,): one for responses that are equally high where the statistic
    has a kink, one for each other one that is active, and the largest aim where there are several;
    ``of_maxima`` (n_active, n_levels) tells which is that of each active maximum. ``gradient`` is
    that of the aim, ``slopes`` (n_rows, ..) those of the rows, ``hessian`` the second derivative of
    the aim and the rows times their multipliers, by variables and levels. ``missing`` (n_rows,) is
    what rows lack to their limits.
    """

    levels: FloatArray
    of_maxima: FloatArray
    gradient: FloatArray
    slopes: FloatArray
    hessian: FloatArray
    missing: FloatArray

    @classmethod
    def of(cls, active: ActiveSet) -> "_Smooth":
        program, n_aims = active.program, active.n_aims
        level, shares = _levels(program, active.heights)
        chosen = level[active.cases].astype(int)
        present = np.unique(chosen)
        of_maxima = (chosen[:, None] == present).astype(float)
        values = np.array([followed.value for followed in active.maxima])
        heights = (of_maxima.T @ values) / of_maxima.sum(axis=0)
        x, t = ca.SX.sym("x", len(active.x)), ca.SX.sym("t", len(present) + int(n_aims > 0))
        peaks = []
        for numbers in program.by_peak(np.arange(len(level))):
            top = float(active.heights[numbers].max())
            total: Any = 0.0
            for number in np.unique(level[numbers]):
                share = float(shares[numbers][level[numbers] == number].sum())
                if number in present:
                    total += share * ca.exp(t[int(np.searchsorted(present, number))] - top)
                elif share:
                    total += share * np.exp(active.heights[number] - top)
            peaks.append(top + ca.log(total) if np.isfinite(top) else ca.SX(0))
        reached = [aim(ca.vertcat(*peaks), x) for aim in program.aims]
        objective = t[len(present)] if n_aims else reached[0]
        above = [value - objective for value in reached] if n_aims else []
        every = ca.vertsplit(ca.vertcat(ca.SX(0, 1), *above, program.limits(x)))
        rows = ca.vertcat(ca.SX(0, 1), *(every[row] for row in active.rows))
        both, multipliers = ca.vertcat(x, t), ca.reshape(ca.DM(active.row_multipliers), -1, 1)
        lagrangian = objective + ca.dot(multipliers, rows)
        parts = [ca.gradient(objective, both), ca.jacobian(rows, both), rows]
        parts.append(ca.hessian(lagrangian, both)[0])
        levels = heights
        if n_aims:
            known = program.levels(active.heights)
            largest = max(aim.relative(known, active.x) for aim in program.aims)
            levels = np.append(heights, largest)
        function = ca.Function("smooth", [x, t], parts)
        gradient, slopes, at, hessian = (
            np.asarray(part.full(), dtype=float) for part in function(active.x, levels)
        )
        high = np.append(np.zeros(n_aims), program.limits.high)[active.rows]
        low = np.append(np.zeros(n_aims), program.limits.low)[active.rows]
        limits = np.where(active.row_multipliers > 0, high, low)
        return cls(
            levels,
            np.column_stack([of_maxima, np.zeros((len(values), int(n_aims > 0)))]),
            gradient.ravel(),
            slopes.reshape(len(active.rows), len(active.x) + len(levels)),
            hessian,
            limits - at.ravel(),
        )


def _levels(program: Program, heights: FloatArray) -> tuple[np.ndarray, FloatArray]:
    """Which level each response has at an optimum, and its share in the statistic of its peak.

    Shape (n_responses,) each; a level is the number of its first response.
    """
    level, shares = np.arange(len(heights)), np.zeros(len(heights))
    for numbers in program.by_peak(level.copy()):
        if not np.all(np.isfinite(heights[numbers])):
            continue  # no aim depends on it
        shares[numbers] = program.statistic.weights(heights[numbers])
        tied = numbers[program.statistic.tied(heights[numbers])]
        level[tied] = tied.min(initial=len(level))
    return level, shares
