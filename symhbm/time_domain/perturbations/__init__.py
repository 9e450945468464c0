"""Small perturbations of motions, and what becomes of them over a period."""

from symhbm.time_domain.perturbations.multipliers import (
    multipliers,
    multipliers_of_part,
    period_map,
    repeats,
)

__all__ = ["multipliers", "multipliers_of_part", "period_map", "repeats"]
