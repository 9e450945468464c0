"""Forced response of bladed disks with dry friction by multi-harmonic balance."""

import sys
from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from symhbm.balance import HarmonicBalance, SwitchingAngles
from symhbm.continuation import SolveError, Status
from symhbm.design import (
    flutter_limit,
    maximise_damping,
    maximise_flutter_limit,
    minimise_peak,
    pareto_front,
)
from symhbm.model import (
    ContactPairs,
    EngineOrder,
    HarmonicForce,
    ModalDamping,
    Model,
    Places,
    PointForce,
    RayleighDamping,
    StaticLoad,
    StructuralDamping,
    Structure,
    bladed_disk,
    contact_pairs,
    next_sector,
    single_blade,
)
from symhbm.model.condensation import condense
from symhbm.model.contacts import (
    ContactLaw,
    Contacts,
    Coulomb,
    CubicSpring,
    Friction,
    Gap,
    Located,
    Parameter,
    PlanarFriction,
    PolynomialLaw,
    SmoothLaw,
    Switch,
    UnilateralSpring,
    VariableLoadFriction,
)
from symhbm.model.cyclic import Influence, Sector
from symhbm.model.excitation import BaseMotion, FieldForce, FrequencyForce, nodal_field
from symhbm.model.files import read_structure, save_structure
from symhbm.model.reduction import craig_bampton, mistuned_ring
from symhbm.model.rotation import RotatingModel
from symhbm.peaks import peak_curve, sensitivity
from symhbm.response import (
    campbell,
    follow,
    frf,
    limit_cycles,
    natural_modes,
    nonlinear_modes,
    other_branches,
    periodic_motion,
    recover,
    resume,
    sector_response,
    solve,
    static_states,
    synthesised_response,
    verify,
)
from symhbm.results import Run
from symhbm.results.archive import ArchiveError, load, merge, rebuild, save
from symhbm.results.reading import motion, output, seen_from, table, trimmed

if TYPE_CHECKING:
    from symhbm import plot
    from symhbm.ensembles import mistuning, statistics
    from symhbm.plot.viewer import view

__version__ = version("symhbm")

__all__ = [
    "ArchiveError",
    "BaseMotion",
    "ContactLaw",
    "ContactPairs",
    "Contacts",
    "Coulomb",
    "CubicSpring",
    "EngineOrder",
    "FieldForce",
    "FrequencyForce",
    "Friction",
    "Gap",
    "HarmonicBalance",
    "HarmonicForce",
    "Influence",
    "Located",
    "ModalDamping",
    "Model",
    "Parameter",
    "Places",
    "PlanarFriction",
    "PointForce",
    "PolynomialLaw",
    "RayleighDamping",
    "RotatingModel",
    "Run",
    "Sector",
    "SmoothLaw",
    "SolveError",
    "StaticLoad",
    "Status",
    "StructuralDamping",
    "Structure",
    "Switch",
    "SwitchingAngles",
    "UnilateralSpring",
    "VariableLoadFriction",
    "bladed_disk",
    "campbell",
    "condense",
    "contact_pairs",
    "craig_bampton",
    "flutter_limit",
    "follow",
    "frf",
    "limit_cycles",
    "load",
    "maximise_damping",
    "maximise_flutter_limit",
    "merge",
    "minimise_peak",
    "mistuned_ring",
    "mistuning",
    "motion",
    "natural_modes",
    "next_sector",
    "nodal_field",
    "nonlinear_modes",
    "other_branches",
    "output",
    "pareto_front",
    "peak_curve",
    "periodic_motion",
    "plot",
    "read_structure",
    "rebuild",
    "recover",
    "resume",
    "save",
    "save_structure",
    "sector_response",
    "seen_from",
    "sensitivity",
    "single_blade",
    "solve",
    "static_states",
    "statistics",
    "synthesised_response",
    "table",
    "trimmed",
    "verify",
    "view",
]


_LAZY = {
    "mistuning": "symhbm.ensembles.mistuning",
    "plot": "symhbm.plot",
    "statistics": "symhbm.ensembles.statistics",
}
"""Rooms that need matplotlib or scipy.stats, which are slow to import and not needed to compute."""
_LATE = {"view": "symhbm.plot.viewer"}
"""Functions of such rooms."""


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return import_module(_LAZY[name])
    if name in _LATE:
        return getattr(import_module(_LATE[name]), name)
    # With name and module Python tells the nearest name: "Did you mean: 'frf'?"
    here = sys.modules[__name__]
    raise AttributeError(f"module 'symhbm' has no attribute {name!r}", name=name, obj=here)
