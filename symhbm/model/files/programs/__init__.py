"""Files of finite-element programs, one reader for each; `Contents` is what they give."""

from symhbm.model.files.programs import calculix

__all__ = ["calculix"]
