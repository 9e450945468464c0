"""Archives that are read as they are used; numbers that cannot be read raise ArchiveError."""

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from symhbm.results.archive.working_files import ArchiveError


def open_lazily(path: Path) -> xr.Dataset:
    """The dataset of a NetCDF file.

    Reading raises ArchiveError where the file was changed after it was opened, or is unreadable.
    """
    opened = _stamp(path)
    dataset = xr.open_dataset(path, engine="netcdf4", cache=False)
    for name, variable in dataset.variables.items():
        if name not in dataset.indexes:
            numbers = _Numbers(variable.copy(deep=False), path, opened)
            variable.data = indexing.MemoryCachedArray(indexing.LazilyIndexedArray(numbers))
    return dataset


def _stamp(path: Path) -> tuple[int, ...] | None:
    """Number, size and time of a file, which tell its states apart; None if removed."""
    try:
        status = path.stat()
    except FileNotFoundError:
        return None
    return status.st_ino, status.st_size, status.st_mtime_ns


class _Numbers(BackendArray):
    """A variable of a file that may not change after it was opened."""

    def __init__(self, variable: xr.Variable, path: Path, opened: tuple[int, ...] | None):
        self._variable, self._path, self._opened = variable, path, opened
        self.shape, self.dtype = variable.shape, variable.dtype

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        outer = indexing.IndexingSupport.OUTER
        return indexing.explicit_indexing_adapter(key, self.shape, outer, self._read)

    def _read(self, key: tuple[Any, ...]) -> np.ndarray:
        if _stamp(self._path) not in (self._opened, None):
            raise self._unreadable("it was changed after it was opened; load it again")
        try:
            return self._variable[key].values
        except (OSError, RuntimeError, ValueError) as error:
            raise self._unreadable(error) from error

    def _unreadable(self, why: object) -> ArchiveError:
        return ArchiveError(f"path={str(self._path)!r}: cannot be read ({why})")
