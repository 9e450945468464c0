"""Structures from the files of finite-element programs, one file here per format."""

from symhbm.model.files.hdf5 import is_structure, save_structure
from symhbm.model.files.read import read_structure
from symhbm.model.files.table import read_columns

__all__ = ["is_structure", "read_columns", "read_structure", "save_structure"]
