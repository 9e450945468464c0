"""Structures reduced to few degrees of freedom with matrices, and disks made of them."""

from symhbm.model.reduction.craig_bampton import craig_bampton
from symhbm.model.reduction.mistuned_ring import mistuned_ring

__all__ = ["craig_bampton", "mistuned_ring"]
