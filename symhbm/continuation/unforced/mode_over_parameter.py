"""Nonlinear modes of one amplitude over a parameter of the structure or of its contacts."""

from copy import copy
from typing import Self

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.continuation.problem import ParameterProblem
from symhbm.continuation.unforced.nonlinear_mode import NonlinearModeProblem
from symhbm.continuation.unforced.problem import Balanced, Condition, UnforcedProblem
from symhbm.numerics import FloatArray


class ModeOverParameterProblem(NonlinearModeProblem):
    """A nonlinear mode of a constant ``level`` [m] of its amplitude over one named parameter.

    Unknown are the coefficients, the angular frequency and the damping ratio. The parameter is set
    for all blades or contacts at once, or for that at ``index`` alone; lengths along it are
    relative to no less than ``smallest``. It must not change the mass matrix.
    """

    def __init__(
        self,
        problem: HarmonicBalance,
        dof: int,
        name: str,
        level: float,
        index: int | None = None,
        smallest: float = 0.0,
    ):
        super().__init__(problem, dof)
        self._parameter = ParameterProblem(problem, name, np.nan, index)
        self.name, self.level, self.smallest = self._parameter.name, level, smallest

    def with_level(self, level: float) -> Self:
        """The same equations at another amplitude [m]."""
        result = copy(self)
        result.level = level
        return result

    def problem_at(self, value: float) -> HarmonicBalance:
        """The problem with the parameter at ``value``."""
        return self._parameter.at(value)[0]

    def balance(
        self, unknowns: FloatArray, value: float, switches: NDArray[np.bool_] | None
    ) -> Balanced:
        """As over the amplitude, with the derivative by the parameter."""
        problem, frequency = self.problem_at(value), self.frequency(unknowns)
        motion = unknowns[: problem.n_unknowns]
        free = problem.evaluate(motion, frequency, switches)
        along = self._parameter.along(problem, motion, frequency, free)
        evaluation, by_damping = self._sustained(
            free, motion, frequency, self.damping_ratio(unknowns)
        )
        by_value, margins = along.by_parameter, along.margins_by_parameter
        return Balanced(evaluation, (by_damping,), by_value, margins)

    def conditions(self, unknowns: FloatArray, value: float) -> list[Condition]:
        """The phase, and the amplitude of the cosine, which does not change."""
        level = self.level
        return [
            Condition(self.phase, 0.0, 0.0, level),
            Condition(self._cosine, level, 0.0, level),
        ]

    def scale(self, point: FloatArray) -> FloatArray:
        """As of any unforced motion, lengths along the parameter relative to its value."""
        return UnforcedProblem.scale(self, point)
