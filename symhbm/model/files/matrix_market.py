"""Matrix Market: one matrix per file; a symmetric one is whole once it is read."""

from collections.abc import Mapping
from pathlib import Path

from scipy.io import mmread

from symhbm.model.files.contents import Contents, sparse, told

HEAD = b"%%MatrixMarket"


def read(files: dict[str, Path], names: Mapping[str, str]) -> Contents:
    """The matrices of one file each."""
    matrices = {}
    for kind, path in files.items():
        with told(path, "Matrix Market file"):
            matrices[kind] = sparse(kind, mmread(path, spmatrix=False))
    return Contents(matrices)
