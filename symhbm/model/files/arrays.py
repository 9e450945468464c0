"""NumPy's and MATLAB's files: arrays by name, sparse matrices, and columns of places.

Matrix Market has one matrix per file; a symmetric one is whole once it is read. SciPy's reader
takes the beginning of what it does not know for a number, and leaves the rest of a line out. So
every line is looked at before.
"""

import re
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import is_zipfile

import numpy as np
import scipy.sparse as sp
from scipy.io import loadmat, mmread

from symhbm.model.files.contents import Contents, contents_of, sparse, told
from symhbm.model.places import Places

_COLUMNS = ("node", "direction", "coordinates", "label")
MATRIX_MARKET = b"%%MatrixMarket"
_NUMBER = rb"-?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_FORTRAN = re.compile(rb"(?<=[\d.])[dD](?=[+-]?\d)|(?<=\d)(\.\d*)(?=[+-]\d{2,3}(?!\S))")
"""Where exponents of Fortran have no ``e``: ``3.0D+08``, and ``3.0+108`` after a decimal point."""
_PLACE = rb"\d+[ \t]+\d+[ \t]+"


def read_npz(files: dict[str, Path], names: Mapping[str, str]) -> Contents:
    """Matrices as `scipy.sparse.save_npz` writes them, one per file, or arrays of one file."""
    matrices: dict[str, Any] = {}
    for kind, path in files.items():
        with told(path, "file of numpy.savez or scipy.sparse.save_npz"):
            _check_zip(path)
            if kind:
                matrices[kind] = sparse(kind, sp.load_npz(path))
                continue
            with np.load(path) as archive:
                held = {name: archive[name] for name in archive.files}
        if not kind:
            return _contents(path, held, names)
    return Contents(matrices)


def is_one_matrix(path: Path) -> bool:
    """Whether a file of NumPy holds one sparse matrix."""
    with told(path, "file of numpy.savez or scipy.sparse.save_npz"):
        _check_zip(path)
        with np.load(path) as archive:
            return {"format", "shape", "data"} <= {*archive.files}


def _check_zip(path: Path) -> None:
    """Raise ValueError for a file that NumPy would leave open."""
    if not is_zipfile(path):
        raise ValueError("no whole archive")


def read_mat(files: dict[str, Path], names: Mapping[str, str]) -> Contents:
    """Variables of a MATLAB file up to version 7."""
    [path] = files.values()
    try:
        with told(path, "MATLAB file"):
            held = loadmat(path, spmatrix=False)
    except ValueError as error:
        if isinstance(error.__cause__, NotImplementedError):
            raise ValueError(
                f"path={str(path)!r}: of MATLAB 7.3, which is not read; save it in MATLAB by "
                "save('name.mat', 'M', 'C', 'K', '-v7')"
            ) from None
        raise
    held = {name: value for name, value in held.items() if not name.startswith("__")}
    return _contents(path, held, names)


def _contents(path: Path, held: dict[str, Any], names: Mapping[str, str]) -> Contents:
    columns = {name: held.pop(name) for name in _COLUMNS if name in held}
    return contents_of(path, held, names, places_of_columns(columns))


def places_of_columns(columns: Mapping[str, Any]) -> Places | None:
    """Places of arrays by name, whose texts may be padded or one in each cell; None without."""
    if not {"node", "direction"} <= {*columns}:
        return None
    texts = {
        name: np.array([_text(cell) for cell in np.ravel(columns[name])])
        for name in ("direction", "label")
        if name in columns
    }
    node, coordinates = np.ravel(columns["node"]), columns.get("coordinates")
    return Places(node=node, coordinates=coordinates, **texts)


def _text(cell: Any) -> str:
    if isinstance(cell, bytes):
        return cell.decode()
    return str(cell if isinstance(cell, str) else "".join(np.ravel(cell).tolist())).strip()


def read_matrix_market(files: dict[str, Path], names: Mapping[str, str]) -> Contents:
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
