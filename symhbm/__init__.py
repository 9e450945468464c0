"""Forced response of bladed disks with dry friction by multi-harmonic balance."""

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from symhbm.archive import ArchiveError, load, rebuild, save
from symhbm.excitation import EngineOrder, HarmonicForce, PointForce
from symhbm.frf import follow, frf
from symhbm.model import Model, bladed_disk, single_blade
from symhbm.residual import HarmonicBalance
from symhbm.resume import resume
from symhbm.solve import solve
from symhbm.status import SolveError, Status
from symhbm.switching_angles import SwitchingAngles
from symhbm.transient import transient
from symhbm.verify import verify

if TYPE_CHECKING:
    from symhbm import plot

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
    "follow",
    "frf",
    "load",
    "plot",
    "rebuild",
    "resume",
    "save",
    "single_blade",
    "solve",
    "transient",
    "verify",
]


def __getattr__(name: str) -> Any:
    # Drawing needs matplotlib, which is slow to import and not needed to compute.
    if name == "plot":
        return import_module("symhbm.plot")
    raise AttributeError(f"module 'symhbm' has no attribute {name!r}")
