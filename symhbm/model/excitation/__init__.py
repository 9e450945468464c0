"""Periodic forces, and static ones: what drives a structure."""

from symhbm.model.excitation.excitation import (
    Excitation,
    ForceSum,
    check_excitation,
    force_coefficients,
    static_force,
)
from symhbm.model.excitation.forces import (
    EngineOrder,
    HarmonicForce,
    PointForce,
    check_whole,
    sector_order,
)
from symhbm.model.excitation.static_load import StaticLoad
from symhbm.model.excitation.stored import described

__all__ = [
    "EngineOrder",
    "Excitation",
    "ForceSum",
    "HarmonicForce",
    "PointForce",
    "StaticLoad",
    "check_excitation",
    "check_whole",
    "described",
    "force_coefficients",
    "sector_order",
    "static_force",
]
