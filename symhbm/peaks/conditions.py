"""A peak as a constrained maximum: solved for by Newton's method, with exact derivatives.

The amplitude of one degree of freedom is stationary over response and frequency under the
balance, Eq. (9): a *smooth* peak. At a *corner* one contact on its limit, at an *edge* the end of
the band, takes the place of the zero slope. With ``L`` the amplitude less multipliers times balance
and limit, all three are stationary points of ``L``; its derivatives by any parameters give those of
the peak, to second order for the amplitude and to first order for the frequency. A contact at the
limit of a corner is held in stick, where the equations are smooth on both sides.
"""

from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from symhbm.balance import Evaluation, SecondOrder
from symhbm.continuation import ACCEPTED
from symhbm.continuation.correctors import crossed
from symhbm.numerics import Factorisation, FloatArray, bordered, by_size, full, saddle
from symhbm.peaks.maximum import Maximum, MaximumKind

_PRECISION = 1e-9
"""Last scaled step of a solution: convergence is quadratic."""
_STATIONARY = 1e-9
"""Largest scaled slope of the Lagrangian at a solution."""
_CANCELLED = 1e-11
"""What may be left of terms of a slope that cancel, over the largest: stiff contacts on a lightly
damped structure leave 1e-12, however close a solution is."""
_STAGNATION = 1e-8
"""Scaled step from which steps need not get shorter: round-off of such structures."""
_MAX_ITERATIONS = 12
_RADIUS = 0.5
"""Longest step relative to response or frequency: beyond that lies another peak."""


class Conditions:
    """The first-order conditions of a summit and their derivatives.

    Variables are unknowns, frequency and the parameters of ``second_order``, in this order.
    ``multipliers`` are of the balance and, at a corner or an edge, of its limit; by default those
    that fit best.
    """

    def __init__(
        self, second_order: SecondOrder, summit: Maximum, multipliers: FloatArray | None = None
    ):
        problem = summit.problem
        self.summit, self.second_order = summit, second_order
        self._n = problem.n_unknowns
        self._place = summit.place
        at = summit.unknowns, summit.frequency
        evaluation = self.evaluation = summit.evaluate()
        self._limit_row = summit.limit(second_order)
        self.multipliers = multipliers = self._fitting() if multipliers is None else multipliers
        found = second_order(problem, *at, multipliers[: self._n], summit.slip, evaluation)
        self._constraints: Any = found.jacobian
        if summit.kind != MaximumKind.SMOOTH:
            stack = sp.vstack if sp.issparse(found.jacobian) else np.vstack
            self._constraints = stack([found.jacobian, self._limit_row[None]])
        slope = -self._constraints.T @ multipliers
        slope[self._place] += summit.amplitude_slope
        self._slope = slope
        hessian = summit.amplitude_curvature(second_order.n_variables) - found.hessian
        if summit.kind == MaximumKind.CORNER:
            hessian = hessian - multipliers[-1] * summit.limit_curvature(second_order)
        self._hessian = hessian

    @property
    def gradient(self) -> FloatArray:
        """Derivative of the amplitude by the parameters, (n_parameters,)."""
        return self._slope[self._n + 1 :]

    @cached_property
    def hessian(self) -> FloatArray:
        """Second derivative of the amplitude by the parameters, (n_parameters, n_parameters)."""
        own = self._hessian[self._n + 1 :, self._n + 1 :]
        return full(own) + self._mixed.T @ self.by_parameters

    @cached_property
    def by_parameters(self) -> FloatArray:
        """Derivatives of unknowns, frequency and multipliers, (n, n_parameters)."""
        return -self._solve(self._mixed)

    @cached_property
    def frequency_gradient(self) -> FloatArray:
        """Derivative of the frequency [rad/s] by the parameters, (n_parameters,)."""
        unit = np.zeros(self._system.shape[0])
        unit[self._n] = 1.0
        # The system is symmetric: one solution serves all parameters.
        return -self._mixed.T @ self._solve(unit)

    @property
    def stationarity(self) -> float:
        """Largest slope of the Lagrangian by unknowns and frequency, scaled by the amplitude."""
        slope = self._slope[: self._n + 1] * self._scale[: self._n + 1]
        return float(np.abs(slope).max() / self._scale[0])

    @property
    def is_stationary(self) -> bool:
        """Whether what is left of these slopes is small, or as small as their terms allow."""
        scale = self._scale[: self._n + 1]
        terms = abs(self._constraints[:, : self._n + 1]).T @ np.abs(self.multipliers)
        largest = float((terms * scale).max() / self._scale[0])
        return self.stationarity <= max(_STATIONARY, _CANCELLED * largest)

    def step(self) -> FloatArray | None:
        """Newton step of unknowns, frequency and multipliers, None without a finite one."""
        residual = [self._slope[: self._n + 1], -self.evaluation.residual]
        if self.summit.kind != MaximumKind.SMOOTH:
            slip_margin = self.summit.slip_margin if self.summit.kind == MaximumKind.CORNER else 0.0
            residual.append(-np.array([slip_margin]))
        try:
            return -self._solve(np.concatenate(residual))
        except ArithmeticError:
            return None

    def moved(self, step: FloatArray) -> "Conditions":
        """The conditions after a step."""
        unknowns = self.summit.unknowns + step[: self._n]
        frequency = self.summit.frequency + float(step[self._n])
        summit = self.summit.moved(unknowns, frequency)
        return Conditions(self.second_order, summit, self.multipliers + step[self._n + 1 :])

    def length(self, step: FloatArray) -> float:
        """Length of a step of unknowns, relative to the response, and frequency, to itself."""
        return float(np.linalg.norm(step[: self._n + 1] / self._scale[: self._n + 1]))

    def is_maximum(self) -> bool:
        """Whether the response falls on both sides, every contact in the state held for it."""
        summit, slip_margin = self.summit, self.evaluation.friction.slip_margin
        free = self.evaluation
        if summit.kind == MaximumKind.CORNER or not np.array_equal(slip_margin > 0, summit.slip):
            free = summit.problem.evaluate(summit.unknowns, summit.frequency)
        beyond = crossed(slip_margin, summit.slip)
        beyond[summit.held] = False
        if free.norm > ACCEPTED or beyond.any():
            return False
        if summit.kind == MaximumKind.EDGE:
            return True
        if summit.kind == MaximumKind.CORNER:
            return bool(max(self.flanks) < 0)
        along = self._tangent(self.evaluation)
        if along is None:
            return False
        last = self._n + 1
        return bool(along @ (self._hessian[:last, :last] @ along) < 0)

    @property
    def flanks(self) -> tuple[float, float]:
        """Relative slopes of the response away from a corner, over the frequency: stuck, slipping.

        Both are negative at a maximum, zero where there is none. A path may fold at a corner: where
        its contact sticks and where it slips need not lie on different sides in frequency.
        """
        stuck, slipping = map(self._flank, (self.evaluation, self.summit.evaluate(slips=True)))
        return -stuck, slipping

    def _flank(self, at: Evaluation) -> float:
        """Relative slope of the response towards more motion of the contact of a corner."""
        summit, along = self.summit, self._tangent(at)
        if along is None:
            return 0.0
        slope = along[self._place] @ summit.amplitude_slope
        heading = np.sign(self._limit_row[: self._n + 1] @ along)
        return float(heading * slope) * summit.frequency / summit.amplitude

    @staticmethod
    def _tangent(at: Evaluation) -> FloatArray | None:
        """Derivatives of unknowns and frequency by the frequency."""
        change = Factorisation(at.jacobian).solve(-at.by_parameter)
        return None if change is None else np.append(change, 1.0)

    def _fitting(self) -> FloatArray:
        """Multipliers that make the Lagrangian stationary by unknowns, and frequency if bound."""
        right = np.zeros(self._n)
        right[self._place] = self.summit.amplitude_slope
        matrix = self.evaluation.jacobian.T
        if self.summit.kind != MaximumKind.SMOOTH:
            limit = self._limit_row
            force = np.append(self.evaluation.by_parameter, limit[self._n])
            matrix = bordered(matrix, limit[: self._n], force)
            right = np.append(right, 0.0)
        found = Factorisation(matrix).solve(right)
        if found is None:
            raise ArithmeticError("the equations are singular at a maximum")
        return found

    @cached_property
    def _scale(self) -> FloatArray:
        """Scales of unknowns, frequency and multipliers: what the system is solved in."""
        summit, force = self.summit, self.evaluation.magnitude or 1.0
        size = np.linalg.norm(summit.unknowns) or 1.0
        scale = np.full(self._n + 1, size)
        scale[-1] = summit.frequency
        multipliers = np.full(len(self.multipliers), size / force)
        multipliers[self._n :] = size
        return np.concatenate([scale, multipliers])

    @cached_property
    def _system(self) -> Any:
        """Derivative of the conditions by unknowns, frequency and multipliers: symmetric."""
        last = self._n + 1
        return saddle(self._hessian[:last, :last], self._constraints[:, :last])

    @cached_property
    def _mixed(self) -> FloatArray:
        """Derivative of the conditions by the parameters."""
        last = self._n + 1
        by_parameters = self._hessian[:last, last:], -self._constraints[:, last:]
        return np.vstack([full(each) for each in by_parameters])

    @cached_property
    def _factorisation(self) -> Factorisation:
        scaled = self._system * self._scale * (self._scale[:, None] / self._scale[0])
        return Factorisation(by_size(scaled))

    def _solve(self, right: FloatArray) -> FloatArray:
        scale = self._scale if right.ndim == 1 else self._scale[:, None]
        found = self._factorisation.solve(right * scale / self._scale[0])
        if found is None:
            raise ArithmeticError("the conditions of a maximum are singular")
        return found * scale


def solve(start: Conditions, precision: float = _PRECISION) -> Conditions | None:
    """The summit of this kind next to a start, None if there is none or it is no maximum."""
    here, last = start, np.inf
    for _ in range(_MAX_ITERATIONS):
        step = here.step()
        if step is None:
            return None
        length = here.length(step)
        solved = here.evaluation.norm <= ACCEPTED and here.is_stationary
        stagnates = last <= _STAGNATION and length > last / 2
        if solved and (min(length, last) <= precision or stagnates):
            return here if here.is_maximum() else None
        if length > _RADIUS or (length > 2 * last and last < 1e-3):
            return None
        try:
            here, last = here.moved(step), length
        except ArithmeticError:
            return None
    return None
