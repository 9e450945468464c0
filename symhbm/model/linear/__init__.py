"""Natural modes, matrices of low rank beside sparse ones, and displacements as coordinates."""

from symhbm.model.linear.eigenmodes import (
    gyroscopic_part,
    hermitian,
    lowest_gyroscopic,
    lowest_modes,
)
from symhbm.model.linear.low_rank import LowRankSum, solver_of_sum
from symhbm.model.linear.natural_frequencies import natural_band
from symhbm.model.linear.natural_modes import natural_modes_of
from symhbm.model.linear.relative import RelativeCoordinates

__all__ = [
    "LowRankSum",
    "RelativeCoordinates",
    "gyroscopic_part",
    "hermitian",
    "lowest_gyroscopic",
    "lowest_modes",
    "natural_band",
    "natural_modes_of",
    "solver_of_sum",
]
