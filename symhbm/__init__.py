"""Forced response of bladed disks with dry friction by multi-harmonic balance."""

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from symhbm.archive import ArchiveError, load, rebuild, save
from symhbm.condense import condense
from symhbm.design import minimise_peak
from symhbm.excitation import EngineOrder, HarmonicForce, PointForce
from symhbm.frf import follow, frf
from symhbm.model import Model, bladed_disk, single_blade
from symhbm.peak_curve import peak_curve
from symhbm.recover import recover
from symhbm.residual import HarmonicBalance
from symhbm.runs import resume
from symhbm.sensitivity import sensitivity
from symhbm.solve import solve
from symhbm.status import SolveError, Status
from symhbm.switching_angles import SwitchingAngles
from symhbm.transient import transient
from symhbm.verify import verify

if TYPE_CHECKING:
    from symhbm import mistuning, plot, statistics

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


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    # These need matplotlib or scipy.stats, which are slow to import and not needed to compute.
    if name in ("mistuning", "plot", "statistics"):
        return import_module(f"symhbm.{name}")
    raise AttributeError(f"module 'symhbm' has no attribute {name!r}")
