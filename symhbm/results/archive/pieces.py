"""One part of a sweep as it is merged: what it belongs to, and its finished parameter sets."""

import json
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from symhbm.numerics import Table
from symhbm.results import parts, schema, tables
from symhbm.results.archive.netcdf import call_of, existing, load
from symhbm.results.archive.working_files import SUFFIX, ArchiveError, Store, working_file
from symhbm.results.provenance import states_of
from symhbm.results.tables import Encoded, consecutive_blocks

_SLAB = 2**26
"""Memory [bytes] of the parameter sets read at once."""

Rows = Iterator[list[tuple[int, Encoded]]]


@dataclass(frozen=True)
class Piece:
    """One part: the description of the ``whole`` sweep, and what is finished of it.

    ``rows`` gives tables by the number of their set in the whole; ``blank`` is that of a set that
    is not computed; ``origin`` tells who computed it.
    """

    whole: xr.Dataset
    blank: Encoded
    origin: dict[str, Any]
    rows: Callable[[], Rows]


@contextmanager
def opened(path: Path, unfinished: bool) -> Iterator[Piece | None]:
    """A part, finished or, where those are wanted, ``unfinished``; None if nothing was begun.

    Raises FileNotFoundError, and ArchiveError for a file that is damaged or is no part.
    """
    source = existing(path)
    working = source if source.name.endswith(SUFFIX) else working_file(source)
    if source.exists() and source != working:
        with load(source, lazy=True) as dataset:
            yield _finished(source, dataset)
        return
    if not working.exists():
        raise FileNotFoundError(f"path={str(source)!r}: no such file")
    with Store(working, write=False) as store:
        if not unfinished:
            archive = str(working).removesuffix(SUFFIX)
            raise ArchiveError(
                f"path={archive!r}: unfinished, {len(store.done)} of its {store.n_sets} parameter "
                f"sets are computed; symhbm.resume({archive!r}) computes the others, unfinished="
                "True takes those that there are"
            )
        yield None if store.call is None else _unfinished(store)


def _finished(path: Path, dataset: xr.Dataset) -> Piece:
    try:
        part = parts.part_of(dataset)
        if part is None:
            raise ValueError("no part of a sweep; expected what was computed with part=")
        whole = parts.whole_call(dataset)
        sweep, request = schema.recall(whole)
        own = parts.restricted(sweep, part)
        if dataset["status"].shape != own.shape:
            raise ValueError(
                f"it has {dataset['status'].shape} of the {own.shape} sets of its part"
            )
        blank = parts.blank_of(dataset)
        keys = tables.stored_layout(blank[0])
    except (ValueError, KeyError, TypeError, AttributeError, AssertionError) as error:
        raise ArchiveError(f"path={str(path)!r}: {error}") from error
    missing = {key: tables.name_of(key, request) for key in keys}
    missing = [n for n in missing.values() if n not in dataset and n not in tables.NO_VARIABLES]
    if missing:
        raise ArchiveError(f"path={str(path)!r}: without {', '.join(missing)}")

    def rows() -> Rows:
        numbers = part.numbers(sweep).reshape(own.shape)
        states = states_of(dataset) or [-1]
        done = 0
        for block in consecutive_blocks(own.shape, _most(dataset, own.size)):
            curves = _tables(dataset, block, len(own.shape), tables.decode(*blank), request)
            finished = []
            for number, curve in zip(numbers[block].ravel().tolist(), curves, strict=True):
                # Which of them machine code evaluated is not stored, only whether some were.
                state = states[min(done, len(states) - 1)]
                curve["by_machine_code"] = np.full_like(curve["by_machine_code"], state)
                finished.append((number, tables.encode(curve)))
                done += 1
            yield finished

    return Piece(whole, blank, _origin(path, whole, dataset.attrs), rows)


def _origin(path: Path, whole: xr.Dataset, attributes: dict[str, Any]) -> dict[str, Any]:
    versions = {name: whole.attrs[name] for name in ("symhbm_version", "casadi_version")}
    computed = json.loads(attributes.get(parts.COMPUTED, "[]"))
    return {"archive": path.name} | versions | {"computed": computed}


def _most(dataset: xr.Dataset, n_sets: int) -> int:
    """Number of parameter sets that are read at once."""
    results = [value for value in dataset.variables.values() if value.dtype.kind in "fib"]
    n_bytes = sum(value.dtype.itemsize * value.size for value in results)
    return max(1, _SLAB * n_sets // max(n_bytes, 1))


def _tables(
    dataset: xr.Dataset, block: tuple[slice, ...], n_dims: int, blank: Table, request: Any
) -> Iterator[Table]:
    """Tables of the parameter sets of a block, one after the other."""
    columns = {}
    for key, array in blank.items():
        name = tables.name_of(key, request)
        if name in dataset.variables and (key != "value" or request.at is None):
            values = dataset.variables[name][block].values
            n_sets = math.prod(values.shape[:n_dims])
            columns[key] = values.reshape(n_sets, *values.shape[n_dims:]).astype(array.dtype)
    harmonics = dataset["harmonic"].values.astype(blank["harmonics"].dtype)
    for row in range(len(columns["status"])):
        own = {key: np.asarray(values[row], values.dtype) for key, values in columns.items()}
        # In the order of the blank one: layouts of all sets are alike.
        yield blank | own | {"harmonics": harmonics}


def _unfinished(store: Store) -> Piece:
    call = call_of(store)
    part = parts.part_of(call)
    whole = call if part is None else parts.whole_call(call)
    n_whole = schema.recall(whole)[0].size
    numbers = np.arange(n_whole) if part is None else part.numbers(schema.recall(whole)[0])
    [(_, blank)] = store.read(-1, -1)
    origin = _origin(store.path, whole, {}) | {"computed": store.sessions}
    if store.sources:
        origin[parts.MERGED] = store.sources

    def rows() -> Rows:
        for found in store.blocks():
            yield [(int(numbers[own]), encoded) for own, encoded in found]

    return Piece(whole, blank, origin, rows)
