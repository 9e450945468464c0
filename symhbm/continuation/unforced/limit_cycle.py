"""Limit cycles: free motions that take as much energy from the structure as they give to it."""

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.continuation.problem import ParameterProblem
from symhbm.continuation.unforced.problem import Balanced, UnforcedProblem
from symhbm.numerics import FloatArray


class LimitCycleProblem(UnforcedProblem):
    """Limit cycles over one named parameter: coefficients and frequency are unknown.

    The parameter is set for all blades or contacts at once, or for that at ``index`` alone; lengths
    along it are relative to no less than ``smallest``. ``phase`` as of `UnforcedProblem`, for
    example `phase_of` the first cycle. ``problem`` has no force that oscillates, as
    `HarmonicBalance.unforced` gives it.
    """

    def __init__(
        self,
        problem: HarmonicBalance,
        name: str,
        phase: FloatArray,
        index: int | None = None,
        smallest: float = 0.0,
    ):
        super().__init__(problem, phase)
        self._parameter = ParameterProblem(problem, name, np.nan, index)
        self.name, self.smallest = self._parameter.name, smallest

    def problem_at(self, value: float) -> HarmonicBalance:
        """The problem with the parameter at ``value``."""
        return self._parameter.at(value)[0]

    def balance(
        self, unknowns: FloatArray, value: float, switches: NDArray[np.bool_] | None
    ) -> Balanced:
        """The balance of the motion, and its derivative by the parameter."""
        problem, frequency = self.problem_at(value), self.frequency(unknowns)
        motion = unknowns[: problem.n_unknowns]
        evaluation = problem.evaluate(motion, frequency, switches)
        along = self._parameter.along(problem, motion, frequency, evaluation)
        return Balanced(evaluation, (), along.by_parameter, along.margins_by_parameter)
