"""How sure estimates are: errors, correlations, profiles, and what measurements do not see."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.special import chdtrc, ndtr, ndtri, stdtrit

from symhbm.design.identification.estimate import descend, inside, weights_of
from symhbm.design.identification.objective import Point
from symhbm.numerics import FloatArray

UNSEEN = 1e-10
"""Singular value, relative to what sensors might see, of a direction that they do not see."""
_NAMED = 0.05
"""Share of a direction from which an unknown is named."""
_ALIKE = 0.02
"""Difference up to which shares of two unknowns are equal."""
_SQUARED = 1e-7
"""Ratio of singular values below which their squares, in a Hessian, are round-off."""
_INVOLVED = 1e-6
"""Share in an unseen direction above which an unknown has no error."""
_MOST, _CLOSE = 12, 1e-3
"""Steps along a profile, and how close to the level it ends, relative."""
_DIFFERENT = 0.1
"""Relative difference of two standard errors that is told."""


@dataclass(frozen=True, eq=False)
class Certainty:
    """What the residuals around an optimum tell; ``loss`` is the one that was made small.

    Variables are logarithms of values, or values over their scale.
    """

    point: Point
    loss: str
    confidence: float

    @property
    def _unknowns(self) -> Any:
        return self.point.objective.unknowns

    @cached_property
    def free(self) -> np.ndarray:
        """Which variables are not held by a bound."""
        return inside(self._unknowns, self.point.x)

    @cached_property
    def _jacobian(self) -> FloatArray:
        """Of the residuals, each as much as the loss counts it."""
        return weights_of(self.point.residuals, self.loss)[:, None] * self.point.jacobian

    @cached_property
    def _decomposed(self) -> tuple[FloatArray, FloatArray]:
        """Singular values of the Jacobian, and directions as rows."""
        return _decomposed(self._jacobian)

    @property
    def singular_values(self) -> FloatArray:
        """Of the Jacobian, relative to what sensors might see at most, (n,) descending."""
        values = self._decomposed[0]
        return values / (max(self.point.size, values.max(initial=0.0)) or 1.0)

    @property
    def directions(self) -> FloatArray:
        """Shares of the unknowns in the direction of each singular value, (n, n)."""
        return self._decomposed[1]

    @cached_property
    def degrees(self) -> int:
        """How many more residuals there are than directions that they see."""
        seen = int(np.count_nonzero(self.singular_values > UNSEEN))
        return len(self.point.residuals) - seen

    @cached_property
    def noise(self) -> float:
        """Standard deviation of residuals: 1 where it is known."""
        if self.point.objective.rows.has_noise:
            return 1.0
        return float(np.sqrt(2 * self.point.value / self.degrees)) if self.degrees > 0 else np.nan

    @cached_property
    def covariance(self) -> FloatArray:
        """Of the variables by the Jacobian, (n, n); NaN of those at bounds or not seen."""
        return self._inverse(None)

    @property
    def information(self) -> FloatArray:
        """On the variables by the Jacobian, (n, n)."""
        return self._jacobian.T @ self._jacobian / (self.noise or 1.0) ** 2

    @cached_property
    def exact_covariance(self) -> FloatArray:
        """Of the variables by the exact Hessian; NaN where that is none of a minimum."""
        if self.loss != "linear":
            return np.full((len(self.point.x),) * 2, np.nan)
        return self._inverse(self.point.hessian)

    def _inverse(self, hessian: FloatArray | None) -> FloatArray:
        """The inverse over free variables and directions that are seen, NaN of all others.

        Each direction over its singular value: that of the Jacobian by itself is then exact, and of
        a Hessian round-off is seen.
        """
        n, free = len(self.point.x), np.flatnonzero(self.free)
        result = np.full((n, n), np.nan)
        values, directions = _decomposed(self._jacobian[:, free])
        visible = values > UNSEEN * (max(self.point.size, values.max(initial=0.0)) or 1.0)
        seen, hidden = directions[visible], directions[~visible]
        seen = seen / values[visible][:, None]
        if not len(seen):
            return result
        inner = np.eye(len(seen))
        if hessian is not None:
            inner = seen @ hessian[np.ix_(free, free)] @ seen.T
            blurred = values[visible].min() < _SQUARED * values.max()
            if blurred or not np.isfinite(inner).all() or np.linalg.eigvalsh(inner)[0] <= 0:
                return result
        inverse = seen.T @ np.linalg.solve(inner, seen) * self.noise**2
        known = np.linalg.norm(hidden, axis=0) <= _INVOLVED
        result[np.ix_(free[known], free[known])] = inverse[np.ix_(known, known)]
        return result

    def errors(self, covariance: FloatArray) -> FloatArray:
        """Standard errors of the values, (n,), to first order."""
        each = zip(self._unknowns.each, self.point.x, strict=True)
        slopes = np.array([one.of_variable(x)[1] for one, x in each])
        return np.abs(slopes) * np.sqrt(np.diag(covariance))

    @property
    def correlation(self) -> FloatArray:
        """Correlations of the variables, (n, n)."""
        sizes = np.sqrt(np.diag(self.covariance))
        return self.covariance / np.outer(sizes, sizes)

    @property
    def quantile(self) -> float:
        """Half the width of an interval in standard errors: of Student where noise is estimated."""
        share = (1 + self.confidence) / 2
        if self.point.objective.rows.has_noise or self.degrees < 1:
            return float(ndtri(share))
        return float(stdtrit(self.degrees, share))

    def intervals(self) -> FloatArray:
        """Ends (n, 2) of intervals by standard errors of the variables."""
        width = self.quantile * np.sqrt(np.diag(self.covariance))
        ends = self.point.x[:, None] + width[:, None] * np.array([-1.0, 1.0])
        return self._of_variables(ends)

    def _of_variables(self, ends: FloatArray) -> FloatArray:
        pairs = zip(self._unknowns.each, ends, strict=True)
        return np.array([[one.of_variable(x)[0] for x in pair] for one, pair in pairs])

    def profiles(self, tick: Callable[[], Any] = lambda: None) -> tuple[FloatArray, list[str]]:
        """Ends (n, 2) of intervals by profile likelihood, and what to say of them.

        Along an unknown all others are fitted anew. Where the data do not limit it, the end is its
        bound; it is NaN where they do not see the unknown.
        """
        words: list[str] = []
        ends = np.full((len(self.point.x), 2), np.nan)
        if self.loss != "linear" or not np.isfinite(self.noise) or self.noise == 0:
            return ends, words
        for j in np.flatnonzero(np.isfinite(np.diag(self.covariance)) | ~self.free).tolist():
            for side in (0, 1):
                ends[j, side], better = self._end(j, side, tick)
                if better:
                    label = self._unknowns.labels[j]
                    words.append(f"along {label} a better optimum was found: begin there")
        return self._of_variables(ends), list(dict.fromkeys(words))

    def _end(self, j: int, side: int, tick: Callable[[], Any]) -> tuple[float, bool]:
        """Where the profile of one variable reaches its level on one side, or its bound."""
        point, objective = self.point, self.point.objective
        bound, sign = objective.unknowns.bounds[side, j], 2 * side - 1
        others = np.flatnonzero(np.arange(len(point.x)) != j)
        error = float(np.sqrt(self.covariance[j, j]))
        room = abs(bound - point.x[j])
        step = self.quantile * error if np.isfinite(error) else room / 8
        slopes = self.covariance[:, j] / error**2 if np.isfinite(error) else np.zeros(len(point.x))
        slopes = np.nan_to_num(slopes)
        nearest, level, depth, start = (0.0, 0.0), self.quantile, 0.0, point.x
        for _ in range(_MOST):
            step = min(step, room)
            start = point.x + sign * step * slopes
            start[j] = point.x[j] + sign * step
            objective.remember(point)
            found = descend(objective, start, free=others, tick=tick, precise=False).point
            if found is None:
                step = (step + nearest[0]) / 2
                continue
            gain = 2 * (found.value - point.value) / self.noise**2
            if gain < -_CLOSE * level**2:
                return np.nan, True
            depth = float(np.sqrt(max(gain, 0.0)))
            if abs(depth - level) <= _CLOSE * level:
                return float(start[j]), False
            if depth < level and step >= room:
                return float(bound), False
            # Depth grows with the step nearly in proportion.
            if depth > 0 and nearest[0] > 0 and depth != nearest[1]:
                growth = (depth - nearest[1]) / (step - nearest[0])
                other = step + (level - depth) / growth if growth > 0 else 2 * step
            else:
                other = step * min(level / depth, 4.0) if depth > 0 else 4 * step
            nearest, step = (step, depth), float(np.clip(other, step / 4, 4 * step))
        return float(start[j]) if depth >= level else np.nan, False

    def words(self) -> list[str]:
        """Sentences on what measurements do not see, hardly see, or tell differently."""
        told = []
        strength = self._decomposed[0] / self.noise if self.noise else self._decomposed[0]
        for value, power, direction in zip(
            self.singular_values, strength, self.directions, strict=True
        ):
            if value <= UNSEEN:
                told.append(f"Not seen: {self._named(direction)} (singular value {value:.1e}).")
            elif power < 1:
                error = f"its standard error is {1 / power:.2g}"
                told.append(f"Hardly seen: {self._named(direction)} ({error}).")
        simple, exact = map(self.errors, (self.covariance, self.exact_covariance))
        for label, one, other in zip(self._unknowns.labels, simple, exact, strict=True):
            if np.isfinite([one, other]).all() and abs(other / one - 1) > _DIFFERENT:
                told.append(
                    f"The standard error of {label} is {one:.3g} by the Jacobian and {other:.3g} "
                    "by the exact Hessian: the model bends within it, trust the profile."
                )
        held = [
            label for label, free in zip(self._unknowns.labels, self.free, strict=True) if not free
        ]
        if held:
            told.append(f"At a bound: {', '.join(held)}.")
        corners = self.point.on_corners()
        if corners:
            frequency, contact = corners[0]
            told.append(
                f"On a corner: contact {contact} is on its limit at {frequency:.6g} Hz"
                f"{f' and {len(corners) - 1} more' if len(corners) > 1 else ''}, derivatives are "
                "one-sided there."
            )
        return told

    def _named(self, direction: FloatArray) -> str:
        """A direction in words: alone, a product, a ratio, or shares of several unknowns."""
        large = np.flatnonzero(np.abs(direction) >= _NAMED)
        large = large[np.argsort(-np.abs(direction[large]).round(6), kind="stable")]
        each, shares = [self._unknowns.each[j] for j in large], direction[large]
        labels = [one.label for one in each]
        if len(large) == 1:
            return f"{labels[0]}, with which no measurement changes"
        logarithmic = all(one.logarithmic for one in each)
        if logarithmic and len(large) == 2 and abs(abs(shares[0]) - abs(shares[1])) < _ALIKE:
            if shares[0] * shares[1] < 0:
                return f"{labels[0]} and {labels[1]} apart, only their product"
            return f"{labels[0]} and {labels[1]} apart, only their ratio"
        sign = np.sign(shares[0])
        parts = [
            f"{label} ({sign * share:+.2f})" for label, share in zip(labels, shares, strict=True)
        ]
        of = "logarithms of " if logarithmic else ""
        return f"a change of {of}{', '.join(parts)} together"


def _decomposed(jacobian: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Singular values (n,) of a Jacobian, and directions as rows (n, n)."""
    _, values, directions = np.linalg.svd(jacobian, full_matrices=True)
    return np.append(values, np.zeros(len(directions) - len(values))), directions


@dataclass(frozen=True)
class Remains:
    """What is left of the residuals of one curve: a sum of squares over ``size`` rows, tests."""

    square: float
    size: int
    correlation: float

    @property
    def probability(self) -> float:
        """That neighbouring residuals are as much alike by chance."""
        return float(2 * ndtr(-abs(self.correlation) * np.sqrt(self.size)))


def remains(point: Point, noise: float) -> list[Remains]:
    """What is left on each curve, along its frequencies."""
    rows, found = point.objective.rows, []
    for curve in point.objective.curves:
        order = np.concatenate(curve.rows)
        order = order[rows.kept[order]]
        residuals = point.all_residuals[order] / (noise or 1.0)
        # Neighbours along the frequency are of one sensor and one form.
        pairs = total = 0.0
        kinds = [
            f"{rows.place[i]} {rows.form[i]} {rows.quantity[i]} {rows.harmonic[i]}" for i in order
        ]
        for kind in dict.fromkeys(kinds):
            own = residuals[np.array([one == kind for one in kinds])]
            pairs, total = pairs + float(own[1:] @ own[:-1]), total + float(own @ own)
        square = float(residuals @ residuals)
        found.append(Remains(square, len(order), pairs / total if total else 0.0))
    return found


def probability_of(square: float, degrees: int) -> float:
    """That noise alone leaves a sum of squares as large."""
    return float(chdtrc(degrees, square)) if degrees > 0 else np.nan
