"""Modes, masses, matrices of low rank beside sparse ones, and displacements as coordinates."""

from symhbm.model.linear.eigenmodes import (
    Matrices,
    NearModes,
    all_modes,
    gyroscopic_part,
    hermitian,
    lowest_gyroscopic,
    lowest_modes,
    natural_band,
    natural_modes_of,
    weighted,
)
from symhbm.model.linear.low_rank import (
    LowRankSum,
    RelativeCoordinates,
    check_held,
    components,
    displacements,
    factorised,
    lagging,
    phasors,
    turn,
)
from symhbm.model.linear.mass import check_semidefinite, dissipates, positive_definite

__all__ = [
    "LowRankSum",
    "Matrices",
    "NearModes",
    "RelativeCoordinates",
    "all_modes",
    "check_held",
    "check_semidefinite",
    "components",
    "displacements",
    "dissipates",
    "factorised",
    "gyroscopic_part",
    "hermitian",
    "lagging",
    "lowest_gyroscopic",
    "lowest_modes",
    "natural_band",
    "natural_modes_of",
    "phasors",
    "positive_definite",
    "turn",
    "weighted",
]
