"""Peaks as solutions of equations: derivatives, surveys, curves of the largest peak."""

from symhbm.peaks.conditions import Conditions
from symhbm.peaks.maximum import Summit, SummitKind
from symhbm.peaks.peak_curve import peak_curve
from symhbm.peaks.sensitivity import sensitivity
from symhbm.peaks.survey import COMPLETE, Landscape, sector_of, survey

__all__ = [
    "COMPLETE",
    "Conditions",
    "Landscape",
    "Summit",
    "SummitKind",
    "peak_curve",
    "sector_of",
    "sensitivity",
    "survey",
]
