"""Motions that no force drives: nonlinear modes and limit cycles, whose frequency is unknown."""

from symhbm.continuation.unforced.cycles import (
    Cycle,
    Cycles,
    cycles_of_mode,
    follow_cycles,
    last_fold,
    settled,
)
from symhbm.continuation.unforced.following import follow_mode, follow_mode_over
from symhbm.continuation.unforced.modes import (
    LinearMode,
    ModeOverParameterProblem,
    NoModeError,
    NonlinearModeProblem,
    linear_mode,
    mode_start,
)
from symhbm.continuation.unforced.problem import (
    LimitCycleProblem,
    UnforcedProblem,
    first_harmonic,
)

__all__ = [
    "Cycle",
    "Cycles",
    "LimitCycleProblem",
    "LinearMode",
    "ModeOverParameterProblem",
    "NoModeError",
    "NonlinearModeProblem",
    "UnforcedProblem",
    "cycles_of_mode",
    "first_harmonic",
    "follow_cycles",
    "follow_mode",
    "follow_mode_over",
    "last_fold",
    "linear_mode",
    "mode_start",
    "settled",
]
