"""Drawings of structures: masses, what is between them, contacts and forces."""

from symhbm.plot.structure.schematic import model

__all__ = ["model"]
