"""Forces on a structure: what a `HarmonicBalance` takes as its excitation."""

from symhbm.model.excitation import (
    BaseMotion,
    EngineOrder,
    FieldForce,
    FrequencyForce,
    HarmonicForce,
    PointForce,
    StaticLoad,
    nodal_field,
)

__all__ = [
    "BaseMotion",
    "EngineOrder",
    "FieldForce",
    "FrequencyForce",
    "HarmonicForce",
    "PointForce",
    "StaticLoad",
    "nodal_field",
]
