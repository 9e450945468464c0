"""NumPy's and MATLAB's files: arrays by name, sparse matrices, and columns of places."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any
from zipfile import is_zipfile

import numpy as np
import scipy.sparse as sp
from scipy.io import loadmat

from symhbm.model.files.contents import Contents, contents_of, sparse, told
from symhbm.model.places import Places

_COLUMNS = ("node", "direction", "coordinates", "label")


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
