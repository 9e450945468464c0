"""Peaks followed over a parameter, and the highest of them all."""

from symhbm.peaks.tracking.branches import Parameter
from symhbm.peaks.tracking.leading_branches import Ridge, Scene, Surveyor
from symhbm.peaks.tracking.step import advanced, polished
from symhbm.peaks.tracking.track import retrack
from symhbm.peaks.tracking.upper_envelope import Crest, Place

__all__ = [
    "Crest",
    "Parameter",
    "Place",
    "Ridge",
    "Scene",
    "Surveyor",
    "advanced",
    "polished",
    "retrack",
]
