"""Structures that turn: stiffness by the speed, Coriolis forces, speeds along engine orders."""

from symhbm.model.rotation.rotating import RotatingModel
from symhbm.model.rotation.speed import check_at_one_speed, check_speed, speed_order

__all__ = [
    "RotatingModel",
    "check_at_one_speed",
    "check_speed",
    "speed_order",
]
