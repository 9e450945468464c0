"""Figures of disks: natural frequencies over the speed and over nodal diameters."""

from symhbm.plot.disks.campbell import campbell
from symhbm.plot.disks.interference import interference

__all__ = ["campbell", "interference"]
