"""What lies between two points of a branch: maxima, and contacts that change for a moment."""

from symhbm.continuation.between.gaps import solved_between, turns_back
from symhbm.continuation.between.overlooked import overlooked
from symhbm.continuation.between.peaks import Peak, PeakKind, locate_peaks, unbounded_peak
from symhbm.continuation.between.slopes import TIE, amplitude_and_slope, leading

__all__ = [
    "TIE",
    "Peak",
    "PeakKind",
    "amplitude_and_slope",
    "leading",
    "locate_peaks",
    "overlooked",
    "solved_between",
    "turns_back",
    "unbounded_peak",
]
