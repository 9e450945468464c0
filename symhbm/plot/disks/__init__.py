"""Pictures of disks: shapes, natural frequencies over the speed and over nodal diameters."""

from symhbm.plot.disks.campbell import campbell, interference
from symhbm.plot.disks.shapes import disk

__all__ = ["campbell", "disk", "interference"]
