"""Natural modes, matrices of low rank beside sparse ones, and displacements as coordinates."""

from symhbm.model.linear.eigenmodes import (
    all_modes,
    gyroscopic_part,
    hermitian,
    lowest_gyroscopic,
    lowest_modes,
    natural_band,
    natural_modes_of,
)
from symhbm.model.linear.low_rank import (
    LowRankSum,
    RelativeCoordinates,
    check_held,
    components,
    definite,
    displacements,
    factorised,
    lagging,
    phasors,
    turn,
)

__all__ = [
    "LowRankSum",
    "RelativeCoordinates",
    "all_modes",
    "check_held",
    "components",
    "definite",
    "displacements",
    "factorised",
    "gyroscopic_part",
    "hermitian",
    "lagging",
    "lowest_gyroscopic",
    "lowest_modes",
    "natural_band",
    "natural_modes_of",
    "phasors",
    "turn",
]
