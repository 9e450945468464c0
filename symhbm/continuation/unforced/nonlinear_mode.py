"""Nonlinear modes: free motions of a given amplitude, or of one amplitude over a parameter.

In the extended periodic motion concept negative damping proportional to the mass makes the motion
periodic, see `symhbm.balance.SustainedMotion`; the damping ratio is unknown.
"""

from copy import copy
from typing import Self

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance, SustainedMotion
from symhbm.continuation.unforced.problem import (
    Balanced,
    Condition,
    UnforcedProblem,
    first_harmonic,
)
from symhbm.numerics import FloatArray

NO_DAMPING = 1e-11
"""Damping ratio that is 0 but for round-off."""


class NonlinearModeProblem(UnforcedProblem):
    """A nonlinear mode over the common logarithm of its amplitude [m].

    Unknown are the coefficients, the angular frequency and the damping ratio. The amplitude is that
    of the first harmonic of the unknown degree of freedom ``dof``, whose motion in it is a cosine.
    """

    peaked = False  # the amplitude is what moves
    more = (1.0,)
    """A damping ratio is as much as the same relative change of the frequency."""

    def __init__(
        self,
        problem: HarmonicBalance,
        dof: int,
        name: str | None = None,
        index: int | None = None,
        smallest: float = 0.0,
    ):
        self.dof = dof
        self._cosine, phase = first_harmonic(problem, dof)
        super().__init__(problem, phase, name, index, smallest)
        self.sustained = SustainedMotion(problem)

    @property
    def damping_place(self) -> int:
        """Number of the damping ratio among the unknowns."""
        return self.problem.n_unknowns + 1

    def damping_ratio(self, unknowns: FloatArray) -> float:
        """The damping ratio among unknowns."""
        return float(unknowns[self.damping_place])

    def amplitude(self, unknowns: FloatArray) -> float:
        """The amplitude [m] that unknowns tell."""
        return float(self._cosine @ unknowns[: self.problem.n_unknowns])

    def modal_amplitude(self, unknowns: FloatArray) -> float:
        """The modal amplitude [kg^1/2 m] of a motion, see `SustainedMotion.modal_amplitude`."""
        return self.sustained.modal_amplitude(unknowns[: self.problem.n_unknowns])

    def balance(
        self, unknowns: FloatArray, value: float, switches: NDArray[np.bool_] | None
    ) -> Balanced:
        """The balance of the motion with the force that sustains it; the amplitude is not in it."""
        free = super().balance(unknowns, value, switches)
        motion, frequency = unknowns[: self.problem.n_unknowns], self.frequency(unknowns)
        at = motion, frequency, self.damping_ratio(unknowns)
        evaluation, by_damping = self.sustained(free.evaluation, *at)
        return free._replace(evaluation=evaluation, by_more=(by_damping,))

    def conditions(self, unknowns: FloatArray, value: float) -> list[Condition]:
        """The phase, and the amplitude of the cosine."""
        amplitude = 10.0**value
        if not 0 < amplitude < np.inf:
            raise ArithmeticError(f"no mode has the amplitude {amplitude:g} m")
        slope = np.log(10.0) * amplitude
        return [
            Condition(self.phase, 0.0, 0.0, amplitude),
            Condition(self._cosine, amplitude, slope, amplitude),
        ]

    def scale(self, point: FloatArray) -> FloatArray:
        """As of any unforced motion; lengths along the parameter in decades of the amplitude."""
        scale = super().scale(point)
        scale[-1] = 1.0
        return scale


class ModeOverParameterProblem(NonlinearModeProblem):
    """A nonlinear mode of a constant ``level`` [m] of its amplitude over one named parameter.

    Unknown are the coefficients, the angular frequency and the damping ratio. ``index`` and
    ``smallest`` as of `UnforcedProblem`. The parameter must not change the mass matrix.
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
        super().__init__(problem, dof, name, index, smallest)
        self.level = level

    def with_level(self, level: float) -> Self:
        """The same equations at another amplitude [m]."""
        result = copy(self)
        result.level = level
        return result

    def conditions(self, unknowns: FloatArray, value: float) -> list[Condition]:
        """The phase, and the amplitude of the cosine, which does not change."""
        level = self.level
        return [Condition(self.phase, 0.0, 0.0, level), Condition(self._cosine, level, 0.0, level)]

    def scale(self, point: FloatArray) -> FloatArray:
        """As of any unforced motion, lengths along the parameter relative to its value."""
        return UnforcedProblem.scale(self, point)
