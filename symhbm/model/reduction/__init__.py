"""Structures reduced to few degrees of freedom with matrices, and disks made of them."""

from symhbm.model.reduction.craig_bampton import craig_bampton
from symhbm.model.reduction.deviations import DeviatingModel, deviations_of
from symhbm.model.reduction.mistuned_ring import MistunedRing, mistuned_ring
from symhbm.model.reduction.reduced_model import ReducedModel, ReductionCertificate

__all__ = [
    "DeviatingModel",
    "MistunedRing",
    "ReducedModel",
    "ReductionCertificate",
    "craig_bampton",
    "deviations_of",
    "mistuned_ring",
]
