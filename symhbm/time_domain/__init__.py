"""Exact periodic motions in the time domain, and the stability of responses."""

from symhbm.time_domain.exact_motion import ExactMotion
from symhbm.time_domain.integrated_motion import INTEGRATION_TOLERANCE
from symhbm.time_domain.motion import exact_motion_of, free_motion
from symhbm.time_domain.stability import Growth, check_stability, cycle_growth, growth, verdict
from symhbm.time_domain.stability_changes import Change, Known, held_between, stability_changes

__all__ = [
    "INTEGRATION_TOLERANCE",
    "Change",
    "ExactMotion",
    "Growth",
    "Known",
    "check_stability",
    "cycle_growth",
    "exact_motion_of",
    "free_motion",
    "growth",
    "held_between",
    "stability_changes",
    "verdict",
]
