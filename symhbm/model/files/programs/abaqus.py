"""Abaqus: text of one matrix per file, an entry per line, one triangle of it, and the deck beside.

A line has a node and the number of its direction for the row, the same for the column, and the
value. Fixed degrees of freedom have 1e36 on the diagonal of the stiffness. ``Job-1.inp`` beside
``Job-1_STIF2.mtx`` tells mesh, sets, surfaces and materials.
"""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from symhbm.model.files.contents import Contents, told
from symhbm.model.files.programs.deck import Deck
from symhbm.model.mesh import Program
from symhbm.model.places import Places
from symhbm.numerics import FloatArray

_DIRECTIONS = np.array(["x", "y", "z", "rx", "ry", "rz"])


def read(files: dict[str, Path], names: Mapping[str, str]) -> Contents:
    """The matrices of one file each, over the degrees of freedom of all of them."""
    entries = {kind: _entries(path) for kind, path in files.items()}
    keys = {kind: (_keys(each[:, :2]), _keys(each[:, 2:4])) for kind, each in entries.items()}
    every = np.unique(np.concatenate([np.unique(key) for both in keys.values() for key in both]))
    matrices = {}
    for kind, (row, column) in keys.items():
        at = np.searchsorted(every, row), np.searchsorted(every, column)
        size = (every.size, every.size)
        matrices[kind] = sp.coo_array((entries[kind][:, 4], at), shape=size).tocsc()
    direction = _DIRECTIONS[every % len(_DIRECTIONS)]
    contents = Contents(matrices, Places(every // len(_DIRECTIONS), direction), triangle=True)
    path = next(iter(files.values()))
    deck = path.with_name(re.sub(r"_[A-Za-z]+\d*$", "", path.stem) + ".inp")
    return _with_deck(contents, deck) if deck.is_file() else contents


def _with_deck(contents: Contents, path: Path) -> Contents:
    """What files hold, with mesh, sets, surfaces and materials of a deck."""
    with told(path, "deck of Abaqus"):
        deck = Deck(path)
        moved = [card for card in deck.of("INSTANCE") if any(map(str.strip, card.lines))]
        if len(deck.of("INSTANCE")) > 1 or moved:
            raise ValueError(
                "expected one part that is neither moved nor turned; write a deck without parts"
            )
        turned = deck.of("TRANSFORM")
        if turned:
            raise ValueError("expected directions x, y and z, *TRANSFORM turns some")
        mesh = deck.mesh
        lasting = [card for card in deck.of("BOUNDARY") if not card.step]
        program = Program("Abaqus", materials=deck.materials, held=deck.held(lasting))
    return contents._replace(mesh=mesh, program=program, notes=tuple(deck.notes))


def _entries(path: Path) -> FloatArray:
    """Lines (n, 5) of node, direction, node, direction and value."""
    with told(path, "Matrix Market file and no matrix of Abaqus"):
        with path.open() as file:
            first = next(line for line in file if not line.startswith("*") and line.strip())
        separator = "," if "," in first else None
        entries = np.loadtxt(path, delimiter=separator, comments="*", ndmin=2)
        if entries.shape[1] != 5 or not len(entries):
            raise ValueError(
                "expected lines of row node, direction, column node, direction, value, got "
                f"{entries.shape[1]} columns"
            )
        if np.any(entries[:, :4] % 1):
            raise ValueError("expected integers for nodes and directions")
        directions = entries[:, [1, 3]]
        if np.any((directions < 1) | (directions > len(_DIRECTIONS))):
            raise ValueError("expected directions from 1 to 6, displacements and rotations")
        return entries


def _keys(places: FloatArray):
    """One number for each node and direction, ascending with both."""
    node, direction = places.astype(np.int64).T
    return node * len(_DIRECTIONS) + direction - 1
