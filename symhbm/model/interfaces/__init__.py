"""Interfaces of two sets of nodes: pairs, normals and areas of contacts."""

from symhbm.model.interfaces.pairs import ContactPairs, contact_pairs

__all__ = ["ContactPairs", "contact_pairs"]
