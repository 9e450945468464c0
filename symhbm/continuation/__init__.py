"""One solution, and the branch of solutions through it."""

from symhbm.continuation.branch import Walk
from symhbm.continuation.newton import ACCEPTED, NewtonResult, newton, slope_of
from symhbm.continuation.point import Event, PathPoint
from symhbm.continuation.problem import Curve, FrequencyCurve, ParameterCurve
from symhbm.continuation.resonance_count import LARGEST_SIZE
from symhbm.continuation.segment import Station
from symhbm.continuation.start import linear_response, solve_point
from symhbm.continuation.status import SolveError, Status

__all__ = [
    "ACCEPTED",
    "LARGEST_SIZE",
    "Curve",
    "Event",
    "FrequencyCurve",
    "NewtonResult",
    "ParameterCurve",
    "PathPoint",
    "SolveError",
    "Station",
    "Status",
    "Walk",
    "linear_response",
    "newton",
    "slope_of",
    "solve_point",
]
