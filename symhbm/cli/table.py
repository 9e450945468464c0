"""Tables from datasets: one row per point, peak, event or parameter set, a column per number."""

import csv
import math
from collections.abc import Iterator, Sequence
from typing import Any, TextIO

import numpy as np
import xarray as xr

from symhbm.cli.blocks import INNER, blocks, moving, set_dimensions
from symhbm.cli.selection import Selection
from symhbm.results import Description, check_present

TABLES = ("points", "peaks", "events", "sets")
_LETTERS = {"harmonic": "h", "component": ""}
Row = Sequence[Any]


def rows(
    selection: Selection, table: str = "points", variables: Sequence[str] | None = None
) -> Iterator[Row]:
    """Header and rows of a table of a selected part, block by block; a missing number is None.

    ``variables`` are the names of the columns beside the coordinates; by default all that the table
    has but the Fourier coefficients, and ``["all"]`` means these, too.

    Raises
    ------
    KeyError
        For an unknown name.
    ValueError
        Where the archive has no such table, or a variable does not fit it.
    """
    dataset = selection.dataset
    stored = [str(name) for name in dataset.variables]
    for name in variables or ():
        if name != "all":
            check_present(dataset, name, container="archive")
    along = _along(dataset, table)
    names = _variables(dataset, table, along, variables)
    if (selection.low, selection.high) != (-np.inf, np.inf) and table == "sets":
        raise ValueError(f"--table sets: a row is a whole curve, not a part of {moving(dataset)}")
    others = [str(n) for n, c in dataset.coords.items() if set(c.dims) <= set(along)]
    columns = [*dict.fromkeys([*along, *others])]
    names = [name for name in names if name not in columns]
    prefix = {"peaks": "peak_", "events": "event_"}.get(table, "")
    marker = f"{prefix}{moving(dataset)}" if {"point", "peak", "event"} & set(along) else ""
    needed = {*columns, *names, marker, "n_solutions"} & set(stored)
    return _rows(selection, along, [*columns, *names], needed, marker)


def write(lines: Iterator[Row], file: TextIO) -> int:
    """Write a table as comma-separated values and return its number of rows."""
    writer = csv.writer(file, lineterminator="\n")
    number = -1
    for line in lines:
        writer.writerow(line)
        number += 1
    return number


def _rows(
    selection: Selection,
    along: Sequence[str],
    names: Sequence[str],
    needed: set[str],
    marker: str,
) -> Iterator[Row]:
    dataset = selection.dataset
    inner = {name: _inner(dataset, name) for name in names}
    yield [title for name in names for title in _titles(dataset, name, inner[name])]
    whole = dataset[[*needed]]
    width = sum(int(np.prod([whole.sizes[dim] for dim in dims])) for dims in inner.values())
    for block in blocks(whole.sizes, along, width):
        part = whole.isel(block, missing_dims="ignore")
        for dim in along:
            if dim not in part.variables and dim in part.dims:
                part[dim] = (dim, block[dim].start + np.arange(part.sizes[dim]))
        part = selection.limited(part.load())
        shape = tuple(part.sizes.get(dim, 1) for dim in along)
        kept = np.ones(shape, dtype=bool)
        if marker in part.variables:
            kept &= np.isfinite(_spread(part, marker, along, shape, ())[..., 0])
        if "solution" in along and "n_solutions" in part.variables:
            # A value without any solution keeps one row, which tells so.
            most = np.maximum(_spread(part, "n_solutions", along, shape, ())[..., 0], 1)
            solution = np.arange(shape[along.index("solution")])
            places = [-1 if dim == "solution" else 1 for dim in along]
            kept &= solution.reshape(places) < most
        columns = []
        for name in names:
            values = _spread(part, name, along, shape, inner[name])[kept]
            if values.dtype.kind == "f":
                values = np.where(np.isnan(values), np.array(None), values)
            columns += values.T.tolist()
        yield from zip(*columns, strict=True)


def _spread(
    part: xr.Dataset,
    name: str,
    along: Sequence[str],
    shape: tuple[int, ...],
    inner: Sequence[str],
) -> np.ndarray:
    """Values of a variable over all dimensions of the rows, its inner entries along the last."""
    sizes = dict(zip(along, shape, strict=True)) | {dim: part.sizes[dim] for dim in inner}
    values = part[name].variable.set_dims(sizes).transpose(*sizes).values
    return values.reshape(*shape, math.prod(values.shape[len(shape) :]))


def _along(dataset: xr.Dataset, table: str) -> list[str]:
    """The dimensions of the rows."""
    inner_axes = {"peaks": ["peak"], "events": ["event"], "sets": []}
    sets = set_dimensions(dataset)
    if table in inner_axes:
        missing = [dim for dim in inner_axes[table] if dim not in dataset.dims]
        if missing or "status" not in dataset.variables:
            names = Description(dataset).left_out
            left_out = any(name.startswith(f"{inner_axes[table][0]}_") for name in names)
            why = ", they were left out by keep=" if left_out else ""
            raise ValueError(f"--table {table}: the archive has no {table}{why}")
        return [*sets, *inner_axes[table]]
    if "status" in dataset.variables:
        axes = dict.fromkeys(("point", moving(dataset), "angle", "solution"))
        return [*sets, *(axis for axis in axes if axis in dataset.dims and axis not in sets)]
    data = [dataset[name].dims for name in dataset.data_vars]
    outer = [[str(dim) for dim in dims if dim not in INNER] for dims in data]
    return max(outer, key=len, default=[])


def _variables(
    dataset: xr.Dataset, table: str, along: Sequence[str], wanted: Sequence[str] | None
) -> list[str]:
    named = [name for name in wanted or () if name != "all"]
    for name in named:
        if not set(dataset[name].dims) <= {*along, *INNER}:
            raise ValueError(
                f"--variables {name}: it has the dimensions {_listed(dataset[name].dims)}, a row "
                f"of the table {table} is one of {_listed(along)}"
            )
    if wanted is not None and "all" not in wanted:
        return named
    swept, records = Description(dataset).swept, Description(dataset).parameters
    parameters = {*records, *(f"{name}_nominal" for name in records)}
    chosen = []
    for name in map(str, dataset.data_vars):
        outer = {dim for dim in dataset[name].dims if dim not in INNER}
        of_set = table == "sets" and name in swept and outer <= set(along)
        belongs = outer == set(along) and (name not in parameters or name in swept)
        if (belongs or of_set) and (wanted is not None or "harmonic" not in dataset[name].dims):
            chosen.append(name)
    return chosen


def _inner(dataset: xr.Dataset, name: str) -> tuple[str, ...]:
    dims = dataset[name].dims if name in dataset.variables else ()
    return tuple(dim for dim in INNER if dim in dims)


def _titles(dataset: xr.Dataset, name: str, inner: Sequence[str]) -> list[str]:
    """Titles of the columns of a variable, as ``amplitude_3 [m]``."""
    units = dataset[name].attrs.get("units", "1") if name in dataset.variables else "1"
    unit = "" if units in ("1", "") else f" [{units}]"
    titles = [name]
    for dim in inner:
        labels = dataset[dim].values if dim in dataset.variables else range(dataset.sizes[dim])
        letter = "" if len(inner) == 1 else _LETTERS.get(dim, dim)
        titles = [f"{title}_{letter}{label}" for title in titles for label in labels]
    return [title + unit for title in titles]


def _listed(dims: Any) -> str:
    return ", ".join(map(str, dims)) or "none"
