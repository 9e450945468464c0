"""NetCDF archives, and the working files they are made from."""

from symhbm.results.archive.from_working_file import assemble
from symhbm.results.archive.merging import merge, merged
from symhbm.results.archive.netcdf import (
    ArchiveError,
    bytes_of,
    call_of,
    check_schema,
    check_target,
    draft_of,
    existing,
    load,
    path_of,
    rebuild,
    save,
)
from symhbm.results.archive.working_files import SUFFIX, Store, computed_here, working_file
from symhbm.results.tables import Spool

__all__ = [
    "SUFFIX",
    "ArchiveError",
    "Spool",
    "Store",
    "assemble",
    "bytes_of",
    "call_of",
    "check_schema",
    "check_target",
    "computed_here",
    "draft_of",
    "existing",
    "load",
    "merge",
    "merged",
    "path_of",
    "rebuild",
    "save",
    "working_file",
]
