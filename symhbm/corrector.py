"""Newton's method on the equations and one constraint: points, limits and tangents of a curve."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from symhbm.curve import Curve
from symhbm.evaluation import Evaluation
from symhbm.fourier import FloatArray
from symhbm.linear import Factorisation, bordered
from symhbm.newton import TOLERANCE

MAX_CORRECTIONS = 10

Constraint = Callable[[FloatArray, Evaluation], tuple[float, FloatArray]]
"""Value at (unknowns, parameter) and its gradient by the scaled ones, shape (n_unknowns + 1,)."""


@dataclass(frozen=True)
class Corrected:
    """A solution of the equations and a constraint.

    ``point`` (n_unknowns + 1,), the unknowns [m] and the parameter; ``direction``
    (n_unknowns + 1,), the unit tangent of the curve in scaled variables, along the gradient of
    the constraint; ``sign``, that of ``det [J; direction^T]``.
    """

    point: FloatArray
    evaluation: Evaluation
    direction: FloatArray
    sign: int


def unit_parameter(size: int) -> FloatArray:
    """The unit vector of the parameter among ``size`` scaled variables."""
    vector = np.zeros(size)
    vector[-1] = 1.0
    return vector


def hyperplane(anchor: FloatArray, scale: FloatArray, normal: FloatArray) -> Constraint:
    """Stay on the plane through ``anchor`` with the scaled ``normal`` (all (n_unknowns + 1,))."""

    def constraint(point: FloatArray, _: Evaluation) -> tuple[float, FloatArray]:
        return float(np.dot(normal, (point - anchor) / scale)), normal

    return constraint


def at_limit(curve: Curve, contact: int, scale: FloatArray) -> Constraint:
    """Put the motion of one contact on the limit between sticking and slipping."""

    def constraint(_: FloatArray, evaluation: Evaluation) -> tuple[float, FloatArray]:
        row = np.zeros(len(scale))
        row[:-1] = curve.problem.expand(contact, evaluation.friction.excess_gradient[contact])
        explicit = np.broadcast_to(evaluation.excess_by_parameter, evaluation.friction.slip.shape)
        row[-1] = explicit[contact]
        return float(evaluation.friction.excess[contact]), row * scale

    return constraint


class Corrector:
    """Corrects guesses onto a curve; ``solves`` counts all linear solves."""

    def __init__(self, curve: Curve):
        self.curve = curve
        self.solves = 0

    def correct(
        self,
        guess: FloatArray,
        scale: FloatArray,
        constraint: Constraint,
        slip: NDArray[np.bool_],
        precision: float = 1e-6,
        radius: float = 0.5,
    ) -> Corrected | None:
        """Solve from ``guess`` (n_unknowns + 1,), contact states ``slip`` held.

        ``scale`` (n_unknowns + 1,) measures all steps. The tangent is that of a point within
        ``precision`` of the solution. None if the iteration leaves ``radius`` or does not converge.
        """
        point, direction, sign = guess, None, 0
        last_step = np.inf
        for correction in range(MAX_CORRECTIONS + 1):
            try:
                evaluation = self.curve.evaluate(point[:-1], point[-1], slip)
            except ArithmeticError:
                return None
            value, row = constraint(point, evaluation)
            on_curve = evaluation.norm <= TOLERANCE and abs(value) <= TOLERANCE
            if on_curve and direction is not None and last_step <= precision:
                return Corrected(point, evaluation, direction, sign)
            if correction == MAX_CORRECTIONS or not np.isfinite(value):
                # Steps that stay are round-off on the curve, and a failure off it.
                if direction is None or not on_curve or last_step > 1e-3:
                    return None
                return Corrected(point, evaluation, direction, sign)
            solution, sign = self._step(evaluation, scale, row, value)
            if solution is None:
                return None
            step, direction = solution[:, 0], solution[:, 1] / np.linalg.norm(solution[:, 1])
            previous, last_step = last_step, float(np.linalg.norm(step))
            if correction > 2 and last_step > previous:
                return Corrected(point, evaluation, direction, sign) if on_curve else None
            if last_step > radius:
                return None
            point = point + step * scale
        return None

    def tangent(
        self, point: FloatArray, scale: FloatArray, row: FloatArray, slip: NDArray[np.bool_]
    ) -> Corrected | None:
        """Tangent at a solution with the contact states ``slip``, along ``row`` where it can be."""
        evaluation = self.curve.evaluate(point[:-1], point[-1], slip)
        for border in (row, unit_parameter(len(row))):
            solution, sign = self._step(evaluation, scale, border, 0.0)
            if solution is not None:
                direction = solution[:, 1] / np.linalg.norm(solution[:, 1])
                return Corrected(point, evaluation, direction, sign)
        return None

    def _step(self, evaluation: Evaluation, scale: FloatArray, row: FloatArray, value: float):
        """Newton step and unnormalised tangent as two columns, and the sign of the determinant."""
        force = evaluation.magnitude or 1.0
        matrix = bordered(
            evaluation.jacobian * (scale[0] / force),
            evaluation.by_parameter * (scale[-1] / force),
            row,
        )
        right = np.zeros((len(row), 2), order="F")
        right[:-1, 0] = -evaluation.residual / force
        right[-1] = -value, 1.0
        self.solves += 1
        factors = Factorisation(matrix)
        return factors.solve(right), factors.sign
