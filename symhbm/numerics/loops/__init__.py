"""Loops that are compiled at their first call, and those over one truncated Fourier series."""

from symhbm.numerics.loops import series
from symhbm.numerics.loops.loop import Loop

__all__ = ["Loop", "series"]
