"""Forced response of bladed disks with dry friction by multi-harmonic balance."""

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from symhbm.balance import HarmonicBalance, SwitchingAngles
from symhbm.continuation import SolveError, Status
from symhbm.design import minimise_peak
from symhbm.model import EngineOrder, HarmonicForce, Model, PointForce, bladed_disk, single_blade
from symhbm.model.condensation import condense
from symhbm.peaks import peak_curve, sensitivity
from symhbm.response import follow, frf, recover, resume, solve, transient, verify
from symhbm.results.archive import ArchiveError, load, rebuild, save

if TYPE_CHECKING:
    from symhbm import plot
    from symhbm.ensembles import mistuning, statistics

__version__ = version("symhbm")

__all__ = [
    "ArchiveError",
    "EngineOrder",
    "HarmonicBalance",
    "HarmonicForce",
    "Model",
    "PointForce",
    "SolveError",
    "Status",
    "SwitchingAngles",
    "bladed_disk",
    "condense",
    "follow",
    "frf",
    "load",
    "minimise_peak",
    "mistuning",
    "peak_curve",
    "plot",
    "rebuild",
    "recover",
    "resume",
    "save",
    "sensitivity",
    "single_blade",
    "solve",
    "statistics",
    "transient",
    "verify",
]


_LAZY = {
    "mistuning": "symhbm.ensembles.mistuning",
    "plot": "symhbm.plot",
    "statistics": "symhbm.ensembles.statistics",
}
"""Rooms that need matplotlib or scipy.stats, which are slow to import and not needed to compute."""


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return import_module(_LAZY[name])
    raise AttributeError(f"module 'symhbm' has no attribute {name!r}")
