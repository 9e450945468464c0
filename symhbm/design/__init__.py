"""Design: parameters that make the largest response as small as it gets, with a certificate."""

from symhbm.design.minimise import minimise_peak

__all__ = ["minimise_peak"]
