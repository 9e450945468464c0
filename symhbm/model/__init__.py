"""What vibrates, what rubs, and what drives it."""

from symhbm.model.builders import bladed_disk, single_blade
from symhbm.model.excitation import EngineOrder, Excitation, HarmonicForce, PointForce
from symhbm.model.mass import positive_definite
from symhbm.model.matrices import Model
from symhbm.model.natural_frequencies import natural_band
from symhbm.model.parameters import (
    BLADE_PARAMETERS,
    CONTACT_PARAMETERS,
    FRICTION_PARAMETERS,
    PARAMETERS,
    Parameter,
    dims_of,
)
from symhbm.model.plausibility import DOUBT, warn_of_doubts
from symhbm.model.sectors import Symmetry, find_symmetry
from symhbm.model.structure import Structure

__all__ = [
    "BLADE_PARAMETERS",
    "CONTACT_PARAMETERS",
    "DOUBT",
    "FRICTION_PARAMETERS",
    "PARAMETERS",
    "EngineOrder",
    "Excitation",
    "HarmonicForce",
    "Model",
    "Parameter",
    "PointForce",
    "Structure",
    "Symmetry",
    "bladed_disk",
    "dims_of",
    "find_symmetry",
    "natural_band",
    "positive_definite",
    "single_blade",
    "warn_of_doubts",
]
