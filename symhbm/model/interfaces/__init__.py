"""Interfaces of two sets of nodes: pairs, normals and areas of contacts."""

from symhbm.model.interfaces.pairs import contact_pairs

__all__ = ["contact_pairs"]
