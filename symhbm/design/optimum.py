"""First-order conditions of an optimal design: multipliers, the last digits, and derivatives.

Where the maxima that matter and the bounds that hold are known, an optimum solves equations: the
weighted gradients cancel, and the maxima of one case are equally high. Newton's method on these has
the last digits, and their derivatives tell how the optimum moves with any parameter.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space

from symhbm.design.pieces import FollowedMaximum, Maxima
from symhbm.design.program import AT_BOUND, Program, Step
from symhbm.numerics import FloatArray

ACTIVE = 1e-7
"""Multiplier, of all that sum to 1, above which a maximum or a bound holds a design."""
LEVEL = 1e-9
"""Curvature of the statistic's logarithm below which there is none: its round-off is 1e-15."""


@dataclass(frozen=True)
class ActiveSet:
    """What holds a design ``x`` (n_variables,).

    ``cases`` and ``pieces`` are the maxima that matter, in the order of cases and frequencies, with
    ``weights`` (n_active,) that sum to 1;
    ``free`` (n_variables,) tells which variables are off their bounds, ``rows`` (n_rows,
    n_variables) are the constraint rows that hold, on the values, with their ``pulls`` and the
    ``limits`` at which they hold (n_rows,).
    """

    program: Program
    x: FloatArray
    cases: list[int]
    pieces: list[FollowedMaximum]
    weights: FloatArray
    free: np.ndarray
    rows: FloatArray
    pulls: FloatArray
    limits: FloatArray
    heights: FloatArray

    @classmethod
    def of(cls, program: Program, x: FloatArray, states: list[Maxima], step: Step) -> "ActiveSet":
        """What holds a design from which a ``step`` of the models leads nowhere."""
        chosen = [
            (case, piece, weight)
            for case, (state, weights) in enumerate(zip(states, step.weights, strict=True))
            for piece, weight in zip(state.pieces, weights, strict=True)
            if weight > ACTIVE
        ]
        chosen.sort(key=lambda each: (each[0], each[1].summit.frequency))
        rows, low, high = program.rows()
        hold = np.abs(step.on_constraint) > ACTIVE
        lower, upper = program.space.lower, program.space.upper
        at_bound = (x - lower <= AT_BOUND) | (upper - x <= AT_BOUND)
        return cls(
            program,
            x,
            [case for case, _, _ in chosen],
            [piece for _, piece, _ in chosen],
            np.array([weight for _, _, weight in chosen]),
            ~(at_bound & (np.abs(step.on_bounds) > ACTIVE)),
            rows[hold],
            step.on_constraint[hold],
            np.where(step.on_constraint > 0, high, low)[hold],
            np.array([state.height for state in states]),
        )

    @property
    def gradients(self) -> FloatArray:
        """Of the maxima that matter, (n_active, n_variables)."""
        return np.array([piece.gradient for piece in self.pieces]).reshape(-1, len(self.x))

    @property
    def pull(self) -> FloatArray:
        """Slope of the statistic's logarithm that bounds have to hold, (n_variables,)."""
        return self.weights @ self.gradients + self.pulls @ (self.rows * np.exp(self.x))

    @property
    def stationarity(self) -> float:
        """Largest slope of the statistic's logarithm that nothing holds."""
        return float(np.abs(self.pull[self.free]).max(initial=0.0))

    @property
    def curvature(self) -> float:
        """Smallest second derivative of the statistic's logarithm along designs that are free.

        Infinite where as many maxima as variables hold the design: it rises linearly all around.
        """
        matrix, _ = self.system()
        n_free, n_levels = int(self.free.sum()), self._levels()[0].shape[1]
        # Changes of variables and heights along which all that holds keeps holding.
        both = matrix[: n_free + n_levels, : n_free + n_levels]
        kept = null_space(matrix[n_free + n_levels :, : n_free + n_levels], rcond=1e-9)
        if not kept.shape[1]:
            return np.inf
        return float(np.linalg.eigvalsh(kept.T @ both @ kept).min())

    def step(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Newton's step of the variables, and the weights and pulls after it."""
        matrix, right = self.system()
        found = np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-13)[0], dtype=np.float64)
        change = np.zeros(len(self.x))
        n_free = int(self.free.sum())
        change[self.free] = found[:n_free]
        last = len(found) - len(self.rows)
        return change, found[last - len(self.pieces) : last], found[last:]

    def derivative(self, by_gradient: FloatArray, by_value: FloatArray) -> FloatArray:
        """Derivatives of the variables by parameters, (n_variables, n_parameters).

        ``by_gradient`` (n_active, n_variables, n_parameters) and ``by_value``
        (n_active, n_parameters) are those of the gradients and values of the maxima that matter.
        """
        matrix, _ = self.system()
        n_free, last = int(self.free.sum()), len(matrix) - len(self.rows)
        right = np.zeros((len(matrix), by_value.shape[1]))
        right[:n_free] = -np.einsum("k,kvp->vp", self.weights, by_gradient)[self.free]
        right[last - len(self.pieces) : last] = -by_value
        result = np.zeros((len(self.x), by_value.shape[1]))
        result[self.free] = np.linalg.lstsq(matrix, right, rcond=1e-13)[0][:n_free]
        return result

    def system(self) -> tuple[FloatArray, FloatArray]:
        """Matrix and right side of Newton's method on the conditions.

        The unknowns are the change of the free variables, and heights, weights and pulls after it.
        """
        free, n_free, n_active = self.free, int(self.free.sum()), len(self.pieces)
        levels, share = self._levels()
        n_levels = levels.shape[1]
        size = n_free + n_levels + n_active + len(self.rows)
        t, w, v = n_free, n_free + n_levels, n_free + n_levels + n_active
        matrix, right = np.zeros((size, size)), np.zeros(size)
        slopes = (self.rows * np.exp(self.x))[:, free]
        bend = sum(
            weight * piece.hessian[np.ix_(free, free)]
            for weight, piece in zip(self.weights, self.pieces, strict=True)
        )
        matrix[:t, :t] = bend + np.diag(self.pulls @ slopes)
        matrix[:t, w:v] = self.gradients[:, free].T
        matrix[w:v, :t] = self.gradients[:, free]
        matrix[:t, v:], matrix[v:, :t] = slopes.T, slopes
        matrix[w:v, t:w], matrix[t:w, w:v] = -levels, -levels.T
        values = np.array([piece.value for piece in self.pieces])
        right[w:v] = -values
        # The statistic's logarithm has these second derivatives by the heights.
        matrix[t:w, t:w] = np.diag(share) - np.outer(share, share)
        heights = (levels.T @ values) / levels.sum(axis=0)
        right[t:w] = matrix[t:w, t:w] @ heights - share
        if len(self.rows):
            right[v:] = self.limits - self.rows @ np.exp(self.x)
        return matrix, right

    def _levels(self) -> tuple[FloatArray, FloatArray]:
        """Which height each maximum that matters is to have, and the share of each height.

        Shape (n_active, n_levels), and (n_levels,), which sum to 1.
        """
        level = np.arange(len(self.heights))
        tied = self.program.tied(self.heights)
        level[tied] = min(tied, default=0)
        chosen = level[self.cases]
        present = np.unique(chosen)
        weights = self.program.weights(self.heights)
        amplitudes = np.exp(self.heights[present] - self.heights.max())
        share = amplitudes * [weights[level == one].sum() for one in present]
        return (chosen[:, None] == present).astype(float), share / share.sum()
