"""Damping as it is known, and matrices of low rank that some of it is."""

from symhbm.model.damping.forms import Damping, ModalDamping, RayleighDamping, StructuralDamping
from symhbm.model.damping.low_rank import LowRankSum, solver_of_sum

__all__ = [
    "Damping",
    "LowRankSum",
    "ModalDamping",
    "RayleighDamping",
    "StructuralDamping",
    "solver_of_sum",
]
