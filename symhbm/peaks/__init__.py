"""Maxima of the response as solutions of equations: derivatives, surveys and peak curves."""

from symhbm.peaks.conditions import Conditions
from symhbm.peaks.maximum import Maximum, MaximumKind
from symhbm.peaks.peak_curve import peak_curve
from symhbm.peaks.sensitivity import continuous_parameters, sensitivity
from symhbm.peaks.survey import COMPLETE, Survey, sector_of, survey

__all__ = [
    "COMPLETE",
    "Conditions",
    "Maximum",
    "MaximumKind",
    "Survey",
    "continuous_parameters",
    "peak_curve",
    "sector_of",
    "sensitivity",
    "survey",
]
