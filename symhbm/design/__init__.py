"""Design: parameters that make peaks, and aims made of them, as small as they get."""

from symhbm.design.minimise import minimise_peak
from symhbm.design.pareto import pareto_front

__all__ = ["minimise_peak", "pareto_front"]
