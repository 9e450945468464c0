"""Numerical continuation: one solution by Newton's method, and the branch through it."""

from symhbm.continuation.branch import Branch
from symhbm.continuation.correctors import by_machine_code, prepare
from symhbm.continuation.deflation import other_solution
from symhbm.continuation.following import filled, follow_branch
from symhbm.continuation.newton import ACCEPTED, NewtonResult, newton, slope_of
from symhbm.continuation.point import Event, PathPoint
from symhbm.continuation.problem import ContinuationProblem, FrequencyProblem, ParameterProblem
from symhbm.continuation.resonance_count import LARGEST_SIZE
from symhbm.continuation.segment import PathState
from symhbm.continuation.start import linear_response, solve_point
from symhbm.continuation.status import SolveError, Status

__all__ = [
    "ACCEPTED",
    "LARGEST_SIZE",
    "Branch",
    "ContinuationProblem",
    "Event",
    "FrequencyProblem",
    "NewtonResult",
    "ParameterProblem",
    "PathPoint",
    "PathState",
    "SolveError",
    "Status",
    "by_machine_code",
    "filled",
    "follow_branch",
    "linear_response",
    "newton",
    "other_solution",
    "prepare",
    "slope_of",
    "solve_point",
]
