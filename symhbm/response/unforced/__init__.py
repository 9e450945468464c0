"""Curves of motions that no force drives."""

from symhbm.response.unforced.curve import UnforcedCurve
from symhbm.response.unforced.mode_curve import blank_mode_curve, mode_curve, with_dof
from symhbm.response.unforced.synthesis import synthesised_response

__all__ = [
    "UnforcedCurve",
    "blank_mode_curve",
    "mode_curve",
    "synthesised_response",
    "with_dof",
]
