"""Tables of response curves: reduced to the names kept, encoded, stacked, and spooled where many.

A table holds the arrays of a curve by the names of the dataset. Those of points, peaks and events
have the point, peak or event as their first axis; points on a grid where the curve may fold have
the solution as the second. ``value`` is the moving parameter, ``harmonics`` are those of the
coefficients; counts and the status are single numbers and a text. ``by_machine_code`` is 1 for a
curve that machine code evaluated, 0 for others, and -1 for one that was not computed. Blocks of the
sets of a sweep are consecutive in memory. Many encoded tables are in memory while they are small,
then in a temporary file.
"""

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from itertools import product
from tempfile import SpooledTemporaryFile
from typing import Any

import numpy as np

from symhbm.numerics import Table
from symhbm.results.request import Request

_VALIDITY = ("value", "n_solutions", "converged", "contact_model_valid", "residual_norm")
"""Variables that tell which points are valid."""
_MOVING = ("value", "event_value", "peak_value", "branch_value", "fold_value")
"""Arrays that hold the moving parameter."""
_FILL: dict[str, Any] = {"f": np.nan, "i": -1, "b": False, "O": ""}

NO_VARIABLES = ("harmonics", "by_machine_code")
"""Arrays that become coordinates and attributes of the dataset, not variables."""

Encoded = tuple[str, bytes]
"""Layout and bytes of a table, see `encode`."""
Layout = dict[str, tuple[np.dtype, tuple[int, ...]]]
"""Type and shape of each array of a table."""


def name_of(key: str, request: Request) -> str:
    """Name in the dataset of an array of a curve table."""
    return key.removesuffix("value") + request.name if key in _MOVING else key


def reduced(curve: Table, request: Request) -> Table:
    """The curve with what the request keeps, its single numbers, and what tells valid points."""
    if request.keep is None:
        return curve
    kept = {*request.keep, *_VALIDITY, *NO_VARIABLES}
    return {
        key: array
        for key, array in curve.items()
        if not array.ndim or key in kept or name_of(key, request) in kept
    }


def failed(blank: Table, status: str) -> Table:
    """A ``blank`` curve with a status that tells why nothing was computed."""
    return blank | {"status": np.array(status, dtype=object)}


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
    """The layout of an encoded table."""
    text = np.dtype(object)
    return {name: (text if kind.kind == "U" else kind, s) for name, kind, s in _stored(layout)}


def common(layouts: Iterable[Layout]) -> Layout:
    """The smallest layout that holds tables of all of these layouts."""
    result: Layout = {}
    for layout in layouts:
        for name, (dtype, shape) in layout.items():
            largest = result.get(name, (dtype, shape))[1]
            result[name] = dtype, tuple(map(max, largest, shape))
    return result


def n_bytes(layout: Layout) -> int:
    """Memory that a table takes [bytes]."""
    return sum(dtype.itemsize * math.prod(shape) for dtype, shape in layout.values())


def stack(tables: Iterable[Table], count: int, layout: Layout) -> Table:
    """Stack ``count`` ragged tables, padded at the end with NaN, -1, False or an empty text."""
    result = {name: blank(dtype, (count, *shape)) for name, (dtype, shape) in layout.items()}
    for number, table in enumerate(tables):
        for name, stacked in result.items():
            array = table[name]
            if name.endswith("coefficient"):
                array = widened(array, stacked.shape[-2])
            stacked[(number, ..., *map(slice, array.shape))] = array
    return result


def blank(dtype: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    """An array of padding alone."""
    return np.full(shape, _FILL[dtype.kind], dtype=dtype)


def widened(array: np.ndarray, n_harmonics: int) -> np.ndarray:
    """Coefficients (..., n_harmonics, 2), with 0 for harmonics left out, NaN where others are."""
    n_missing = n_harmonics - array.shape[-2]
    if not n_missing:
        return array
    absent = np.where(np.isnan(array[..., :1, :]), np.nan, 0.0)
    return np.concatenate([array, *[absent] * n_missing], axis=-2)


def block_shape(shape: Sequence[int], most: int) -> tuple[int, ...]:
    """Sizes of blocks of at most ``most`` entries that are consecutive in memory.

    Powers of two, so that larger blocks are made of whole smaller ones.
    """
    sizes: list[int] = []
    for size in reversed(shape):
        step = size if size <= most else 2 ** (most.bit_length() - 1)
        sizes.insert(0, max(step, 1))
        most = most // step if step == size > 0 else 1
    return tuple(sizes)


def consecutive_blocks(shape: Sequence[int], most: int) -> Iterator[tuple[slice, ...]]:
    """The blocks of at most ``most`` entries, one after the other."""
    block = block_shape(shape, most)
    for corner in product(*map(range, [0] * len(shape), shape, block)):
        ends = zip(corner, block, shape, strict=True)
        yield tuple(slice(start, min(start + step, size)) for start, step, size in ends)


_MEMORY = 2**26
"""Bytes held in memory; more goes to disk."""


class Spool:
    """Tables by number of their parameter set."""

    def __init__(self):
        self._file = SpooledTemporaryFile(_MEMORY)  # noqa: SIM115 (closed with the object)
        self._offsets: dict[int, tuple[str, int, int]] = {}
        self._layouts: dict[str, str] = {}

    def add(self, encoded: Iterable[tuple[int, Encoded]]) -> None:
        """Keep tables by the number of their parameter set."""
        for number, (layout, data) in encoded:
            # Many tables share a layout, which is kept once.
            shared = self._layouts.setdefault(layout, layout)
            self._offsets[number] = shared, self._file.tell(), len(data)
            self._file.write(data)

    def __len__(self) -> int:
        return len(self._offsets)

    def stacked(self) -> Table:
        """All tables in the order of their numbers, as one."""
        if len(self._offsets) == 1:  # nothing to pad
            [table] = self._tables()
            return {name: array[None].copy() for name, array in table.items()}
        layout: Layout = common(map(stored_layout, self._layouts))
        return stack(self._tables(), len(self._offsets), layout)

    def _tables(self) -> Iterator[Table]:
        for number in sorted(self._offsets):
            layout, start, size = self._offsets[number]
            self._file.seek(start)
            yield decode(layout, self._file.read(size))

    def __enter__(self) -> "Spool":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()
