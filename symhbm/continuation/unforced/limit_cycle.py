"""Limit cycles: free motions that take as much energy from the structure as they give to it."""

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.continuation.problem import ParameterProblem
from symhbm.continuation.unforced.problem import Balanced, UnforcedProblem
from symhbm.numerics import FloatArray


class LimitCycleProblem(UnforcedProblem):
    """Limit cycles over one named parameter: coefficients and frequency are unknown.

    The parameter is set for all blades or contacts at once, or for that at ``index`` alone, None
    where none moves; lengths along it are relative to no less than ``smallest``. ``phase`` as of
    `UnforcedProblem`, for example `phase_of` the first cycle. Cycles are looked for where ``size``
    (n_coefficients,) times the coefficients, an amplitude [m], is in a band of ``amplitudes``.
    ``problem`` has no force that oscillates, as `symhbm.balance.unforced` gives it.
    """

    peaked = False

    def __init__(
        self,
        problem: HarmonicBalance,
        name: str | None,
        phase: FloatArray,
        index: int | None = None,
        smallest: float = 0.0,
        size: FloatArray | None = None,
        amplitudes: tuple[float, float] = (0.0, np.inf),
    ):
        super().__init__(problem, phase)
        self._parameter = None if name is None else ParameterProblem(problem, name, np.nan, index)
        self.name = None if self._parameter is None else self._parameter.name
        self.smallest = smallest
        self._size, self.amplitudes = size, amplitudes

    def problem_at(self, value: float) -> HarmonicBalance:
        """The problem with the parameter at ``value``."""
        return self.problem if self._parameter is None else self._parameter.at(value)[0]

    def amplitude(self, unknowns: FloatArray) -> float:
        """The amplitude [m] that unknowns tell; 0 where nothing tells it."""
        motion = unknowns[: self.problem.n_unknowns]
        return 0.0 if self._size is None else float(self._size @ motion)

    def balance(
        self, unknowns: FloatArray, value: float, switches: NDArray[np.bool_] | None
    ) -> Balanced:
        """The balance of the motion, and its derivative by the parameter."""
        low, high = self.amplitudes
        if not low <= (amplitude := self.amplitude(unknowns)) <= high:
            raise ArithmeticError(f"no cycle of {amplitude:g} m is looked for")
        problem, frequency = self.problem_at(value), self.frequency(unknowns)
        motion = unknowns[: problem.n_unknowns]
        evaluation = problem.evaluate(motion, frequency, switches)
        if self._parameter is None:
            return Balanced(evaluation, (), np.zeros(len(motion)))
        along = self._parameter.along(problem, motion, frequency, evaluation)
        return Balanced(evaluation, (), along.by_parameter, along.margins_by_parameter)
