"""Meshes of finite elements, and what their programs tell of structures."""

from symhbm.model.mesh.elements import Element, element, kinds
from symhbm.model.mesh.mesh import Mesh, Shares
from symhbm.model.mesh.program import Modes, Program

__all__ = ["Element", "Mesh", "Modes", "Program", "Shares", "element", "kinds"]
