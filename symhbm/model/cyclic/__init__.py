"""One sector of a disk of identical ones, and the travelling waves that it moves in."""

from symhbm.model.cyclic.influence import Coupling, Influence
from symhbm.model.cyclic.sector import Sector
from symhbm.model.cyclic.stored import RECORDS_OF_SECTOR, Blade, SectorShape
from symhbm.model.cyclic.waves import Interfaces, components, displacements, phasors

__all__ = [
    "RECORDS_OF_SECTOR",
    "Blade",
    "Coupling",
    "Influence",
    "Interfaces",
    "Sector",
    "SectorShape",
    "components",
    "displacements",
    "phasors",
]
