"""Forced response of bladed disks with dry friction by multi-harmonic balance."""

import sys
from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from symhbm.balance import HarmonicBalance, SwitchingAngles, goals
from symhbm.continuation import SolveError, Status
from symhbm.model import (
    ModalDamping,
    Model,
    Places,
    RayleighDamping,
    StructuralDamping,
    bladed_disk,
    contact_pairs,
    forces,
    next_sector,
    single_blade,
)
from symhbm.model.condensation import condense
from symhbm.model.contacts import Contacts, Friction, Gap, laws
from symhbm.model.cyclic import Influence, RotatingModel, Sector
from symhbm.model.files import read_structure, save_structure
from symhbm.model.reduction import craig_bampton, mistuned_ring

if TYPE_CHECKING:
    from symhbm import plot
    from symhbm.design import (
        flutter_limit,
        identify,
        maximise_damping,
        maximise_flutter_limit,
        minimise_peak,
        pareto_front,
    )
    from symhbm.ensembles import mistuning, statistics
    from symhbm.peaks import peak_curve
    from symhbm.plot.viewer import view
    from symhbm.response import (
        campbell,
        datasets,
        follow,
        frf,
        limit_cycles,
        natural_modes,
        nonlinear_modes,
        other_branches,
        periodic_motion,
        resume,
        solve,
        static_states,
        verify,
    )
    from symhbm.results import Run, scale
    from symhbm.results.archive import load, save

__version__ = version("symhbm")

__all__ = [
    "Contacts",
    "Friction",
    "Gap",
    "HarmonicBalance",
    "Influence",
    "ModalDamping",
    "Model",
    "Places",
    "RayleighDamping",
    "RotatingModel",
    "Run",
    "Sector",
    "SolveError",
    "Status",
    "StructuralDamping",
    "SwitchingAngles",
    "bladed_disk",
    "campbell",
    "condense",
    "contact_pairs",
    "craig_bampton",
    "datasets",
    "flutter_limit",
    "follow",
    "forces",
    "frf",
    "goals",
    "identify",
    "laws",
    "limit_cycles",
    "load",
    "maximise_damping",
    "maximise_flutter_limit",
    "minimise_peak",
    "mistuned_ring",
    "mistuning",
    "natural_modes",
    "next_sector",
    "nonlinear_modes",
    "other_branches",
    "pareto_front",
    "peak_curve",
    "periodic_motion",
    "plot",
    "read_structure",
    "resume",
    "save",
    "save_structure",
    "scale",
    "single_blade",
    "solve",
    "static_states",
    "statistics",
    "verify",
    "view",
]


_LATER = {
    "symhbm.design": "flutter_limit identify maximise_damping maximise_flutter_limit minimise_peak"
    " pareto_front",
    "symhbm.ensembles": "mistuning statistics",
    "symhbm.peaks": "peak_curve",
    "symhbm.plot": "plot",
    "symhbm.plot.viewer": "view",
    "symhbm.response": "campbell datasets follow frf limit_cycles natural_modes nonlinear_modes"
    " other_branches periodic_motion resume solve static_states verify",
    "symhbm.results": "Run scale",
    "symhbm.results.archive": "load save",
}
"""Rooms that need xarray, matplotlib or scipy.stats, and their names; imported when asked for."""
_ROOM_OF = {name: room for room, names in _LATER.items() for name in names.split()}


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    if name in _ROOM_OF:
        room = import_module(_ROOM_OF[name])
        found = room if room.__name__ == f"symhbm.{name}" else getattr(room, name)
        globals()[name] = found
        return found
    # With name and module Python tells the nearest name: "Did you mean: 'frf'?"
    here = sys.modules[__name__]
    raise AttributeError(f"module 'symhbm' has no attribute {name!r}", name=name, obj=here)
