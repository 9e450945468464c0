"""Arguments of a design, checked: variables, cases, constraints, and aims of the user."""

from symhbm.design.arguments.constraints import read_limits
from symhbm.design.arguments.designed import read_start, read_variables
from symhbm.design.arguments.objectives import (
    check_dimensions,
    check_forces,
    check_ratios,
    read_aim,
    read_bands,
    read_peaks,
)

__all__ = [
    "check_dimensions",
    "check_forces",
    "check_ratios",
    "read_aim",
    "read_bands",
    "read_limits",
    "read_peaks",
    "read_start",
    "read_variables",
]
