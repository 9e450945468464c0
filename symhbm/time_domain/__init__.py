"""Exact periodic motions in the time domain, and the stability of responses."""

from symhbm.time_domain.event_march import March, march
from symhbm.time_domain.exact_motion import ExactMotion
from symhbm.time_domain.linear_motion import LinearMotion, curved, extremes
from symhbm.time_domain.motion import exact_motion_of
from symhbm.time_domain.periodic_orbit import PERIODIC_TOLERANCE, energy_scale
from symhbm.time_domain.shooting import INTEGRATION_TOLERANCE
from symhbm.time_domain.stability import check_stability, growth_rate, verdict

__all__ = [
    "INTEGRATION_TOLERANCE",
    "PERIODIC_TOLERANCE",
    "ExactMotion",
    "LinearMotion",
    "March",
    "check_stability",
    "curved",
    "energy_scale",
    "exact_motion_of",
    "extremes",
    "growth_rate",
    "march",
    "verdict",
]
