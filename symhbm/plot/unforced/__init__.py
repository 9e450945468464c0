"""Pictures of motions that no force drives."""

from symhbm.plot.unforced.cycles import limit_cycles
from symhbm.plot.unforced.flutter import flutter_limit
from symhbm.plot.unforced.modes import nonlinear_modes

__all__ = ["flutter_limit", "limit_cycles", "nonlinear_modes"]
