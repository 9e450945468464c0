"""Structures from the files of finite-element programs, one file here per format."""

from symhbm.model.files.hdf5 import save_structure
from symhbm.model.files.read import read_structure

__all__ = ["read_structure", "save_structure"]
