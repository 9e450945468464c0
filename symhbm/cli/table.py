"""Tables of archives as comma-separated values."""

import csv
from collections.abc import Iterator, Sequence
from typing import Any, TextIO

import numpy as np

from symhbm.cli.selection import Selection
from symhbm.results.reading import moving, printable, rows_of

Row = Sequence[Any]


def rows(
    selection: Selection, table: str = "points", variables: Sequence[str] | None = None
) -> Iterator[Row]:
    """Header and rows of a table of a selected part, block by block; a missing number is None.

    ``variables`` and what it raises as of `rows_of`.
    """
    dataset = selection.dataset
    if (selection.low, selection.high) != (-np.inf, np.inf) and table == "sets":
        raise ValueError(f"--table sets: a row is a whole curve, not a part of {moving(dataset)}")
    columns, blocks = rows_of(dataset, table, variables, limited=selection.limited)
    titles = [
        printable(f"{column.name}{'' if column.units in ('1', '') else f' [{column.units}]'}")
        for column in columns
    ]
    return _rows(titles, blocks)


def _rows(titles: list[str], blocks: Iterator[list[np.ndarray]]) -> Iterator[Row]:
    yield titles
    for block in blocks:
        values = (
            np.where(np.isnan(column), np.array(None), column).tolist()
            if column.dtype.kind == "f"
            else _cells(column)
            for column in block
        )
        yield from zip(*values, strict=True)


def _cells(column: np.ndarray) -> list[Any]:
    """Values that are no real numbers, texts in one line."""
    cells = column.tolist()
    return [printable(cell) if isinstance(cell, str) else cell for cell in cells]


def write(lines: Iterator[Row], file: TextIO) -> int:
    """Write a table as comma-separated values and return its number of rows."""
    writer = csv.writer(file, lineterminator="\n")
    number = -1
    for line in lines:
        writer.writerow(line)
        number += 1
    return number
