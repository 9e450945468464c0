"""Disks: natural modes by nodal diameter, and the response of any of their sectors."""

from symhbm.response.disks.natural_modes import natural_modes
from symhbm.response.disks.sector_response import sector_response

__all__ = ["natural_modes", "sector_response"]
