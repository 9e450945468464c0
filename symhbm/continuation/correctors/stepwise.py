"""Corrector step by step: points, contact limits and tangents of a curve by Newton's method."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors.corrector import Constraint, Corrector, Hyperplane, crossed
from symhbm.continuation.correctors.newton_graph import MAX_CORRECTIONS, STAGNATION
from symhbm.continuation.correctors.resonance_count import counted
from symhbm.continuation.newton import TOLERANCE
from symhbm.continuation.problem import Corrected
from symhbm.numerics import Factorisation, FloatArray, bordered, length_of


class StepwiseCorrector(Corrector):
    """A `Corrector` of any curve: each step evaluates the equations and factorises a matrix."""

    def correct(
        self,
        guess: FloatArray,
        constraint: Constraint,
        switches: NDArray[np.bool_],
        precision: float = 1e-6,
        radius: float = 0.5,
    ) -> Corrected | None:
        """As `Corrector.correct`."""
        point, direction, factors, scale = guess, None, None, constraint.scale
        last_step, correction = np.inf, 0
        while True:
            try:
                norm, value, at = self._linearised(point, guess, constraint, switches)
            except ArithmeticError:
                return None
            if np.isnan(norm):
                self.defined = False
                return None
            on_curve = norm <= TOLERANCE and abs(value) <= TOLERANCE
            if on_curve and direction is not None and last_step <= precision:
                break
            if correction == MAX_CORRECTIONS or not np.isfinite(value):
                if direction is None or not on_curve or last_step > STAGNATION:
                    return None
                break
            columns, factors = self._step(at, scale)
            if columns is None:
                return None
            step, direction = columns[:, 0], columns[:, 1] / length_of(columns[:, 1])
            previous, last_step = last_step, length_of(step)
            if correction > 2 and last_step > previous:
                if not on_curve:
                    return None
                break
            if last_step > radius:
                return None
            point, correction = point + step * scale, correction + 1
        assert factors is not None
        return self._corrected(point, at, scale, direction, factors.sign, guess, switches)

    def tangent_along(
        self, point: FloatArray, plane: Hyperplane, switches: NDArray[np.bool_]
    ) -> Corrected | None:
        """As `Corrector.tangent_along`."""
        try:
            _, _, at = self._linearised(point, point, plane, switches)
        except ArithmeticError:
            return None
        columns, factors = self._step(at, plane.scale)
        if columns is None:
            return None
        direction = columns[:, 1] / length_of(columns[:, 1])
        return self._corrected(point, at, plane.scale, direction, factors.sign, point, switches)

    def _linearised(
        self,
        point: FloatArray,
        guess: FloatArray,
        constraint: Constraint,
        switches: NDArray[np.bool_],
    ) -> tuple[float, float, Any]:
        """Norm of the equations, value of the constraint, and what a step is made of.

        Raises ArithmeticError where a force cannot be computed.
        """
        evaluation = self.curve.evaluate(point[:-1], point[-1], switches)
        value, row = constraint(point, evaluation)
        return evaluation.norm, value, (evaluation, value, row)

    def _corrected(self, point, at, scale, direction, sign, guess, switches) -> Corrected:
        evaluation, _, _ = at
        return Corrected(
            point,
            direction,
            sign,
            evaluation.norm,
            self.curve.amplification(point[:-1], point[-1]),
            self.curve.distance(point, guess, scale),
            evaluation.states.margins,
            self.curve.margin_rate(evaluation, direction * scale),
            bool(crossed(evaluation.states.margins, switches).any()),
            *counted(self.curve, point, evaluation.states),
        )

    def _step(self, at: Any, scale: FloatArray) -> tuple[FloatArray | None, Factorisation]:
        """Newton step and unnormalised tangent as two columns, and the factors of their system."""
        evaluation, value, row = at
        force = evaluation.magnitude or 1.0
        column = evaluation.by_parameter * (scale[-1] / force)
        matrix = bordered(evaluation.jacobian, column, row, scale[:-1] / force)
        right = np.zeros((len(row), 2), order="F")
        right[:-1, 0] = -evaluation.residual / force
        right[-1] = -value, 1.0
        self.solves += 1
        factors = Factorisation(matrix)
        return factors.solve(right), factors
