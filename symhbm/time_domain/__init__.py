"""Exact periodic motions in the time domain, and the stability of responses."""

from symhbm.time_domain.exact_motion import ExactMotion
from symhbm.time_domain.linear_motion import curved, in_plane
from symhbm.time_domain.motion import exact_motion_of
from symhbm.time_domain.shooting import INTEGRATION_TOLERANCE
from symhbm.time_domain.stability import (
    check_stability,
    cycle_growth_rate,
    growth_rate,
    verdict,
)

__all__ = [
    "INTEGRATION_TOLERANCE",
    "ExactMotion",
    "check_stability",
    "curved",
    "cycle_growth_rate",
    "exact_motion_of",
    "growth_rate",
    "in_plane",
    "verdict",
]
