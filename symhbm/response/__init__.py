"""The public functions on problems: frf, follow, solve, periodic_motion, recover, verify."""

from symhbm.response import datasets
from symhbm.response.disks import campbell, natural_modes
from symhbm.response.frf import follow, frf
from symhbm.response.modes_and_cycles import limit_cycles, nonlinear_modes
from symhbm.response.other_branches import other_branches
from symhbm.response.periodic_motion import periodic_motion
from symhbm.response.run import reported, resume
from symhbm.response.solve import solve, static_states
from symhbm.response.verification import FIGURES, summary, verify

__all__ = [
    "FIGURES",
    "campbell",
    "datasets",
    "follow",
    "frf",
    "limit_cycles",
    "natural_modes",
    "nonlinear_modes",
    "other_branches",
    "periodic_motion",
    "reported",
    "resume",
    "solve",
    "static_states",
    "summary",
    "verify",
]
