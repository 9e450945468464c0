"""Corrector step by step: points, contact limits and tangents of a curve by Newton's method."""

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import Evaluation
from symhbm.continuation.correctors.constraints import (
    Constraint,
    Corrected,
    crossed,
    unit_parameter,
)
from symhbm.continuation.correctors.corrector import Corrector
from symhbm.continuation.correctors.newton_graph import MAX_CORRECTIONS, STAGNATION
from symhbm.continuation.newton import TOLERANCE
from symhbm.continuation.problem import ContinuationProblem
from symhbm.continuation.resonance_count import ResonanceCount
from symhbm.numerics import Factorisation, FloatArray, bordered


class StepwiseCorrector(Corrector):
    """A `Corrector` of any curve: each step evaluates the equations and factorises a matrix."""

    def __init__(self, curve: ContinuationProblem):
        super().__init__(curve)
        self._count = ResonanceCount(curve)

    def correct(
        self,
        guess: FloatArray,
        scale: FloatArray,
        constraint: Constraint,
        switches: NDArray[np.bool_],
        precision: float = 1e-6,
        radius: float = 0.5,
    ) -> Corrected | None:
        """As `Corrector.correct`."""
        point, direction, sign = guess, None, 0
        last_step, correction = np.inf, 0
        while True:
            try:
                evaluation = self.curve.evaluate(point[:-1], point[-1], switches)
            except ArithmeticError:
                return None
            if np.isnan(evaluation.norm):
                self.defined = False
                return None
            value, row = constraint(point, evaluation)
            on_curve = evaluation.norm <= TOLERANCE and abs(value) <= TOLERANCE
            if on_curve and direction is not None and last_step <= precision:
                break
            if correction == MAX_CORRECTIONS or not np.isfinite(value):
                if direction is None or not on_curve or last_step > STAGNATION:
                    return None
                break
            columns, sign = self._step(evaluation, scale, row, value)
            if columns is None:
                return None
            step, direction = columns[:, 0], columns[:, 1] / np.linalg.norm(columns[:, 1])
            previous, last_step = last_step, float(np.linalg.norm(step))
            if correction > 2 and last_step > previous:
                if not on_curve:
                    return None
                break
            if last_step > radius:
                return None
            point, correction = point + step * scale, correction + 1
        return self._corrected(point, evaluation, scale, direction, sign, guess, switches)

    def tangent(
        self, point: FloatArray, scale: FloatArray, row: FloatArray, switches: NDArray[np.bool_]
    ) -> Corrected | None:
        """As `Corrector.tangent`."""
        borders = row, unit_parameter(len(row))
        try:
            evaluation = self.curve.evaluate(point[:-1], point[-1], switches)
        except ArithmeticError:
            return None
        for border in borders:
            columns, sign = self._step(evaluation, scale, border, 0.0)
            if columns is not None:
                direction = columns[:, 1] / np.linalg.norm(columns[:, 1])
                return self._corrected(point, evaluation, scale, direction, sign, point, switches)
        return None

    def _corrected(self, point, evaluation, scale, direction, sign, guess, switches) -> Corrected:
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
            self._count.below(point[:-1], point[-1], evaluation.states),
        )

    def _step(self, evaluation: Evaluation, scale: FloatArray, row: FloatArray, value: float):
        """Newton step and unnormalised tangent as two columns, and the sign of the determinant."""
        force = evaluation.magnitude or 1.0
        matrix = bordered(
            evaluation.jacobian * (scale[:-1] / force),
            evaluation.by_parameter * (scale[-1] / force),
            row,
        )
        right = np.zeros((len(row), 2), order="F")
        right[:-1, 0] = -evaluation.residual / force
        right[-1] = -value, 1.0
        self.solves += 1
        factors = Factorisation(matrix)
        return factors.solve(right), factors.sign
