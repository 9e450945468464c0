"""Curves of motions that no force drives."""

from symhbm.response.unforced.curve import UnforcedCurve
from symhbm.response.unforced.cycle_curve import blank_cycle_curve, check_modes, cycle_curve
from symhbm.response.unforced.mode_curve import blank_mode_curve, mode_curve, mode_problem
from symhbm.response.unforced.synthesis import synthesised_response

__all__ = [
    "UnforcedCurve",
    "blank_cycle_curve",
    "blank_mode_curve",
    "check_modes",
    "cycle_curve",
    "mode_curve",
    "mode_problem",
    "synthesised_response",
]
