"""Kinds of data, a file each: what measurements are of, and how that is solved for."""

from symhbm.design.identification.kinds.curve import Curve, Nearby, Reading, Solved, Work
from symhbm.design.identification.kinds.kinds import curves_of

__all__ = ["Curve", "Nearby", "Reading", "Solved", "Work", "curves_of"]
