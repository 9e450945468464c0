"""NetCDF archives: save, load and rebuild."""

import os
import threading
from pathlib import Path

import numpy as np
import xarray as xr

from symhbm import check
from symhbm.names import TEXTS
from symhbm.provenance import SCHEMA_VERSION, describe_problem
from symhbm.residual import HarmonicBalance


class ArchiveError(OSError, ValueError):
    """An archive that cannot be written, or a file that is no archive of this library."""


def save(dataset: xr.Dataset, path: str | os.PathLike[str]) -> Path:
    """Write a dataset to a NetCDF file, whole or not at all, and return the path.

    An existing file is replaced only once the new one is complete.

    Raises
    ------
    TypeError
        If ``dataset`` is no Dataset.
    ArchiveError
        If the file cannot be written; nothing is left behind. It is an OSError and a ValueError.
    """
    if not isinstance(dataset, xr.Dataset):
        raise TypeError(f"dataset={check.shown(dataset)}: expected an xarray Dataset")
    _check_attributes(dataset)
    target = _path(path)
    encoding = {
        str(name): {"zlib": True, "complevel": 4}
        for name, variable in dataset.variables.items()
        if variable.ndim and variable.dtype.kind in "fi"
    }
    part = target.parent / f".symhbm-{os.getpid()}-{threading.get_ident()}.part"
    try:
        if not target.name or target.is_dir() or not target.parent.is_dir():
            raise OSError("expected a file name in an existing, writable directory")
        try:
            dataset.to_netcdf(part, engine="netcdf4", format="NETCDF4", encoding=encoding)
            os.replace(part, target)
        finally:
            part.unlink(missing_ok=True)
    except (OSError, RuntimeError, ValueError) as error:
        raise ArchiveError(f"path={str(target)!r}: cannot be written ({error})") from error
    return target


def load(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read an archive into memory.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ArchiveError
        If the file is damaged, is no NetCDF file, or was not written by this library. It is an
        OSError and a ValueError.
    """
    source = _path(path)
    if not source.exists():
        raise FileNotFoundError(f"path={str(source)!r}: no such file")
    try:
        dataset = xr.load_dataset(source, engine="netcdf4")
    except (OSError, RuntimeError, ValueError, KeyError, AttributeError, IndexError) as error:
        raise ArchiveError(f"path={str(source)!r}: damaged, or no NetCDF file ({error})") from error
    check_schema(dataset, f"path={str(source)!r}")
    for name, variable in dataset.variables.items():
        if variable.dtype.kind in "US" or (name in TEXTS and variable.dtype != object):
            dataset[name] = variable.astype(object)
    for variable in dataset.variables.values():
        variable.encoding = {}
    dataset.encoding = {}
    return dataset


def rebuild(dataset: xr.Dataset) -> HarmonicBalance:
    """Rebuild the problem that a dataset of this library was computed from.

    Swept parameters have their nominal values; select one set first to get its values, as in
    ``rebuild(dataset.sel(normal_load=3))``.

    Raises
    ------
    TypeError
        If ``dataset`` is no Dataset.
    ArchiveError
        If it does not describe a problem.
    """
    if not isinstance(dataset, xr.Dataset):
        raise TypeError(f"dataset={check.shown(dataset)}: expected an xarray Dataset")
    check_schema(dataset, "dataset")
    try:
        return describe_problem(dataset)
    except (KeyError, AttributeError, TypeError, ValueError) as error:
        raise ArchiveError(
            f"dataset: the description of the problem is damaged ({error})"
        ) from error


def check_schema(dataset: xr.Dataset, what: str) -> None:
    """Raise ArchiveError unless ``dataset`` follows a schema this version can read."""
    number = dataset.attrs.get("symhbm_schema")
    if number is None:
        raise ArchiveError(
            f"{what}: not written by symhbm (the attribute symhbm_schema is missing)"
        )
    if not isinstance(number, (int, np.integer)) or not 1 <= number <= SCHEMA_VERSION:
        raise ArchiveError(
            f"{what}: symhbm_schema={number!r}, this version reads 1 to {SCHEMA_VERSION}"
        )


def _path(path: object) -> Path:
    try:
        return Path(path)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"path={check.shown(path)}: expected text or a path") from None


def _check_attributes(dataset: xr.Dataset) -> None:
    """Raise TypeError for attributes that NetCDF cannot hold as they are."""
    owners = {"dataset": dataset, **{f"dataset[{n!r}]": v for n, v in dataset.variables.items()}}
    for owner, holder in owners.items():
        for name, value in holder.attrs.items():
            simple = isinstance(value, (str, int, float, np.generic, np.ndarray))
            if not simple or np.asarray(value).dtype.kind not in "iufU":
                raise TypeError(
                    f"{owner}.attrs[{name!r}]={check.shown(value)}: expected text or real numbers"
                )
