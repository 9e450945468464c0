"""Maxima followed over a parameter, and their upper envelope.

Amplitudes, frequencies and values of the parameter are compared relatively, tracks measured in
shares of their length. A solved maximum is accurate to some 1e-12.
"""

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
