"""Large structures condensed to the degrees of freedom that contacts and forces touch."""

from symhbm.model.condensation.condense import condense
from symhbm.model.condensation.condensed_model import CondensedModel
from symhbm.model.condensation.partition import LONG, dynamic_stiffness, refined
from symhbm.model.condensation.pole_residue import LARGEST_MODAL, OUTSIDE, PoleResidueFunction
from symhbm.model.linear import factorised

__all__ = [
    "LARGEST_MODAL",
    "LONG",
    "OUTSIDE",
    "CondensedModel",
    "PoleResidueFunction",
    "condense",
    "dynamic_stiffness",
    "factorised",
    "refined",
]
