"""Curves as flat tables of arrays: reduced to what is kept, turned into bytes, and stacked."""

import json
import math
from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from symhbm.numerics import Table
from symhbm.results.request import CurveTable, Request

ALWAYS = ("value", "n_solutions", "converged", "contact_model_valid", "residual_norm")
"""What is kept of the points of a curve beside what was asked for."""
_FILL: dict[str, Any] = {"f": np.nan, "i": -1, "b": False, "O": ""}

Encoded = tuple[str, bytes]
"""Layout and numbers of a table, see `encode`."""
Layout = dict[str, tuple[np.dtype, tuple[int, ...]]]
"""Type and shape of each array of a table."""


def name_of(key: str, task: Request) -> str:
    """Name in the dataset of what a branch holds."""
    named = {"value": task.name, "event_value": f"event_{task.name}"}
    return (named | {"peak_value": f"peak_{task.name}"}).get(key, key)


def reduced(branch: CurveTable, task: Request) -> CurveTable:
    """The branch with what the task keeps alone."""
    if task.keep is None:
        return branch
    kept = {
        table: {
            key: array
            for key, array in getattr(branch, table).items()
            if key in ALWAYS or name_of(key, task) in task.keep
        }
        for table in ("points", "peaks", "events")
    }
    return replace(branch, **kept)


def flat(branch: CurveTable) -> Table:
    """All of a branch as one table; texts are objects."""
    counts = {name: np.array(count) for name, count in branch.counts.items()}
    whole = dict(harmonics=np.array(branch.harmonics), status=np.array(branch.status, dtype=object))
    return branch.points | branch.peaks | branch.events | counts | whole


def encode(table: Table) -> Encoded:
    """Layout of a table as JSON, and its arrays one after the other as bytes."""
    plain = {
        name: array.astype(str) if array.dtype.kind == "O" else array
        for name, array in table.items()
    }
    layout = [[name, array.dtype.str, array.shape] for name, array in plain.items()]
    return json.dumps(layout), b"".join(array.tobytes() for array in plain.values())


def decode(layout: str, data: bytes) -> Table:
    """The table of a layout and bytes."""
    table, start = {}, 0
    for name, dtype, shape in _stored(layout):
        array = np.ndarray(shape, dtype, data, start)
        start += array.nbytes
        table[name] = array.astype(object) if dtype.kind == "U" else array
    return table


@lru_cache(maxsize=256)
def _stored(layout: str) -> list[tuple[str, np.dtype, tuple[int, ...]]]:
    return [(name, np.dtype(kind), tuple(shape)) for name, kind, shape in json.loads(layout)]


def stored_layout(layout: str) -> Layout:
    """The layout of a table that was turned into bytes."""
    text = np.dtype(object)
    return {name: (text if kind.kind == "U" else kind, s) for name, kind, s in _stored(layout)}


def common(layouts: Iterable[Layout]) -> Layout:
    """The layout that holds each of some."""
    result: Layout = {}
    for layout in layouts:
        for name, (dtype, shape) in layout.items():
            most = result.get(name, (dtype, shape))[1]
            result[name] = dtype, tuple(map(max, most, shape))
    return result


def n_bytes(layout: Layout) -> int:
    """Memory that a table takes."""
    return sum(dtype.itemsize * math.prod(shape) for dtype, shape in layout.values())


def stack(tables: Iterable[Table], count: int, layout: Layout) -> Table:
    """Stack so many ragged tables, padded at the end with NaN, -1, False or an empty text.

    Coefficients of harmonics that a curve leaves out are 0, or as unknown as the others.
    """
    result = {name: blank(dtype, (count, *shape)) for name, (dtype, shape) in layout.items()}
    for number, table in enumerate(tables):
        for name, stacked in result.items():
            if name not in table:
                continue  # of a version that did not know it
            array = table[name]
            if name.endswith("coefficient"):
                array = _widened(array, stacked.shape[-2])
            stacked[(number, ..., *map(slice, array.shape))] = array
    return result


def blank(dtype: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    """An array of nothing but padding."""
    return np.full(shape, _FILL[dtype.kind], dtype=dtype)


def _widened(array: np.ndarray, n_harmonics: int) -> np.ndarray:
    missing = n_harmonics - array.shape[-2]
    if not missing:
        return array
    nothing = np.where(np.isnan(array[..., :1, :]), np.nan, 0.0)
    return np.concatenate([array, *[nothing] * missing], axis=-2)
