"""Numerical continuation: one solution by Newton's method, and the branch through it."""

from symhbm.continuation.branch import Branch
from symhbm.continuation.correctors import (
    LARGEST_SIZE,
    Corrector,
    by_machine_code,
    corrector_of,
    prepare,
)
from symhbm.continuation.following import branches_over, filled, follow_branch
from symhbm.continuation.newton import (
    ACCEPTED,
    NewtonResult,
    deflated_steps,
    newton,
    other_solution,
    slope_of,
    step_of,
)
from symhbm.continuation.other_branches import FoundBranch, other_branches
from symhbm.continuation.point import Event, EventKind, PathPoint
from symhbm.continuation.problem import ContinuationProblem, FrequencyProblem, ParameterProblem
from symhbm.continuation.segment import PathState, Segment
from symhbm.continuation.start import AtRest, solve_point
from symhbm.continuation.status import SolveError, Status

__all__ = [
    "ACCEPTED",
    "LARGEST_SIZE",
    "AtRest",
    "Branch",
    "ContinuationProblem",
    "Corrector",
    "Event",
    "EventKind",
    "FoundBranch",
    "FrequencyProblem",
    "NewtonResult",
    "ParameterProblem",
    "PathPoint",
    "PathState",
    "Segment",
    "SolveError",
    "Status",
    "branches_over",
    "by_machine_code",
    "corrector_of",
    "deflated_steps",
    "filled",
    "follow_branch",
    "newton",
    "other_branches",
    "other_solution",
    "prepare",
    "slope_of",
    "solve_point",
    "step_of",
]
