"""What a corrector is: Newton's method onto a curve, from a guess to a point of a path."""

from abc import ABC, abstractmethod

from numpy.typing import NDArray

from symhbm.continuation.correctors.constraints import Constraint, Corrected
from symhbm.continuation.newton import NewtonResult, newton
from symhbm.continuation.problem import ContinuationProblem
from symhbm.numerics import FloatArray


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
        scale: FloatArray,
        constraint: Constraint,
        switches: NDArray,
        precision: float = 1e-6,
        radius: float = 0.5,
    ) -> Corrected | None:
        """Solve from ``guess`` (n_unknowns + 1,), the states ``switches`` of switches held.

        Steps are relative to ``scale`` (n_unknowns + 1,). The tangent is that of a point within
        ``precision`` of the solution. None if a step exceeds ``radius`` or nothing converges.
        """

    @abstractmethod
    def tangent(
        self, point: FloatArray, scale: FloatArray, row: FloatArray, switches: NDArray
    ) -> Corrected | None:
        """Tangent at a solution in the states ``switches``, along ``row`` or else the parameter."""

    def free(self, unknowns: FloatArray, value: float) -> NewtonResult:
        """Solution at a ``value`` from ``unknowns`` (n_unknowns,), states of switches free."""
        result = newton(lambda trial: self.curve.evaluate(trial, value), unknowns)
        self.solves += result.iterations
        return result
