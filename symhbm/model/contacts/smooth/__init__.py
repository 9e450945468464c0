"""A contact law of the user: any expression of displacements, velocities and parameters."""

from symhbm.model.contacts.smooth.given import SmoothLaw
from symhbm.model.contacts.smooth.law import SmoothForce

__all__ = ["SmoothForce", "SmoothLaw"]
