"""Archives whose numbers are read as they are used: what cannot be read is an ArchiveError."""

from pathlib import Path
from typing import Any

import xarray as xr
from xarray.backends import NetCDF4DataStore
from xarray.backends.netCDF4_ import NetCDF4ArrayWrapper
from xarray.core.indexing import LazilyIndexedArray

from symhbm.results.archive.working_files import ArchiveError


def open_lazily(path: Path) -> xr.Dataset:
    """The dataset of a NetCDF file.

    Reading raises ArchiveError where the file was changed since now, or cannot be read.
    """
    return xr.open_dataset(_Archive.open(path))


class _Archive(NetCDF4DataStore):
    """A NetCDF file that stays as it was when it was opened."""

    def __init__(self, *given: Any, **options: Any):
        super().__init__(*given, **options)
        self._state = self._now()

    def open_store_variable(self, name: str, var: Any) -> xr.Variable:
        """A variable that is read with care."""
        variable = super().open_store_variable(name, var)
        variable.data = LazilyIndexedArray(_Numbers(name, self))
        return variable

    def _now(self) -> tuple[int, ...] | None:
        """What tells one state of the file from another; None where it was removed."""
        try:
            about = Path(self._filename).stat()
        except FileNotFoundError:
            return None
        return about.st_ino, about.st_size, about.st_mtime_ns

    def check(self) -> None:
        """Raise ArchiveError if there is another file, or another content."""
        if self._now() not in (self._state, None):
            raise self.unreadable("it was changed after it was opened; load it again")

    def unreadable(self, why: object) -> ArchiveError:
        """What to raise where numbers cannot be had."""
        return ArchiveError(f"path={self._filename!r}: cannot be read ({why})")


class _Numbers(NetCDF4ArrayWrapper):
    __slots__ = ()

    def __getitem__(self, key: Any) -> Any:
        self.datastore.check()
        try:
            return super().__getitem__(key)
        except (OSError, RuntimeError, ValueError) as error:
            raise self.datastore.unreadable(error) from error
