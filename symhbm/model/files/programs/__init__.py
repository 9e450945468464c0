"""Files of finite-element programs, one reader for each; `Contents` is what they give."""

from symhbm.model.files.programs import abaqus, ansys, calculix, gmsh, nastran

__all__ = ["abaqus", "ansys", "calculix", "gmsh", "nastran"]
