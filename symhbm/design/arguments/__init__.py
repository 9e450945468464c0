"""Arguments of a design, checked: variables, cases, constraints, and aims of the user."""

from symhbm.design.arguments.constraints import read_limits
from symhbm.design.arguments.designed import (
    Named,
    called,
    column_of,
    read_pattern,
    read_start,
    read_variables,
    without_symbols_of_its_own,
)
from symhbm.design.arguments.objectives import (
    check_dimensions,
    check_forces,
    check_ratios,
    read_aim,
    read_bands,
    read_peaks,
)

__all__ = [
    "Named",
    "called",
    "check_dimensions",
    "check_forces",
    "check_ratios",
    "column_of",
    "read_aim",
    "read_bands",
    "read_limits",
    "read_pattern",
    "read_peaks",
    "read_start",
    "read_variables",
    "without_symbols_of_its_own",
]
