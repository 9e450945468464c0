"""Branches in Fourier coefficients and switching angles, the unknowns of Eqs. (9)-(11)."""

from symhbm.continuation.angles.corrector import (
    ANGLES_ENDED,
    AngleCorrector,
    angle_branches,
    covered,
)
from symhbm.continuation.angles.solvers import check_angles, check_path_angles
from symhbm.continuation.angles.system import AngleStatus, solve_angles

__all__ = [
    "ANGLES_ENDED",
    "AngleCorrector",
    "AngleStatus",
    "angle_branches",
    "check_angles",
    "check_path_angles",
    "covered",
    "solve_angles",
]
