"""Events on a path: contact limits, folds, branch points, resonances."""

from symhbm.continuation.events.branch_points import find_branch_point
from symhbm.continuation.events.contact_limits import brief_crossing, first_limit
from symhbm.continuation.events.corners import (
    BEYOND_CORNER,
    LARGEST_PREDICTION_ERROR,
    SMALLEST_STEP,
    step_over_corner,
    turns_back,
)
from symhbm.continuation.events.folds import find_folds
from symhbm.continuation.events.modes import Reduced, reduced
from symhbm.continuation.events.resonances import ResonanceFinder

__all__ = [
    "BEYOND_CORNER",
    "LARGEST_PREDICTION_ERROR",
    "SMALLEST_STEP",
    "Reduced",
    "ResonanceFinder",
    "brief_crossing",
    "find_branch_point",
    "find_folds",
    "first_limit",
    "reduced",
    "step_over_corner",
    "turns_back",
]
