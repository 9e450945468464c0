"""Curves of motions that no force drives."""

from symhbm.response.unforced.arguments import amplitudes_of, axis_of, checked, request_of
from symhbm.response.unforced.curve import free_problem, mode_problem, unforced_curve
from symhbm.response.unforced.synthesis import synthesised_response

__all__ = [
    "amplitudes_of",
    "axis_of",
    "checked",
    "free_problem",
    "mode_problem",
    "request_of",
    "synthesised_response",
    "unforced_curve",
]
