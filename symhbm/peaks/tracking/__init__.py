"""Maxima followed over a parameter, and their upper envelope."""

from symhbm.peaks.tracking.branches import Parameter
from symhbm.peaks.tracking.envelope import EnvelopePoint, UpperEnvelope
from symhbm.peaks.tracking.leading_branches import LeadingBranches, SurveyedValue
from symhbm.peaks.tracking.step import advanced, polished, verified
from symhbm.peaks.tracking.track import retrack

__all__ = [
    "EnvelopePoint",
    "LeadingBranches",
    "Parameter",
    "SurveyedValue",
    "UpperEnvelope",
    "advanced",
    "polished",
    "retrack",
    "verified",
]
