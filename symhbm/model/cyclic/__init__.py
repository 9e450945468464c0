"""One sector of a disk of identical ones, and the travelling waves that it moves in."""

from symhbm.model.cyclic.blade import Blade
from symhbm.model.cyclic.influence import Coupling, Influence
from symhbm.model.cyclic.sector import Sector
from symhbm.model.cyclic.waves import Interfaces, components, displacements, phasors

__all__ = [
    "Blade",
    "Coupling",
    "Influence",
    "Interfaces",
    "Sector",
    "components",
    "displacements",
    "phasors",
]
