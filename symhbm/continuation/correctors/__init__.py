"""Newton's method on the equations and one constraint, stepwise or as one compiled function."""

from symhbm.continuation.correctors.constraints import (
    BEYOND,
    ON_LIMIT,
    AtLimit,
    Corrected,
    Hyperplane,
    crossed,
    unit_parameter,
)
from symhbm.continuation.correctors.stepwise import Corrector

__all__ = [
    "BEYOND",
    "ON_LIMIT",
    "AtLimit",
    "Corrected",
    "Corrector",
    "Hyperplane",
    "crossed",
    "unit_parameter",
]
