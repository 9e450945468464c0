"""Curves of motions that no force drives."""

from symhbm.response.unforced.arguments import (
    amplitudes_of,
    axis_of,
    checked,
    first_of,
    modes_of,
    wave_of,
)
from symhbm.response.unforced.curve import (
    UnforcedCurve,
    blank_mode_curve,
    free_problem,
    mode_curve,
    mode_problem,
    with_dof,
)
from symhbm.response.unforced.cycle_curve import blank_cycle_curve, cycle_curve, with_cycle_dof
from symhbm.response.unforced.synthesis import synthesised_response

__all__ = [
    "UnforcedCurve",
    "amplitudes_of",
    "axis_of",
    "blank_cycle_curve",
    "blank_mode_curve",
    "checked",
    "cycle_curve",
    "first_of",
    "free_problem",
    "mode_curve",
    "mode_problem",
    "modes_of",
    "synthesised_response",
    "wave_of",
    "with_cycle_dof",
    "with_dof",
]
