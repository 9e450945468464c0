"""Correctors: Newton's method on the balance and one constraint, stepwise or compiled."""

from symhbm.continuation.correctors.compiled import corrector_of
from symhbm.continuation.correctors.corrector import (
    ON_LIMIT,
    AtLimit,
    Constraint,
    Corrector,
    Hyperplane,
    crossed,
    unit_parameter,
)
from symhbm.continuation.correctors.newton_graph import MAX_CORRECTIONS, STAGNATION
from symhbm.continuation.correctors.programs import by_machine_code, prepare
from symhbm.continuation.correctors.resonance_count import LARGEST_SIZE, structure_matrices
from symhbm.continuation.correctors.stepwise import StepwiseCorrector
from symhbm.continuation.problem import BEYOND

__all__ = [
    "BEYOND",
    "LARGEST_SIZE",
    "MAX_CORRECTIONS",
    "ON_LIMIT",
    "STAGNATION",
    "AtLimit",
    "Constraint",
    "Corrector",
    "Hyperplane",
    "StepwiseCorrector",
    "by_machine_code",
    "corrector_of",
    "crossed",
    "prepare",
    "structure_matrices",
    "unit_parameter",
]
