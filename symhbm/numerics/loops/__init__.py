"""Loops that are compiled at their first call, those over arrays and over one Fourier series."""

from symhbm.numerics.loops import arrays, fourier, series, turning
from symhbm.numerics.loops.loop import Loop

__all__ = ["Loop", "arrays", "fourier", "series", "turning"]
