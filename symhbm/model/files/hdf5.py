"""HDF5: compressed sparse columns of each matrix in a group, and a group of places.

Groups ``mass``, ``damping`` and ``stiffness`` hold ``data`` (n_entries,), ``indices`` (n_entries,)
of rows, ``indptr`` (n_dof + 1,) and ``shape`` (2,), as `scipy.sparse.csc_array` has them. A group
``places`` holds ``node``, ``direction``, ``label`` (n_dof,) and ``coordinates`` (n_dof, 3) [m].
Damping by a rule is the attribute ``damping`` of the file, as JSON, in the place of the group.
"""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from symhbm.model.files.arrays import places_of_columns
from symhbm.model.files.contents import KINDS, Contents, contents_of, told
from symhbm.model.matrices import Model
from symhbm.model.records import joined, packed, unpack
from symhbm.numerics import check

_RULE = "damping"
"""The attribute that tells a rule of damping."""
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
        rule = json.loads(file.getncattr(_RULE)) if _RULE in file.ncattrs() else None
        damping = None if rule is None else unpack(rule, joined([]))
        return contents_of(path, held, names, places_of_columns(columns), damping)


def save_structure(model: Model, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Write matrices, damping and places of a model to HDF5, without its contacts; return the path.

    `read_structure` reads it, damping by a rule as that rule. Raises TypeError for what is no
    Model, for one whose matrices change with the speed, and for Coriolis forces or a rule of your
    own that no matrix tells, FileExistsError for a file that is there unless ``overwrite``.

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

    if not isinstance(model, Model):
        raise TypeError(f"model={check.shown(model)}: expected a Model")
    if getattr(model, "speeds", None) is not None:
        raise TypeError(
            "model: expected matrices that do not change with the speed of rotation; save those of "
            "RotatingModel.at(speed), one file for each speed"
        )
    parts: list[Any] = []
    rule = None if model.damping is None else packed(model.damping, parts)
    if model.coriolis_matrix is not None or (rule and "lacks" in rule) or parts:
        raise TypeError(
            f"model: expected a damping matrix, or a damping rule of the library alone, got "
            f"{model.damping!r}{' beside Coriolis forces' * (model.coriolis_matrix is not None)}; "
            "give Model(mass, model.damping_matrix, stiffness)"
        )
    path = Path(path)
    if path.suffix.lower() not in (".h5", ".hdf5"):
        raise ValueError(f"path={str(path)!r}: expected a name ending in .h5 or .hdf5")
    if path.exists() and not check.flag("overwrite", overwrite):
        raise FileExistsError(f"path={str(path)!r}: there is such a file; overwrite=True")
    with Dataset(os.fspath(path), "w", format="NETCDF4") as file:
        if rule is not None:
            file.setncattr(_RULE, json.dumps(rule))
        for kind in KINDS:
            if kind == "damping" and rule is not None:
                continue
            matrix = getattr(model, f"{kind}_matrix")
            for part in _PARTS:
                _write(file, kind, part, np.asarray(getattr(matrix, part)))
        if model.places is not None:
            for column in ("node", "direction", "coordinates", "label"):
                values = getattr(model.places, column)
                if values is not None:
                    _write(file, "places", column, values)
    return path


def _write(file: Any, group: str, name: str, values: np.ndarray) -> None:
    owner, text = file.createGroup(group), values.dtype.kind == "U"
    dims = [f"{name}_{axis}" for axis in range(values.ndim)]
    for dim, size in zip(dims, values.shape, strict=True):
        owner.createDimension(dim, size)
    variable = owner.createVariable(name, str if text else values.dtype, dims, zlib=not text)
    variable[:] = values.astype(object) if text else values
