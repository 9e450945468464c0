"""Events between the solutions of a curve, located once the curve is there."""

from symhbm.response.events.between import events_between

__all__ = ["events_between"]
