"""Choice of the harmonics of every solution for a given accuracy."""

from symhbm.response.accuracy.branch_parts import BranchPart, Solution, joined, status_of
from symhbm.response.accuracy.harmonic_sets import advice, check_accuracy
from symhbm.response.accuracy.refinement import Refinement
from symhbm.response.accuracy.truncation import truncation_table

__all__ = [
    "BranchPart",
    "Refinement",
    "Solution",
    "advice",
    "check_accuracy",
    "joined",
    "status_of",
    "truncation_table",
]
