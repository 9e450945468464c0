"""What a corrector is: from a guess to a point of a path, closed by a plane or a limit."""

import math
from abc import ABC, abstractmethod
from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import Evaluation
from symhbm.continuation.newton import NewtonResult, deflated_steps, newton, step_of
from symhbm.continuation.problem import BEYOND, ROUND_OFF, ContinuationProblem, Corrected
from symhbm.numerics import FloatArray, bordered, length_of
from symhbm.numerics.loops import Loop

ON_LIMIT = 1e-9
"""Margin up to which contacts are on their limits, and change state together."""

_FARTHEST = 0.5
"""Scaled distance from a guess beyond which a solution is another one."""


class Hyperplane(NamedTuple):
    """The plane through ``anchor`` with the scaled ``normal``, all (n_unknowns + 1,)."""

    anchor: FloatArray
    scale: FloatArray
    normal: FloatArray

    def __call__(self, point: FloatArray, evaluation: Evaluation) -> tuple[float, FloatArray]:
        """Scaled distance from the plane, and its normal."""
        return float(np.dot(self.normal, (point - self.anchor) / self.scale)), self.normal

    def write(self, normal: FloatArray, anchor: FloatArray, limit: FloatArray) -> None:
        """Write the plane into the inputs of a bordered system."""
        normal[:], anchor[:], limit[:] = self.normal, self.anchor, 0.0


class AtLimit(NamedTuple):
    """The limit of one switch, numbered ``contact`` among those of all contacts."""

    curve: ContinuationProblem
    contact: int
    scale: FloatArray

    def __call__(self, point: FloatArray, evaluation: Evaluation) -> tuple[float, FloatArray]:
        """The margin of the switch, 0 where that is round-off, and its gradient."""
        row = self.curve.margin_gradient(evaluation, self.contact)
        margin = float(evaluation.states.margins[self.contact])
        known = abs(margin) > ROUND_OFF * float(np.dot(np.abs(row), np.abs(point)))
        return margin if known else 0.0, row * self.scale

    def write(self, normal: FloatArray, anchor: FloatArray, limit: FloatArray) -> None:
        """Write the switch in place of a plane, whose ``anchor`` then does not count."""
        normal[:], limit[:] = 0.0, 0.0
        limit[self.contact] = 1.0


Constraint = Hyperplane | AtLimit
"""One equation in addition to those of the curve, with the ``scale`` that steps are in."""


@Loop
def crossed(margins, switches) -> Any:
    """Which switches are beyond the limit of their held state ``switches``, all (n_switches,)."""
    result = np.empty(len(margins), dtype=np.bool_)
    for i in range(len(margins)):
        outward = -margins[i] if switches[i] else margins[i]
        result[i] = BEYOND < outward < math.inf
    return result


def unit_parameter(size: int) -> FloatArray:
    """The unit vector of the parameter among ``size`` scaled variables."""
    vector = np.zeros(size)
    vector[-1] = 1.0
    return vector


class Corrector(ABC):
    """Corrects guesses onto a curve; ``solves`` counts the linear solves.

    ``defined`` tells whether all forces were numbers where it tried since it was last set.
    """

    def __init__(self, curve: ContinuationProblem):
        self.curve = curve
        self.solves: int = 0
        self.defined = True

    @abstractmethod
    def correct(
        self,
        guess: FloatArray,
        constraint: Constraint,
        switches: NDArray,
        precision: float = 1e-6,
        radius: float = 0.5,
    ) -> Corrected | None:
        """Solve from ``guess`` (n_unknowns + 1,), the states ``switches`` of switches held.

        Steps are relative to the scale of the constraint. The tangent is that of a point within
        ``precision`` of the solution. None if a step exceeds ``radius`` or nothing converges.
        """

    @abstractmethod
    def tangent_along(
        self, point: FloatArray, plane: Hyperplane, switches: NDArray
    ) -> Corrected | None:
        """Tangent at a solution, along the normal of a plane; None where there is none."""

    def tangent(
        self, point: FloatArray, scale: FloatArray, row: FloatArray, switches: NDArray
    ) -> Corrected | None:
        """Tangent at a solution in the states ``switches``, along ``row`` or else the parameter."""
        planes = (Hyperplane(point, scale, normal) for normal in (row, unit_parameter(len(row))))
        tangents = (self.tangent_along(point, plane, switches) for plane in planes)
        return next((tangent for tangent in tangents if tangent is not None), None)

    def reach(
        self, guess: FloatArray, plane: Constraint, switches: NDArray, precision: float
    ) -> Corrected | None:
        """As `correct`; where full steps fail, from where those lead that lower the residual.

        Beside a sharp bend the derivatives at the guess are those of another side.
        """
        found, scale = self.correct(guess, plane, switches, precision), plane.scale
        if found is not None:
            return found
        start = guess / scale
        with suppress(ArithmeticError):
            force = self.curve.evaluate(guess[:-1], float(guess[-1]), switches).magnitude or 1.0

            def equations(scaled: FloatArray) -> Evaluation:
                point = scaled * scale
                evaluation = self.curve.evaluate(point[:-1], float(point[-1]), switches)
                value, row = plane(point, evaluation)
                columns = evaluation.jacobian * scale[:-1], evaluation.by_parameter * scale[-1]
                residual = np.append(evaluation.residual, force * value)
                jacobian = bordered(*columns, force * row)
                return replace(evaluation, residual=residual, jacobian=jacobian)

            result = newton(equations, start)
            self.solves += result.iterations
            if result.converged and length_of(result.unknowns - start) <= _FARTHEST:
                found = self.correct(result.unknowns * scale, plane, switches, precision)
        return found

    def step(self, unknowns: FloatArray, value: float) -> tuple[float, FloatArray | None]:
        """Norm of the equations at a value, and Newton's step, states of switches free.

        Raises ArithmeticError where a force cannot be computed; None for a singular system.
        """
        self.solves += 1
        return step_of(self.curve.evaluate(unknowns, value))

    def approach(
        self, unknowns: FloatArray, value: float, known: FloatArray, left: int
    ) -> tuple[FloatArray, FloatArray, int] | None:
        """As `Approach`, at a value."""
        return deflated_steps(lambda trial: self.step(trial, value), unknowns, known, left)

    def free(self, unknowns: FloatArray, value: float) -> NewtonResult:
        """Solution at a ``value`` from ``unknowns`` (n_unknowns,), states of switches free."""
        result = newton(lambda trial: self.curve.evaluate(trial, value), unknowns)
        self.solves += result.iterations
        return result
