"""Meshes of finite elements, and what their programs tell of structures."""

from symhbm.model.mesh.elements import element, kinds
from symhbm.model.mesh.mesh import Mesh, Shares, Weights
from symhbm.model.mesh.program import Modes, Program
from symhbm.model.mesh.stress import elastic_of, stress_rows

__all__ = [
    "Mesh",
    "Modes",
    "Program",
    "Shares",
    "Weights",
    "elastic_of",
    "element",
    "kinds",
    "stress_rows",
]
