"""First-order conditions of a constrained maximum, solved by Newton's method, with derivatives.

At a *smooth* peak the amplitude of one degree of freedom is stationary over response and frequency
under the balance, Eq. (9). At a *corner* a contact on its slip limit, at an *edge* the end of the
band, takes the place of the zero slope. The Lagrangian ``L`` is the amplitude minus multipliers
times balance and limit; all three kinds are stationary points of ``L``. Its derivatives by any
parameters give those of the maximum: to second order for the amplitude, to first order for the
frequency. The contact on the limit of a corner is held in stick, where the equations are smooth on
both sides. Right at the onset of slip the response may peak smoothly with the contact in either
state. Slip dissipates in proportion to how far the motion is beyond the limit, so that the two
peaks have different slopes by the parameters.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from symhbm.balance import Evaluation, SecondOrder
from symhbm.continuation import ACCEPTED
from symhbm.continuation.correctors import ON_LIMIT, crossed
from symhbm.numerics import RADIANS, Factorisation, FloatArray, bordered, by_size, full, saddle
from symhbm.peaks.maximum import Maximum, MaximumKind

_PRECISION = 1e-9
"""Last scaled step of a solution; convergence is quadratic."""
_STATIONARY = 1e-9
"""Largest scaled slope of the Lagrangian at a solution."""
_CANCELLED = 1e-11
"""Residue of cancelling terms of a slope, relative to the largest: stiff contacts on a lightly
damped structure leave 1e-12, however close a solution is."""
_STAGNATION = 1e-8
"""Scaled step below which round-off of such structures may stop convergence."""
_MAX_ITERATIONS = 12
_RADIUS = 0.5
"""Longest step relative to response or frequency; beyond it another peak is likely."""
_THIRD = 1e-4
"""Relative step of response and frequency between exact second derivatives."""
_STILL = 1e-6
"""Slope of the response beside a peak, over the frequency and scaled, that counts as zero."""


@dataclass(frozen=True, eq=False)
class Conditions:
    """First-order conditions of a maximum and their derivatives; `Conditions.of` evaluates them.

    Variables are unknowns, frequency and the parameters of ``second_order``, in this order.
    ``multipliers`` belong to the balance and, at a corner or an edge, to its limit, whose
    derivatives by all variables are ``limit_row``. ``constraints`` are those of balance and limit,
    ``slope`` and ``curvature`` the first and second derivatives of the Lagrangian.
    """

    second_order: SecondOrder
    maximum: Maximum
    multipliers: FloatArray
    evaluation: Evaluation
    limit_row: FloatArray
    constraints: Any
    slope: FloatArray
    curvature: Any

    @classmethod
    def of(
        cls, second_order: SecondOrder, maximum: Maximum, multipliers: FloatArray | None = None
    ) -> "Conditions":
        """The conditions evaluated at a maximum; by default the multipliers are fitted.

        Raises ArithmeticError where the equations are singular or not finite.
        """
        problem, evaluation, row = maximum.problem, maximum.evaluate(), maximum.limit(second_order)
        if multipliers is None:
            multipliers = _fitted_multipliers(maximum, evaluation, row)
        derivatives = second_order(
            problem,
            maximum.unknowns,
            maximum.frequency,
            multipliers[: problem.n_unknowns],
            maximum.switches,
            evaluation,
        )
        constraints: Any = derivatives.jacobian
        if maximum.kind != MaximumKind.SMOOTH:
            stack = sp.vstack if sp.issparse(constraints) else np.vstack
            constraints = stack([constraints, row[None]])
        gradient, curvature = maximum.expansion(second_order, evaluation)
        slope = gradient / maximum.scale - constraints.T @ multipliers
        curvature = curvature / maximum.scale - derivatives.hessian
        if maximum.kind == MaximumKind.CORNER:
            curvature = curvature - multipliers[-1] * maximum.limit_curvature(second_order)
        given = second_order, maximum, multipliers, evaluation
        return cls(*given, row, constraints, slope, curvature)

    @property
    def _n(self) -> int:
        return self.maximum.problem.n_unknowns

    @property
    def gradient(self) -> FloatArray:
        """Derivative of the amplitude by the parameters, (n_parameters,)."""
        return self.maximum.scale * self.slope[self._n + 1 :]

    @cached_property
    def hessian(self) -> FloatArray:
        """Second derivative of the amplitude by the parameters, (n_parameters, n_parameters)."""
        block = self.curvature[self._n + 1 :, self._n + 1 :]
        return self.maximum.scale * (full(block) + self._mixed.T @ self.by_parameters)

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

    @cached_property
    def frequency_hessian(self) -> FloatArray:
        """Second derivative of the frequency [rad/s] by the parameters, (n_parameters, ..).

        It takes the third derivative of the Lagrangian along one direction, which laws do not tell:
        their exact second derivatives at four points of this direction give it to some 1e-9.
        """
        unit = np.zeros(self._system.shape[0])
        unit[self._n] = 1.0
        direction = self._solve(unit)
        length = self.length(direction)
        if not length:
            return np.zeros(self._mixed.shape[1:] * 2)
        step = _THIRD / length
        near, far = (
            self.moved(k * step * direction)._along(self.by_parameters)
            - self.moved(-k * step * direction)._along(self.by_parameters)
            for k in (1, 2)
        )
        return (far - 8 * near) / (12 * step)

    def _along(self, moves: FloatArray) -> FloatArray:
        """Second derivative of the Lagrangian along moves of all variables with the parameters."""
        last, n = self._n + 1, moves.shape[1]
        along = np.vstack([moves[:last], np.eye(n)])
        crossed = moves[last:].T @ (self.constraints @ along)
        return along.T @ (self.curvature @ along) - crossed - crossed.T

    @property
    def stationarity(self) -> float:
        """Largest slope of the Lagrangian by unknowns and frequency, scaled by the amplitude."""
        slope = self.slope[: self._n + 1] * self._scale[: self._n + 1]
        return float(np.abs(slope).max() / self._scale[0])

    @property
    def is_stationary(self) -> bool:
        """Whether these slopes are small, or as small as the cancellation of their terms allows."""
        scale = self._scale[: self._n + 1]
        terms = abs(self.constraints[:, : self._n + 1]).T @ np.abs(self.multipliers)
        largest = float((terms * scale).max() / self._scale[0])
        return self.stationarity <= max(_STATIONARY, _CANCELLED * largest)

    def step(self) -> FloatArray | None:
        """Newton step of unknowns, frequency and multipliers, None without a finite one."""
        residual = [self.slope[: self._n + 1], -self.evaluation.residual]
        if self.maximum.kind != MaximumKind.SMOOTH:
            corner = self.maximum.kind == MaximumKind.CORNER
            residual.append(-np.array([self.maximum.margins if corner else 0.0]))
        try:
            return -self._solve(np.concatenate(residual))
        except ArithmeticError:
            return None

    def moved(self, step: FloatArray) -> "Conditions":
        """The conditions after a step."""
        unknowns = self.maximum.unknowns + step[: self._n]
        frequency = self.maximum.frequency + float(step[self._n])
        maximum = self.maximum.moved(unknowns, frequency)
        return Conditions.of(self.second_order, maximum, self.multipliers + step[self._n + 1 :])

    def length(self, step: FloatArray) -> float:
        """Length of a step of unknowns and frequency, relative to response and frequency."""
        return float(np.linalg.norm(step[: self._n + 1] / self._scale[: self._n + 1]))

    def is_maximum(self) -> bool:
        """Whether the response falls on both sides and all contacts are in the states assumed."""
        maximum, margins = self.maximum, self.evaluation.states.margins
        free = self.evaluation
        if maximum.kind == MaximumKind.CORNER or not np.array_equal(margins > 0, maximum.switches):
            free = maximum.problem.evaluate(maximum.unknowns, maximum.frequency)
        beyond = crossed(margins, maximum.switches)
        beyond[maximum.on_limit] = False
        if free.norm > ACCEPTED or beyond.any():
            return False
        if maximum.held:
            return True
        if maximum.kind == MaximumKind.CORNER:
            return bool(max(self.side_slopes) < 0)
        tangent = self._tangent(self.evaluation)
        if tangent is None:
            return False
        last = self._n + 1
        return bool(tangent @ (self.curvature[:last, :last] @ tangent) < 0)

    @property
    def side_slopes(self) -> tuple[float, float]:
        """Relative slopes of the response away from a corner by the frequency: stick and slip side.

        Both are negative at a maximum, zero where they do not exist. A branch may fold at a corner,
        so that both sides may lie at the same frequencies.
        """
        stuck, slipping = map(
            self._side_slope, (self.evaluation, self.maximum.evaluate(slips=True))
        )
        return -stuck, slipping

    def _side_slope(self, evaluation: Evaluation) -> float:
        """Relative slope of the response towards more motion of the contact of a corner."""
        maximum, tangent = self.maximum, self._tangent(evaluation)
        if tangent is None:
            return 0.0
        slope = tangent @ maximum.slope
        sign = np.sign(self.limit_row[: self._n + 1] @ tangent)
        return float(sign * slope) * maximum.frequency / maximum.amplitude

    @staticmethod
    def _tangent(evaluation: Evaluation) -> FloatArray | None:
        """Derivatives of unknowns and frequency by the frequency."""
        change = Factorisation(evaluation.jacobian).solve(-evaluation.by_parameter)
        return None if change is None else np.append(change, 1.0)

    @cached_property
    def _scale(self) -> FloatArray:
        """Scales of unknowns, frequency and multipliers in which the system is solved."""
        maximum, force = self.maximum, self.evaluation.magnitude or 1.0
        size = np.linalg.norm(maximum.unknowns) or 1.0
        scale = np.full(self._n + 1, size)
        scale[-1] = maximum.frequency
        multipliers = np.full(len(self.multipliers), size / force)
        multipliers[self._n :] = size
        return np.concatenate([scale, multipliers])

    @cached_property
    def _system(self) -> Any:
        """Derivative of the conditions by unknowns, frequency and multipliers: symmetric."""
        last = self._n + 1
        return saddle(self.curvature[:last, :last], self.constraints[:, :last])

    @cached_property
    def _mixed(self) -> FloatArray:
        """Derivative of the conditions by the parameters."""
        last = self._n + 1
        by_parameters = self.curvature[:last, last:], -self.constraints[:, last:]
        return np.vstack([full(block) for block in by_parameters])

    @cached_property
    def _factorisation(self) -> Factorisation:
        scaled = self._system * self._scale * (self._scale[:, None] / self._scale[0])
        return Factorisation(by_size(scaled))

    def _solve(self, right_side: FloatArray) -> FloatArray:
        scale = self._scale if right_side.ndim == 1 else self._scale[:, None]
        solution = self._factorisation.solve(right_side * scale / self._scale[0])
        if solution is None:
            raise ArithmeticError("the conditions of a maximum are singular")
        return solution * scale


def _fitted_multipliers(
    maximum: Maximum, evaluation: Evaluation, limit_row: FloatArray
) -> FloatArray:
    """Multipliers that make the Lagrangian stationary by unknowns and a limited frequency."""
    n = maximum.problem.n_unknowns
    right_side = maximum.slope / maximum.scale
    matrix = evaluation.jacobian.T
    if maximum.kind != MaximumKind.SMOOTH:
        force = np.append(evaluation.by_parameter, limit_row[n])
        matrix = bordered(matrix, limit_row[:n], force)
    else:
        right_side = right_side[:n]
    multipliers = Factorisation(matrix).solve(right_side)
    if multipliers is None:
        raise ArithmeticError("the equations are singular at a maximum")
    return multipliers


def solve(start: Conditions, precision: float = _PRECISION) -> Conditions | None:
    """The maximum of the same kind next to a start; None if there is none."""
    conditions, previous = start, np.inf
    for _ in range(_MAX_ITERATIONS):
        step = conditions.step()
        if step is None:
            return None
        length = conditions.length(step)
        solved = conditions.evaluation.norm <= ACCEPTED and conditions.is_stationary
        stagnates = previous <= _STAGNATION and length > previous / 2
        if solved and (min(length, previous) <= precision or stagnates):
            return conditions if conditions.is_maximum() else None
        if length > _RADIUS or (length > 2 * previous and previous < 1e-3):
            return None
        try:
            conditions, previous = conditions.moved(step), length
        except ArithmeticError:
            return None
    return None


def slopes_of(solved: Conditions) -> FloatArray:
    """Derivatives of amplitude and frequency [Hz] by all parameters, (2, n_parameters)."""
    return np.array([solved.gradient, solved.frequency_gradient / RADIANS])


def switches_on_limit(maximum: Maximum) -> list[int]:
    """Switches of slip that are on their limits at a smooth maximum."""
    if maximum.kind != MaximumKind.SMOOTH:
        return []
    problem = maximum.problem
    margins = problem.locate(maximum.unknowns, maximum.frequency).margins
    near = np.flatnonzero(np.abs(margins) <= 10 * ON_LIMIT).tolist()
    places = [(switch, *problem.contacts.switch(switch)) for switch in near]
    return [j for j, group, _, place in places if group.law.switches[place].name == "slip"]


def both_sides(solved: Conditions, switch: int) -> tuple[FloatArray, FloatArray] | None:
    """`slopes_of` a maximum with a switch on its limit, towards larger and smaller parameters.

    None where the response peaks smoothly with the contact in one state alone: its peak is then at
    the limit on the other side, and begins with the same slope of the amplitude. The frequency of
    the slipping peak is NaN: its slope is no derivative of the equations at the limit, where their
    second derivatives have no bound.
    """
    maximum, second_order = solved.maximum, solved.second_order
    states = {slips: maximum.switches.copy() for slips in (False, True)}
    for slips, switches in states.items():
        switches[switch] = slips
    sticking, slipping = (
        Conditions.of(second_order, replace(maximum, switches=switches))
        for switches in states.values()
    )
    if max(sticking.stationarity, slipping.stationarity) > _STILL:
        return None
    corner = replace(sticking.maximum, kind=MaximumKind.CORNER, contact=switch)
    row, n = corner.limit(second_order), maximum.problem.n_unknowns + 1
    # Where the margin grows with a parameter, larger values make the contact slip.
    grows = row[n:] + row[:n] @ sticking.by_parameters[:n]
    stuck = slopes_of(sticking)
    slid = np.array([slipping.gradient, np.full(grows.shape, np.nan)])
    return np.where(grows > 0, slid, stuck), np.where(grows < 0, slid, stuck)
