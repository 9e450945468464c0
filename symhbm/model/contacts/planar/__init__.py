"""Dry friction with two tangential directions."""

from symhbm.model.contacts.planar.law import PlanarFriction
from symhbm.model.contacts.planar.rest import middle_of

__all__ = ["PlanarFriction", "middle_of"]
