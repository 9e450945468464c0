"""Design: parameters that make peaks, or aims made of them, small, or damp a mode most."""

from symhbm.design.flutter import flutter_limit, maximise_damping, maximise_flutter_limit
from symhbm.design.identification import identify
from symhbm.design.minimise import minimise_peak
from symhbm.design.pareto import pareto_front

__all__ = [
    "flutter_limit",
    "identify",
    "maximise_damping",
    "maximise_flutter_limit",
    "minimise_peak",
    "pareto_front",
]
