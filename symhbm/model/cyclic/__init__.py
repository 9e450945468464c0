"""What turns: one sector of a disk of identical ones, its waves, stiffness by the speed."""

from symhbm.model.cyclic.influence import Influence
from symhbm.model.cyclic.rotating import PER_MINUTE, RotatingModel
from symhbm.model.cyclic.sector import Sector
from symhbm.model.cyclic.waves import Blade, turn_about
from symhbm.model.linear import components, displacements, phasors
from symhbm.model.sectors import check_speed, speed_order

__all__ = [
    "PER_MINUTE",
    "Blade",
    "Influence",
    "RotatingModel",
    "Sector",
    "check_speed",
    "components",
    "displacements",
    "phasors",
    "speed_order",
    "turn_about",
]
