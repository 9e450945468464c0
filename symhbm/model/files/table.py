"""Tables of places from text: a line per degree of freedom or per node, columns by their names."""

import csv
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from symhbm.model.files.contents import told
from symhbm.model.files.programs import gmsh
from symhbm.model.places import DIRECTIONS, Places, check_places, node_numbers
from symhbm.numerics import check

_WORDS = {
    **{name: name for name in DIRECTIONS},
    **{str(i + 1): name for i, name in enumerate(DIRECTIONS[:6])},
    **{f"u{axis}": axis for axis in "xyz"},
    **{f"rot{axis}": f"r{axis}" for axis in "xyz"},
    **{f"t{i + 1}": axis for i, axis in enumerate("xyz")},
    **{f"r{i + 1}": f"r{axis}" for i, axis in enumerate("xyz")},
}
"""Directions as programs call them, in small letters."""


def read_places(
    given: Any, known: Places | None, n_dof: int, note: Callable[[str], None]
) -> Places | None:
    """Places of ``n_dof`` degrees of freedom, from a table, a file of one, or those ``known``.

    A table without directions has a line for each node: the degrees of freedom are those that
    are known, or as many for each node, one node after the other, which a ``note`` tells: a table
    of more nodes or of fewer may fit as well.
    """
    if given is None:
        return known
    if isinstance(given, (str, os.PathLike)):
        if Path(given).suffix.lower() == ".msh":
            return gmsh.places_of(Path(given), n_dof)
        given = read_columns(given)
    elif isinstance(given, Mapping):
        given = {str(name): np.asarray(column) for name, column in given.items()}
    if not isinstance(given, dict):
        return check_places(given, n_dof)
    for name in given:
        allowed = ("node", "direction", "x", "y", "z", "coordinates", "label")
        check.known(name, allowed, "column of places")
    if "node" not in given:
        raise ValueError("places: expected the column 'node'")
    if "label" in given and np.asarray(given["label"]).dtype.kind == "f":
        raise ValueError("places: expected labels that are no numbers")
    columns = dict(given)
    axes = [columns.pop(axis) for axis in "xyz" if axis in columns]
    if axes:
        if len(axes) < 3 or "coordinates" in columns:
            raise ValueError("places: expected the columns x, y and z, all of them")
        columns["coordinates"] = np.column_stack(axes)
    if "direction" in columns:
        given_words = np.asarray(columns["direction"]).tolist()
        words = [f"{w:g}" if isinstance(w, float) else str(w).strip().lower() for w in given_words]
        columns["direction"] = np.array([_WORDS.get(word, word) for word in words])
        return check_places(columns, n_dof)
    return _of_nodes(columns, known, n_dof, note)


def _of_nodes(
    columns: dict[str, Any], known: Places | None, n_dof: int, note: Callable[[str], None]
) -> Places:
    """Places from a table of nodes."""
    node = node_numbers("places: node", columns["node"])
    if np.unique(node).size < node.size:
        raise ValueError("places: expected each node once, or the column 'direction'")
    if known is not None:
        order = np.argsort(node)
        at = np.minimum(np.searchsorted(node, known.node, sorter=order), node.size - 1)
        at, direction = order[at], known.direction
        if (missing := node[at] != known.node).any():
            raise ValueError(f"places: node {known.node[missing][0]} is not in the table")
    else:
        each, rest = divmod(n_dof, node.size)
        if rest or each not in (1, 2, 3, 6):
            raise ValueError(
                f"places: expected the column 'direction', as {n_dof} degrees of freedom are not "
                f"1, 2, 3 or 6 for each of {node.size} nodes"
            )
        at = np.repeat(np.arange(node.size), each)
        direction = np.tile(DIRECTIONS[:each], node.size)
        note(
            f"without the column 'direction', {', '.join(DIRECTIONS[:each])} taken for each of "
            f"{node.size} nodes"
        )
    rest_of = {name: np.asarray(columns[name])[at] for name in columns if name != "node"}
    return Places(node=node[at], direction=direction, **rest_of)


def read_columns(path: str | os.PathLike[str]) -> dict[str, np.ndarray]:
    """Columns by name of a file of comma-separated values, numbers where all of a column are.

    Raises FileNotFoundError or ValueError for a file that is none, in one line.
    """
    path = Path(path)
    with told(path, "table"), path.open(newline="", encoding="utf-8-sig") as file:
        lines = csv.reader(line for line in file if line.strip() and not line.startswith("#"))
        names = [name.strip().lower() for name in next(lines, [])]
        rows = [[cell.strip() for cell in row] for row in lines]
        if not rows or len(set(names)) < len(names):
            raise ValueError("expected a line with different names, and lines below it")
        if any(len(row) != len(names) for row in rows):
            raise ValueError(f"expected {len(names)} values in each line")
        columns = zip(*rows, strict=True)
        return {name: _numbers(column) for name, column in zip(names, columns, strict=True)}


def _numbers(column: tuple[str, ...]) -> np.ndarray:
    try:
        return np.array(column, dtype=float)
    except ValueError:
        return np.array(column)
