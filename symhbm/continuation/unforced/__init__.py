"""Motions that no force drives: nonlinear modes and limit cycles, whose frequency is unknown."""

from symhbm.continuation.unforced.following import follow_mode
from symhbm.continuation.unforced.limit_cycle import LimitCycleProblem
from symhbm.continuation.unforced.linear_modes import LinearMode, linear_mode, mode_start
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
    "LinearMode",
    "NonlinearModeProblem",
    "UnforcedProblem",
    "follow_mode",
    "linear_mode",
    "mode_start",
    "phase_of",
]
