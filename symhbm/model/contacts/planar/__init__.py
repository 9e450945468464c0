"""Dry friction in a plane: two tangential directions and one circle of friction."""

from symhbm.model.contacts.planar.law import PlanarFriction

__all__ = ["PlanarFriction"]
