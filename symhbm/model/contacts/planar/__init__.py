"""Dry friction with two tangential directions."""

from symhbm.model.contacts.planar.law import PlanarFriction

__all__ = ["PlanarFriction"]
