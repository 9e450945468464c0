"""HDF5: compressed sparse columns of each matrix in a group, and a group of places.

Groups ``mass``, ``damping`` and ``stiffness`` hold ``data`` (n_entries,), ``indices`` (n_entries,)
of rows, ``indptr`` (n_dof + 1,) and ``shape`` (2,), as `scipy.sparse.csc_array` has them. A group
``places`` holds ``node``, ``direction``, ``label`` (n_dof,) and ``coordinates`` (n_dof, 3) [m].
What else there is, damping by a rule, the mesh and what the program told of it, is the attribute
``told`` of the file, as JSON, with the numbers of its arrays in one row, ``numbers``. A structure
that turns has its stiffness at each speed in a group of ``stiffness_at``, and ``coriolis``.
"""

import json
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from symhbm.model.cyclic import RotatingModel
from symhbm.model.files.arrays import places_of_columns
from symhbm.model.files.contents import KINDS, Contents, contents_of, told
from symhbm.model.matrices import Model
from symhbm.model.records import joined, pack, packed, unpack
from symhbm.numerics import check

_TOLD, _NUMBERS = "told", "numbers"
"""The attribute of records, and their row of numbers."""
_AT = "stiffness_at_"
"""Groups of the stiffness at speeds, by their numbers."""
_SUFFIXES = ".h5", ".hdf5", ".nc"
_PARTS = ("data", "indices", "indptr", "shape")


def read(files: dict[str, Path], names: Mapping[str, str]) -> Contents:
    """The groups of one file."""
    from netCDF4 import Dataset  # slow to import

    [path] = files.values()
    with told(path, "HDF5 file"), Dataset(os.fspath(path)) as file:
        held, columns = {}, {}
        for name, group in file.groups.items():
            parts = {
                part: np.ma.filled(variable[:], "" if variable.dtype.kind in "SU" else 0)
                if variable.dtype is not str
                else variable[:]
                for part, variable in group.variables.items()
            }
            if name == "places":
                columns = parts
            elif {*_PARTS} <= {*parts}:
                data, indices, indptr, shape = (parts[part] for part in _PARTS)
                held[name] = sp.csc_array((data, indices, indptr), shape=tuple(shape))
                held[name].check_format()
        beside: dict[str, Any] = {}
        if _TOLD in file.ncattrs():
            numbers = np.asarray(file.variables[_NUMBERS][:])
            beside = unpack(json.loads(file.getncattr(_TOLD)), numbers)
        places = places_of_columns(columns)
        if beside.get("mesh") is not None and places is not None:
            places = replace(places, mesh=beside["mesh"], program=beside["program"])
        turning = {name: held.pop(name) for name in [*held] if name.startswith(_AT)}
        coriolis = held.pop("coriolis", None)
        contents = contents_of(path, held, names, places, beside.get("damping"))
        if not turning:
            return contents
        speeds = [turning[f"{_AT}{k}"] for k in range(len(beside["speeds"]))]
        by_speed = dict(zip(beside["speeds"], speeds, strict=True))
        return contents._replace(rotation=(by_speed, coriolis))


def is_structure(path: str | os.PathLike[str]) -> bool:
    """Whether a file is one of `save_structure`, and no archive of results."""
    from netCDF4 import Dataset  # slow to import

    try:
        with Dataset(os.fspath(path)) as file:
            return _TOLD in file.ncattrs() and "stiffness" in file.groups
    except OSError:
        return False


def save_structure(model: Model, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Write matrices, damping, places and mesh of a model to HDF5, without its contacts.

    `read_structure` reads it, damping by a rule as that rule, a `RotatingModel` with its stiffness
    at all speeds. The path is returned. Raises TypeError for what is no Model, and for Coriolis
    forces at one speed or a rule of your own that no matrix tells, FileExistsError for a file that
    is there unless ``overwrite``.

    Examples
    --------
    >>> import tempfile
    >>> import symhbm as sh
    >>> model = sh.Model([[1]], [[0.5]], [[1e4]], places=dict(node=[7], direction=["x"]))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = sh.save_structure(model, f"{folder}/blade.h5")
    ...     sh.read_structure(path).number_of("7:x")
    0
    """
    from netCDF4 import Dataset  # slow to import

    check.instance("model", model, Model, "a Model")
    turning = isinstance(model, RotatingModel)
    rule = None if model.damping is None else packed(model.damping, [])
    if model.coriolis_matrix is not None or (rule and "lacks" in rule):
        raise TypeError(
            f"model: expected a damping matrix, or a damping rule of the library alone, got "
            f"{model.damping!r}{' beside Coriolis forces' * (model.coriolis_matrix is not None)}; "
            "give Model(mass, model.damping_matrix, stiffness)"
        )
    path = Path(path)
    if path.suffix.lower() not in _SUFFIXES:
        raise ValueError(f"path={str(path)!r}: expected a name ending in {', '.join(_SUFFIXES)}")
    if path.exists() and not check.flag("overwrite", overwrite):
        raise FileExistsError(f"path={str(path)!r}: there is such a file; overwrite=True")
    matrices = {kind: getattr(model, f"{kind}_matrix") for kind in KINDS if kind != "damping"}
    if rule is None:
        matrices["damping"] = model.damping_matrix
    beside: dict[str, Any] = {"damping": model.damping}
    if turning:
        beside["speeds"] = [*model.speeds]
        at = {f"{_AT}{k}": model.at(s).stiffness_matrix for k, s in enumerate(model.speeds)}
        matrices |= at | ({} if model.coriolis is None else {"coriolis": model.coriolis})
    if model.places is not None:
        beside |= {"mesh": model.places.mesh, "program": model.places.program}
    numbers: list[Any] = []
    text = json.dumps(pack(beside, numbers))
    with Dataset(os.fspath(path), "w", format="NETCDF4") as file:
        file.setncattr(_TOLD, text)
        _write(file, "/", _NUMBERS, joined(numbers))
        for kind, matrix in matrices.items():
            for part in _PARTS:
                _write(file, kind, part, np.asarray(getattr(matrix, part)))
        if model.places is not None:
            for column in ("node", "direction", "coordinates", "label"):
                values = getattr(model.places, column)
                if values is not None:
                    _write(file, "places", column, values)
    return path


def _write(file: Any, group: str, name: str, values: np.ndarray) -> None:
    owner, text = file if group == "/" else file.createGroup(group), values.dtype.kind == "U"
    dims = [f"{name}_{axis}" for axis in range(values.ndim)]
    for dim, size in zip(dims, values.shape, strict=True):
        owner.createDimension(dim, size)
    variable = owner.createVariable(name, str if text else values.dtype, dims, zlib=not text)
    variable[:] = values.astype(object) if text else values
