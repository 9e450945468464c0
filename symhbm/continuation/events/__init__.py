"""Events on a path: contact limits, folds, branch points, resonances."""

from symhbm.continuation.events.contact_limits import (
    after_onset,
    beside_limit,
    beyond_limits,
    brief_crossing,
    end_of_slip,
    first_limit,
)
from symhbm.continuation.events.crossing import (
    Crossing,
    Curvature,
    curvature_of,
    is_crossing,
    leaves,
    passed_pairs,
    several_meet,
    solve_crossing,
)
from symhbm.continuation.events.modes import Reduced, ResonanceFinder, reduced
from symhbm.continuation.events.turns import (
    BEYOND_CORNER,
    LARGEST_PREDICTION_ERROR,
    SMALLEST_STEP,
    at_crossing,
    find_branch_point,
    find_folds,
    step_over_corner,
    turns_back,
)

__all__ = [
    "BEYOND_CORNER",
    "LARGEST_PREDICTION_ERROR",
    "SMALLEST_STEP",
    "Crossing",
    "Curvature",
    "Reduced",
    "ResonanceFinder",
    "after_onset",
    "at_crossing",
    "beside_limit",
    "beyond_limits",
    "brief_crossing",
    "curvature_of",
    "end_of_slip",
    "find_branch_point",
    "find_folds",
    "first_limit",
    "is_crossing",
    "leaves",
    "passed_pairs",
    "reduced",
    "several_meet",
    "solve_crossing",
    "step_over_corner",
    "turns_back",
]
