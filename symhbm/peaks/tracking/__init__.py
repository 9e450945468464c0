"""Peaks followed over a parameter, and the highest of them all."""

from symhbm.peaks.tracking.branches import Parameter
from symhbm.peaks.tracking.leading_branches import LeadingBranches, SurveyedValue, Surveyor
from symhbm.peaks.tracking.step import advanced, polished
from symhbm.peaks.tracking.track import retrack
from symhbm.peaks.tracking.upper_envelope import Place, UpperEnvelope

__all__ = [
    "LeadingBranches",
    "Parameter",
    "Place",
    "SurveyedValue",
    "Surveyor",
    "UpperEnvelope",
    "advanced",
    "polished",
    "retrack",
]
