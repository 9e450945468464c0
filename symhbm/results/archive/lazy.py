"""Archives that are read as they are used; numbers that cannot be read raise ArchiveError."""

from pathlib import Path
from typing import Any

import xarray as xr
from xarray.backends import NetCDF4DataStore
from xarray.backends.netCDF4_ import NetCDF4ArrayWrapper
from xarray.core.indexing import LazilyIndexedArray

from symhbm.results.archive.working_files import ArchiveError


def open_lazily(path: Path) -> xr.Dataset:
    """The dataset of a NetCDF file.

    Reading raises ArchiveError where the file was changed after it was opened, or is unreadable.
    """
    return xr.open_dataset(_Archive.open(path))


class _Archive(NetCDF4DataStore):
    """A NetCDF file that may not change after it was opened."""

    def __init__(self, *arguments: Any, **options: Any):
        super().__init__(*arguments, **options)
        self._opened = self._stamp()

    def open_store_variable(self, name: str, var: Any) -> xr.Variable:
        """A variable whose reading checks the file."""
        variable = super().open_store_variable(name, var)
        variable.data = LazilyIndexedArray(_Numbers(name, self))
        return variable

    def _stamp(self) -> tuple[int, ...] | None:
        """Number, size and time of the file, which tell its states apart; None if removed."""
        try:
            status = Path(self._filename).stat()
        except FileNotFoundError:
            return None
        return status.st_ino, status.st_size, status.st_mtime_ns

    def check(self) -> None:
        """Raise ArchiveError if the file was replaced or changed."""
        if self._stamp() not in (self._opened, None):
            raise self.unreadable("it was changed after it was opened; load it again")

    def unreadable(self, why: object) -> ArchiveError:
        """The error of numbers that cannot be read."""
        return ArchiveError(f"path={self._filename!r}: cannot be read ({why})")


class _Numbers(NetCDF4ArrayWrapper):
    __slots__ = ()

    def __getitem__(self, key: Any) -> Any:
        self.datastore.check()
        try:
            return super().__getitem__(key)
        except (OSError, RuntimeError, ValueError) as error:
            raise self.datastore.unreadable(error) from error
