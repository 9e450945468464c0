"""Curves of motions that no force drives."""

from symhbm.response.unforced.curve import UnforcedCurve
from symhbm.response.unforced.mode_curve import blank_mode_curve, mode_curve, mode_problem

__all__ = ["UnforcedCurve", "blank_mode_curve", "mode_curve", "mode_problem"]
