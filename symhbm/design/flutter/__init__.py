"""Parameters that damp vibrations most, and hold those that drive themselves."""

from symhbm.design.flutter.damping import maximise_damping
from symhbm.design.flutter.verbs import flutter_limit, maximise_flutter_limit

__all__ = ["flutter_limit", "maximise_damping", "maximise_flutter_limit"]
