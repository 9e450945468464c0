"""Results between two points of a path: peaks, missed events and intermediate solutions."""

from symhbm.continuation.between.doubts import solved_between
from symhbm.continuation.between.peaks import LocatedPeaks, locate_peaks, unbounded_peak
from symhbm.continuation.between.slopes import TIE, Peak, PeakKind, amplitude_and_slope, leading

__all__ = [
    "TIE",
    "LocatedPeaks",
    "Peak",
    "PeakKind",
    "amplitude_and_slope",
    "leading",
    "locate_peaks",
    "solved_between",
    "unbounded_peak",
]
