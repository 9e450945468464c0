"""Loops that are compiled at their first call, over arrays, one Fourier series, between points."""

from symhbm.numerics.loops import arrays, by_address, fourier, interpolation, polynomials, series
from symhbm.numerics.machine_code import Loop, told_of_compiling

__all__ = [
    "Loop",
    "arrays",
    "by_address",
    "fourier",
    "interpolation",
    "polynomials",
    "series",
    "told_of_compiling",
]
