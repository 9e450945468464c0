"""Writing of a NetCDF archive from its working file, in bounded memory, whole or not at all."""

import math
import os
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from symhbm.results import schema, tables
from symhbm.results.archive.netcdf import COMPRESSION, call_of, origin_of, write
from symhbm.results.archive.seal import seal
from symhbm.results.archive.working_files import ArchiveError, Store
from symhbm.results.provenance import SPEEDS, DatasetParts, evaluated_by, speed_orders
from symhbm.results.tables import Layout, block_shape, consecutive_blocks
from symhbm.workers import progress_bar

if TYPE_CHECKING:
    import netCDF4

_SLAB = 2**26
"""Memory [bytes] of the parameter sets written at once: few calls, bounded memory."""
_CHUNK = 2**20
"""Memory [bytes] of a chunk, which is compressed and read as a whole."""


def assemble(store: Store, archive: Path, progress: bool | None, rest: str | None = None) -> None:
    """Write the archive of a working file in which all sets are finished.

    ``rest`` tells after a failure what is safe, by default the working file. Raises ArchiveError if
    it cannot be written, or the working file is damaged.
    """
    # Slow to import, and not needed to compute.
    import netCDF4

    draft, sample = (store.path.with_name(f"{store.path.name}-{name}") for name in ("nc", "sample"))
    try:
        call = call_of(store)
        layout, dataset = _without_numbers(store, call)
        results = [str(name) for name in dataset.variables if name not in call.variables]
        write(dataset.drop_vars(results), draft)
        # xarray chooses types and attributes from the results of one set; all follow in slabs.
        write(dataset.isel(dict.fromkeys(schema.recall(call)[0].dims, slice(1))), sample)
        with netCDF4.Dataset(draft, "a") as target, netCDF4.Dataset(sample) as source:
            _fill(store, layout, dataset, source, target, progress)
            target.setncatts(origin_of(store, call))
        seal(draft)
        os.replace(draft, archive)
    except ArchiveError:
        raise
    except (OSError, RuntimeError, ValueError) as error:
        # NetCDF does not tell a full disk from any other failure.
        free = f", {shutil.disk_usage(draft.parent).free:,} bytes free" if draft.exists() else ""
        raise ArchiveError(
            f"path={str(archive)!r}: cannot be written ({error}{free}); {rest or store.rest}"
        ) from error
    finally:
        for file in (draft, sample):
            file.unlink(missing_ok=True)


def _without_numbers(store: Store, call: xr.Dataset) -> tuple[Layout, xr.Dataset]:
    """The common layout of all sets, and their dataset with padding for results."""
    layout: Layout = {}
    n_harmonics, widest = 0, 0
    for number, text in store.layouts():
        layout = tables.common([layout, tables.stored_layout(text)])
        if layout["harmonics"][1][0] > n_harmonics:
            (n_harmonics,), widest = layout["harmonics"][1], number
    [(_, encoded)] = store.read(widest, widest)
    results = {
        name: np.broadcast_to(tables.blank(dtype, ()), (store.n_sets, *shape))
        for name, (dtype, shape) in layout.items()
    }
    results["harmonics"] = tables.decode(*encoded)["harmonics"][None]
    return layout, schema.label(DatasetParts.of(call), *schema.recall(call), results)


def _fill(
    store: Store,
    layout: Layout,
    dataset: xr.Dataset,
    source: "netCDF4.Dataset",
    target: "netCDF4.Dataset",
    progress: bool | None,
) -> None:
    sweep, request = schema.recall(dataset)
    for file in (source, target):
        file.set_auto_maskandscale(False)
    target.set_fill_off()
    n_sets = max(1, _SLAB // tables.n_bytes(layout))
    keys = {tables.name_of(key, request): key for key in layout}
    of_speeds = {speed: keys.get(speed.replace("speed", "frequency")) for speed in SPEEDS}
    keys |= {speed: key for speed, key in of_speeds.items() if key is not None}
    of_sets = dict(zip(sweep.dims, sweep.shape, strict=True))
    orders = speed_orders(dataset.variables, dataset.attrs).set_dims(of_sets)
    orders = orders.transpose(*sweep.dims).values
    names = [name for name in source.variables if name not in target.variables]
    for name in names:
        dtype, shape = layout[keys[name]]
        size = max(1, dtype.itemsize * math.prod(shape))
        chunk = block_shape(sweep.shape, min(n_sets, max(1, _CHUNK // size))) + shape
        _create(source[name], target, dict(dataset.sizes), chunk)
    # Coordinates that belong to no variable are listed in an attribute of the file.
    for name in {"coordinates"} & {*target.ncattrs()}:
        target.delncattr(name)
    target.setncatts({name: source.getncattr(name) for name in source.ncattrs()})
    with progress_bar("curve", progress, store.n_sets, label="archive") as bar:
        first, by_machine_code = 0, set[int]()
        for slab in consecutive_blocks(sweep.shape, n_sets):
            sizes = tuple(extent.stop - extent.start for extent in slab)
            rows = store.read(first, first + math.prod(sizes) - 1)
            first += len(rows)
            decoded = (tables.decode(*encoded) for _, encoded in rows)
            stacked = tables.stack(decoded, len(rows), layout)
            by_machine_code.update(stacked.get("by_machine_code", np.empty(0)).tolist())
            for name in names:
                values = stacked[keys[name]]
                if name in SPEEDS:
                    of_rows = orders[slab].reshape(-1, *(1,) * (values.ndim - 1))
                    values = 60 / of_rows * values
                if values.size:
                    values = values.reshape(sizes + values.shape[1:])
                    if values.dtype.kind == "b":
                        values = values.astype(np.int8)
                    target[name][(*slab, ...)] = values
            bar.update(len(rows))
    target.setncatts(evaluated_by(by_machine_code))


def _create(
    like: "netCDF4.Variable", target: "netCDF4.Dataset", sizes: dict, chunk: tuple[int, ...]
) -> None:
    """Create a variable with the type and attributes of another, of full size."""
    for dim in like.dimensions:
        if dim not in target.dimensions:
            target.createDimension(dim, sizes[dim])
    attributes = {name: like.getncattr(name) for name in like.ncattrs()}
    packed = COMPRESSION if like.dtype is not str and chunk and all(chunk) else {}
    variable = target.createVariable(
        like.name,
        like.dtype,
        like.dimensions,
        fill_value=attributes.pop("_FillValue", None),
        chunksizes=chunk if packed else None,
        **packed,
    )
    variable.setncatts(attributes)
