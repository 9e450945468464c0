"""What vibrates, what rubs, and what drives it."""

from symhbm.model import forces
from symhbm.model.builders import bladed_disk, single_blade
from symhbm.model.damping import ModalDamping, RayleighDamping, StructuralDamping
from symhbm.model.excitation import (
    EngineOrder,
    Excitation,
    ForceSum,
    HarmonicForce,
    PointForce,
    StaticLoad,
    check_excitation,
    force_coefficients,
)
from symhbm.model.interfaces import contact_pairs
from symhbm.model.matrices import Model
from symhbm.model.outputs import Output
from symhbm.model.parameters import (
    BLADE_PARAMETERS,
    CONTACT_PARAMETERS,
    PARAMETERS,
    SHORT,
    ReadOnly,
    amplitude_of,
    is_pattern,
)
from symhbm.model.places import Place, Places, next_sector, number_of
from symhbm.model.plausibility import DOUBT, MANY, advise_condensing, check_size, warn_of_doubts
from symhbm.model.sectors import find_symmetry
from symhbm.model.shown import as_table, rows_of
from symhbm.model.structure import Structure
from symhbm.model.symmetry import Symmetry

__all__ = [
    "BLADE_PARAMETERS",
    "CONTACT_PARAMETERS",
    "DOUBT",
    "MANY",
    "PARAMETERS",
    "SHORT",
    "EngineOrder",
    "Excitation",
    "ForceSum",
    "HarmonicForce",
    "ModalDamping",
    "Model",
    "Output",
    "Place",
    "Places",
    "PointForce",
    "RayleighDamping",
    "ReadOnly",
    "StaticLoad",
    "StructuralDamping",
    "Structure",
    "Symmetry",
    "advise_condensing",
    "amplitude_of",
    "as_table",
    "bladed_disk",
    "check_excitation",
    "check_size",
    "contact_pairs",
    "find_symmetry",
    "force_coefficients",
    "forces",
    "is_pattern",
    "next_sector",
    "number_of",
    "rows_of",
    "single_blade",
    "warn_of_doubts",
]
