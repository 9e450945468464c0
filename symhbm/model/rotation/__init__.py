"""Structures that turn: stiffness by the speed, Coriolis forces, speeds along engine orders."""

from symhbm.model.rotation.rotating import RECORDS, RotatingModel, model_of, recalled_model
from symhbm.model.rotation.speed import check_at_one_speed, check_speed, speed_order

__all__ = [
    "RECORDS",
    "RotatingModel",
    "check_at_one_speed",
    "check_speed",
    "model_of",
    "recalled_model",
    "speed_order",
]
