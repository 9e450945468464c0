"""Periodic forces, and static ones: what drives a structure."""

from symhbm.model.excitation.base_motion import BaseMotion, bases_of, motions_of_base
from symhbm.model.excitation.excitation import (
    Excitation,
    ForceSum,
    check_excitation,
    force_coefficients,
    static_force,
)
from symhbm.model.excitation.forces import (
    EngineOrder,
    FieldForce,
    HarmonicForce,
    PointForce,
    StaticLoad,
    check_whole,
    sector_order,
)
from symhbm.model.excitation.frequency_force import FrequencyForce
from symhbm.model.excitation.values import nodal_field

__all__ = [
    "BaseMotion",
    "EngineOrder",
    "Excitation",
    "FieldForce",
    "ForceSum",
    "FrequencyForce",
    "HarmonicForce",
    "PointForce",
    "StaticLoad",
    "bases_of",
    "check_excitation",
    "check_whole",
    "force_coefficients",
    "motions_of_base",
    "nodal_field",
    "sector_order",
    "static_force",
]
