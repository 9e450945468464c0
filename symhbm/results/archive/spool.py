"""Encoded tables of many curves: in memory as long as they are small, then in a temporary file."""

from collections.abc import Iterable, Iterator
from tempfile import SpooledTemporaryFile
from types import TracebackType

from symhbm.numerics import Table
from symhbm.results import tables
from symhbm.results.tables import Encoded, Layout

_MEMORY = 2**26
"""Bytes that are held in memory."""


class Spool:
    """Tables by number of their parameter set."""

    def __init__(self):
        self._file = SpooledTemporaryFile(_MEMORY)  # noqa: SIM115 (closed with the object)
        self._places: dict[int, tuple[str, int, int]] = {}
        self._layouts: dict[str, str] = {}

    def add(self, found: Iterable[tuple[int, Encoded]]) -> None:
        """Keep some tables."""
        for number, (layout, data) in found:
            # Many have the same layout, which is kept once.
            same = self._layouts.setdefault(layout, layout)
            self._places[number] = same, self._file.tell(), len(data)
            self._file.write(data)

    def __len__(self) -> int:
        return len(self._places)

    def stacked(self) -> Table:
        """All tables in the order of their numbers, as one."""
        layout: Layout = tables.common(map(tables.stored_layout, self._layouts))
        return tables.stack(self._tables(), len(self._places), layout)

    def _tables(self) -> Iterator[Table]:
        for number in sorted(self._places):
            layout, start, size = self._places[number]
            self._file.seek(start)
            yield tables.decode(layout, self._file.read(size))

    def __enter__(self) -> "Spool":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._file.close()
