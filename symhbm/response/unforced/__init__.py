"""Curves of motions that no force drives."""

from symhbm.response.unforced.curve import UnforcedCurve
from symhbm.response.unforced.cycle_curve import blank_cycle_curve, cycle_curve, with_cycle_dof
from symhbm.response.unforced.mode_curve import blank_mode_curve, free_problem, mode_curve, with_dof
from symhbm.response.unforced.synthesis import synthesised_response

__all__ = [
    "UnforcedCurve",
    "blank_cycle_curve",
    "blank_mode_curve",
    "cycle_curve",
    "free_problem",
    "mode_curve",
    "synthesised_response",
    "with_cycle_dof",
    "with_dof",
]
