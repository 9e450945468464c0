"""First-order conditions of an optimal design: multipliers, the last digits, and derivatives.

With given active maxima and bounds, an optimum solves equations: the weighted gradients cancel, and
the maxima of one case are equally high. Newton's method on these gives the last digits, and their
derivatives those of the optimum by any parameter.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space

from symhbm.design import tolerances
from symhbm.design.maxima import FollowedMaximum, Maxima
from symhbm.design.program import Program, Step
from symhbm.numerics import FloatArray


@dataclass(frozen=True)
class ActiveSet:
    """Active maxima, bounds and constraint rows of a design ``x`` (n_variables,).

    ``cases`` and ``maxima`` are the active maxima, in the order of cases and frequencies, with
    ``weights`` (n_active,) that sum to 1; ``free`` (n_variables,) tells which variables are off
    their bounds; ``rows`` (n_rows, n_variables) are the active constraint rows, on the values, with
    their ``constraint_multipliers`` (n_rows,) and ``limits`` (n_rows,); ``heights`` (n_cases,) are
    the logarithms of the largest responses.
    """

    program: Program
    x: FloatArray
    cases: list[int]
    maxima: list[FollowedMaximum]
    weights: FloatArray
    free: np.ndarray
    rows: FloatArray
    constraint_multipliers: FloatArray
    limits: FloatArray
    heights: FloatArray

    @classmethod
    def of(cls, program: Program, x: FloatArray, states: list[Maxima], step: Step) -> "ActiveSet":
        """The active set of a design, by the multipliers of a ``step`` of the models from it."""
        chosen = [
            (case, followed, weight)
            for case, (state, weights) in enumerate(zip(states, step.weights, strict=True))
            for followed, weight in zip(state.contenders, weights, strict=True)
            if weight > tolerances.ACTIVE
        ]
        chosen.sort(key=lambda entry: (entry[0], entry[1].maximum.frequency))
        rows, low, high = program.rows()
        hold = np.abs(step.on_constraint) > tolerances.ACTIVE
        lower, upper = program.variables.lower, program.variables.upper
        at_bound = (x - lower <= tolerances.AT_BOUND) | (upper - x <= tolerances.AT_BOUND)
        return cls(
            program,
            x,
            [case for case, _, _ in chosen],
            [followed for _, followed, _ in chosen],
            np.array([weight for _, _, weight in chosen]),
            ~(at_bound & (np.abs(step.on_bounds) > tolerances.ACTIVE)),
            rows[hold],
            step.on_constraint[hold],
            np.where(step.on_constraint > 0, high, low)[hold],
            np.array([state.height for state in states]),
        )

    @property
    def gradients(self) -> FloatArray:
        """Gradients of the active maxima, (n_active, n_variables)."""
        return np.array([followed.gradient for followed in self.maxima]).reshape(-1, len(self.x))

    @property
    def bound_multipliers(self) -> FloatArray:
        """Slope of the statistic's logarithm that bounds balance, (n_variables,)."""
        return self.weights @ self.gradients + self.constraint_multipliers @ (
            self.rows * np.exp(self.x)
        )

    @property
    def stationarity(self) -> float:
        """Largest slope of the statistic's logarithm along the free variables."""
        return float(np.abs(self.bound_multipliers[self.free]).max(initial=0.0))

    @property
    def curvature(self) -> float:
        """Smallest second derivative of the statistic's logarithm along designs that are free.

        Infinite with as many active maxima as variables: the statistic rises linearly all around.
        """
        matrix, _ = self.system()
        n_free, n_levels = int(self.free.sum()), self._levels()[0].shape[1]
        # Changes of variables and heights along which all active conditions stay satisfied.
        both = matrix[: n_free + n_levels, : n_free + n_levels]
        kept = null_space(matrix[n_free + n_levels :, : n_free + n_levels], rcond=1e-9)
        if not kept.shape[1]:
            return np.inf
        return float(np.linalg.eigvalsh(kept.T @ both @ kept).min())

    def step(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Newton's step of the variables, and the weights and constraint multipliers after it."""
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

        The unknowns are the change of the free variables, and heights, weights and constraint
        multipliers after it.
        """
        free, n_free, n_active = self.free, int(self.free.sum()), len(self.maxima)
        levels, share = self._levels()
        n_levels = levels.shape[1]
        size = n_free + n_levels + n_active + len(self.rows)
        t, w, v = n_free, n_free + n_levels, n_free + n_levels + n_active
        matrix, right = np.zeros((size, size)), np.zeros(size)
        slopes = (self.rows * np.exp(self.x))[:, free]
        hessian = sum(
            weight * followed.hessian[np.ix_(free, free)]
            for weight, followed in zip(self.weights, self.maxima, strict=True)
        )
        matrix[:t, :t] = hessian + np.diag(self.constraint_multipliers @ slopes)
        matrix[:t, w:v] = self.gradients[:, free].T
        matrix[w:v, :t] = self.gradients[:, free]
        matrix[:t, v:], matrix[v:, :t] = slopes.T, slopes
        matrix[w:v, t:w], matrix[t:w, w:v] = -levels, -levels.T
        values = np.array([followed.value for followed in self.maxima])
        right[w:v] = -values
        # The statistic's logarithm has these second derivatives by the heights.
        matrix[t:w, t:w] = np.diag(share) - np.outer(share, share)
        heights = (levels.T @ values) / levels.sum(axis=0)
        right[t:w] = matrix[t:w, t:w] @ heights - share
        if len(self.rows):
            right[v:] = self.limits - self.rows @ np.exp(self.x)
        return matrix, right

    def _levels(self) -> tuple[FloatArray, FloatArray]:
        """Which height each active maximum has at an optimum, and the share of each height.

        Shape (n_active, n_levels), and (n_levels,), which sum to 1.
        """
        level = np.arange(len(self.heights))
        tied = self.program.tied(self.heights)
        level[tied] = min(tied, default=0)
        chosen = level[self.cases]
        present = np.unique(chosen)
        weights = self.program.weights(self.heights)
        amplitudes = np.exp(self.heights[present] - self.heights.max())
        share = amplitudes * [weights[level == number].sum() for number in present]
        return (chosen[:, None] == present).astype(float), share / share.sum()
