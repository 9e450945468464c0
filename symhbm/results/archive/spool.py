"""Encoded tables of many curves: in memory while they are small, then in a temporary file."""

from collections.abc import Iterable, Iterator
from tempfile import SpooledTemporaryFile

from symhbm.numerics import Table
from symhbm.results import tables
from symhbm.results.tables import Encoded, Layout

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
        layout: Layout = tables.common(map(tables.stored_layout, self._layouts))
        return tables.stack(self._tables(), len(self._offsets), layout)

    def _tables(self) -> Iterator[Table]:
        for number in sorted(self._offsets):
            layout, start, size = self._offsets[number]
            self._file.seek(start)
            yield tables.decode(layout, self._file.read(size))

    def __enter__(self) -> "Spool":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()
