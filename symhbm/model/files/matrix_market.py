"""Matrix Market: one matrix per file; a symmetric one is whole once it is read.

SciPy's reader takes the beginning of what it does not know for a number, and leaves the rest of a
line out. So every line is looked at before.
"""

import re
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import mmread

from symhbm.model.files.contents import Contents, sparse, told

HEAD = b"%%MatrixMarket"
_NUMBER = rb"-?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_FORTRAN = re.compile(rb"(?<=[\d.])[dD](?=[+-]?\d)|(?<=\d)(\.\d*)(?=[+-]\d{2,3}(?!\S))")
"""Where exponents of Fortran have no ``e``: ``3.0D+08``, and ``3.0+108`` after a decimal point."""
_PLACE = rb"\d+[ \t]+\d+[ \t]+"


def read(files: dict[str, Path], names: Mapping[str, str]) -> Contents:
    """The matrices of one file each."""
    matrices = {}
    for kind, path in files.items():
        with told(path, "Matrix Market file"):
            matrices[kind] = sparse(kind, _matrix(path.read_bytes()))
    return Contents(matrices)


def _matrix(content: bytes) -> Any:
    """The matrix of a file; ValueError for what its lines should not hold."""
    head, _, rest = content.partition(b"\n")
    words = head.decode(errors="replace").lower().split()
    if len(words) != 5 or words[3] not in ("real", "integer", "double"):
        raise ValueError(
            f"line 1: expected 'matrix', 'coordinate' or 'array', 'real' or 'integer', and a "
            f"symmetry, got {' '.join(words[1:])!r}; export real numbers"
        )
    begin = re.search(rb"^(?!%)(?=[^\n]*\S)[^\n]*\n?", rest, re.MULTILINE)
    if begin is None:
        raise ValueError("the file ends before the size of the matrix")
    sizes, entries = rest[: begin.end()], _FORTRAN.sub(rb"\1e", rest[begin.end() :])
    place = _PLACE if words[2] == "coordinate" else b""
    line = rb"[ \t]*" + place + _NUMBER + rb"[ \t]*\r?$"
    other = re.search(rb"^(?!" + line + rb")(?=[^\n]*\S)[^\n]*", entries, re.MULTILINE)
    if other is not None:
        number = 2 + sizes.count(b"\n") + entries[: other.start()].count(b"\n")
        expected = "two places and one number" if place else "one number"
        raise ValueError(
            f"line {number}: expected {expected}, got "
            f"{other.group().decode(errors='replace').strip()!r}"
        )
    if words[4] != "general" and place:
        every: Any = mmread(BytesIO(b" ".join([*head.split()[:4], b"general\n"]) + sizes + entries))
        beyond = np.sign(every.row - every.col)
        if {-1, 1} <= {*beyond.tolist()}:
            raise ValueError(
                f"it is called {words[4]} and has entries on both sides of the diagonal, which "
                "would count twice; write one side, or call it general"
            )
    return mmread(BytesIO(head + b"\n" + sizes + entries), spmatrix=False)
