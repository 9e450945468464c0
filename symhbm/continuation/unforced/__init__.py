"""Motions that no force drives: nonlinear modes and limit cycles, whose frequency is unknown."""

from symhbm.continuation.unforced.limit_cycle import LimitCycleProblem
from symhbm.continuation.unforced.nonlinear_mode import NonlinearModeProblem
from symhbm.continuation.unforced.problem import (
    Balanced,
    Condition,
    UnforcedProblem,
    phase_of,
)

__all__ = [
    "Balanced",
    "Condition",
    "LimitCycleProblem",
    "NonlinearModeProblem",
    "UnforcedProblem",
    "phase_of",
]
