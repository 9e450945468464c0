"""Design: parameters that make the largest response as small as it gets, or damp it most."""

from symhbm.design.flutter import flutter_limit, maximise_damping, maximise_flutter_limit
from symhbm.design.minimise import minimise_peak

__all__ = ["flutter_limit", "maximise_damping", "maximise_flutter_limit", "minimise_peak"]
