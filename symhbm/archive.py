"""NetCDF archives: save, load and rebuild."""

import json
import os
from pathlib import Path

import numpy as np
import xarray as xr

from symhbm import check
from symhbm.residual import HarmonicBalance
from symhbm.schema import SCHEMA_VERSION, describe_problem


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
    target = Path(path)
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    encoding = {
        str(name): {"zlib": True, "complevel": 4}
        for name, variable in dataset.variables.items()
        if variable.ndim and variable.dtype.kind in "fi"
    }
    if target.is_dir() or not target.parent.is_dir():
        raise ArchiveError(
            f"path={str(target)!r}: expected a file name in an existing, writable directory"
        )
    try:
        _plain(dataset).to_netcdf(part, engine="netcdf4", format="NETCDF4", encoding=encoding)
        os.replace(part, target)
    except OSError as error:
        raise ArchiveError(f"path={str(target)!r}: cannot be written ({error})") from error
    finally:
        part.unlink(missing_ok=True)
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
    source = Path(path)
    if not source.exists():
        raise FileNotFoundError(f"path={str(source)!r}: no such file")
    try:
        dataset = xr.load_dataset(source, engine="netcdf4")
    except (OSError, RuntimeError, ValueError, KeyError, AttributeError, IndexError) as error:
        raise ArchiveError(f"path={str(source)!r}: damaged, or no NetCDF file ({error})") from error
    check_schema(dataset, f"path={str(source)!r}")
    for name, variable in dataset.variables.items():
        if variable.dtype.kind in "US":
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
    except (KeyError, AttributeError, json.JSONDecodeError) as error:
        raise ArchiveError(f"dataset: the description of the problem lacks {error}") from error


def check_schema(dataset: xr.Dataset, what: str) -> None:
    """Raise ArchiveError unless ``dataset`` follows a schema this version can read."""
    number = dataset.attrs.get("symhbm_schema")
    if number is None:
        raise ArchiveError(
            f"{what}: not written by symhbm (the attribute symhbm_schema is missing)"
        )
    if int(number) > SCHEMA_VERSION:
        raise ArchiveError(
            f"{what}: schema {number} is newer than {SCHEMA_VERSION}, the newest this version reads"
        )


def _plain(dataset: xr.Dataset) -> xr.Dataset:
    """A copy whose attributes are only those that NetCDF can hold, as it gives them back."""
    for name, value in dataset.attrs.items():
        if isinstance(value, bool) or not isinstance(
            value, (str, int, float, np.generic, np.ndarray)
        ):
            raise TypeError(
                f"dataset.attrs[{name!r}]={check.shown(value)}: expected text or a number"
            )
    return dataset
