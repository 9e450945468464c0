"""CalculiX: decks, the matrices of ``*FREQUENCY, SOLVER=MATRIXSTORAGE``, and results.

The job ``sector`` has the deck ``sector.inp``; it wrote one triangle of the stiffness and of the
mass, ``sector.sti`` and ``sector.mas``, node and direction of each row, ``sector.dof``, and results
in ``sector.frd`` and ``sector.dat``. Degrees of freedom that are held, or depend on others, are no
rows. Modes may be those of another job, of the same sector with cyclic symmetry.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from symhbm.model.cyclic import PER_MINUTE
from symhbm.model.files.contents import Contents, told
from symhbm.model.files.programs.deck import Card, Deck
from symhbm.model.files.programs.frd import read_results, version_of
from symhbm.model.mesh import Program
from symhbm.model.places import Places

_ROUND_OFF = 1e-9
"""Share of the length of an axis."""
_WAYS = "x", "y", "z"
_DEPENDENT = "EQUATION", "MPC", "TIE", "RIGID BODY", "COUPLING", "DISTRIBUTING COUPLING"


def read(files: dict[str, Path], names: Mapping[str, str]) -> Contents:
    """The job of a deck: matrices if it wrote them, mesh, materials, modes, static displacement."""
    [path] = files.values()
    path = path.with_suffix(".inp")
    notes: list[str] = []
    with told(path, "deck of CalculiX"):
        deck = Deck(path)
        if not deck.elements:
            raise ValueError("expected *ELEMENT with solids")
        mesh = deck.mesh
        if deck.dropped:
            types = ", ".join(f"{count} {kind}" for kind, count in deck.dropped.items())
            notes.append(f"no part of the mesh: {types}, which are no solids")
        mass, moment = mesh.weighed(deck.densities)
        modes, displacement, told_of = read_results(path, mesh)
        axis, n_sectors, ties = _cyclic(deck)
        speed = _speed(deck, notes)
    if np.isnan(mass).any():
        notes.append("mass of elements without *DENSITY or *SOLID SECTION is not known")
        mass = moment = None
    matrices, places = _matrices(path, deck)
    held, said = (None, []) if places is None else _held(deck, places)
    notes += said
    program = Program(
        name=f"CalculiX{version_of(path)}",
        speed=speed,
        axis=axis,
        n_sectors=n_sectors,
        sides=ties,
        materials=deck.materials,
        mass=mass,
        moment=moment,
        displacement=displacement,
        held=held,
        modes=modes,
    )
    kept = (*notes, *told_of)
    return Contents(matrices, places, True, notes=kept, mesh=mesh, program=program)


def _modal(deck: Deck) -> Card | None:
    """The card that writes matrices, or else the one that asks for modes."""
    every = deck.of("FREQUENCY")
    wrote = [c for c in every if c.options.get("SOLVER", "").upper() == "MATRIXSTORAGE"]
    return next(iter(wrote + every), None)


def _matrices(path: Path, deck: Deck) -> tuple[dict[str, Any], Places | None]:
    """Stiffness and mass, one triangle of each, and the places of their rows."""
    of_rows = path.with_suffix(".dof")
    if not of_rows.is_file():
        return {}, None
    with told(of_rows, "table of node.direction"):
        words = of_rows.read_text().replace(".", " ").split()
        node, way = np.array(words, dtype=np.int64).reshape(-1, 2).T
        direction = np.array(_WAYS)[way - 1]
    modal = _modal(deck)
    if modal is not None and modal.options.get("GLOBAL", "YES").upper() == "NO":
        raise ValueError(f"path={str(path)!r}: expected matrices along x, y and z, not GLOBAL=NO")
    size, result = len(node), {}
    for kind, suffix in (("mass", ".mas"), ("stiffness", ".sti")):
        with told(path.with_suffix(suffix), "matrix of CalculiX"):
            entries = np.loadtxt(path.with_suffix(suffix), ndmin=2)
            row, column = entries[:, :2].astype(np.int64).T - 1
            largest = 1 + int(max(row.max(), column.max()))
            if largest == 2 * size and deck.of("CYCLIC SYMMETRY MODEL"):
                raise ValueError(
                    "matrices of waves of one nodal diameter, which *CYCLIC SYMMETRY MODEL makes; "
                    "write those of the sector from a deck without it and without its *TIE"
                )
            if largest != size:
                raise ValueError(f"{largest} rows, {of_rows.name} has {size}")
            if not np.isin(np.arange(size), row[row == column]).all():
                raise ValueError("some rows have no diagonal entry")
            shape = (size, size)
            result[kind] = sp.coo_array((entries[:, 2], (row, column)), shape=shape).tocsc()
    return result, Places(node, direction)


def _cyclic(deck: Deck) -> tuple[str | None, int | None, tuple[str, str] | None]:
    """Axis, number of sectors, and the names of the sides."""
    rows = [row for card in deck.of("CYCLIC SYMMETRY MODEL") for row in card.rows[:1]]
    turns = [row[2:] for card in deck.of("DLOAD") for row in card.rows if row[1:2] == ["CENTRIF"]]
    sides, n_sectors = None, None
    for card in deck.of("CYCLIC SYMMETRY MODEL"):
        n_sectors = int(card.options["N"])
        for tie in deck.of("TIE"):
            name = tie.options.get("NAME", "").upper()
            if card.options.get("TIE", name).upper() == name:
                sides = deck.name(tie.rows[0][0]), deck.name(tie.rows[0][1])
                if unknown := {*sides} - {*deck.mesh.names}:
                    raise KeyError(f"*TIE of unknown surfaces {unknown}")
    if rows:
        first, second = np.array(rows[0][:6], dtype=float).reshape(2, 3)
        point, axis = first, second - first
    elif turns:
        point, axis = np.array(turns[-1][-6:], dtype=float).reshape(2, 3)
    else:
        return None, n_sectors, sides
    axis = axis / np.linalg.norm(axis)
    letter = "xyz"[int(np.argmax(np.abs(axis)))]
    apart = np.linalg.norm(point - axis * (axis @ point))
    if np.abs(axis).max() < 1 - _ROUND_OFF or apart > _ROUND_OFF * np.abs(deck.nodes[1]).max():
        raise ValueError(
            f"expected the axis x, y or z, it is along {axis.round(6).tolist()} through "
            f"{point.tolist()}; turn or move the mesh"
        )
    return letter, n_sectors, sides


def _speed(deck: Deck, notes: list[str]) -> float | None:
    """Speed [turns in 60 units of time] that matrices or modes are of, None at rest."""
    modal = _modal(deck)
    if modal is None:
        return None
    step = modal.step
    head = [card for card in deck.of("STEP") if card.step == step]
    loads = [
        (card.step, float(row[2]))
        for card in deck.of("DLOAD")
        for row in card.rows
        if len(row) > 2 and row[1].upper() == "CENTRIF" and card.step <= step
    ]
    if not loads:
        return None
    if "PERTURBATION" not in head[0].options:
        notes.append("matrices and modes are those at rest: their *STEP has no PERTURBATION")
        return None
    return float(np.sqrt(loads[-1][1])) / PER_MINUTE


def _held(deck: Deck, places: Places) -> tuple[Any, list[str]]:
    """Supports (n, 2), node and direction, and in words what is no row of the matrices."""
    solid = np.unique(np.concatenate([nodes.ravel() for _, nodes in deck.elements.values()]))
    rows = 3 * places.node + np.searchsorted(_WAYS, places.direction)
    missing = np.setdiff1d((3 * solid[:, None] + np.arange(3)).ravel(), rows)
    fixed = np.zeros(0, dtype=np.int64)
    for row in (row for card in deck.of("BOUNDARY") for row in card.rows):
        first, last = (int(row[i]) if len(row) > i and row[i] else int(row[1]) for i in (1, 2))
        nodes = deck.members([row[:1]], deck.sets)
        fixed = np.append(fixed, [3 * nodes + way for way in range(first - 1, min(last, 3))])
    held, rest = np.intersect1d(missing, fixed), np.setdiff1d(missing, fixed)
    cards = ", ".join(f"*{word}" for word in _DEPENDENT if deck.of(word)) or "*TRANSFORM"
    told_of = {
        f"supports: {len(held)} directions of {len(np.unique(held // 3))} nodes": held,
        f"{len(rest)} degrees of freedom depend on others and are no rows, by {cards}": rest,
    }
    words = [
        f"{words} (the first: {each[0] // 3}:{_WAYS[each[0] % 3]})"
        for words, each in told_of.items()
        if len(each)
    ]
    # Of nodes with axes of their own, one direction of a support is none of x, y and z.
    turned = deck.members([[card.options["NSET"]] for card in deck.of("TRANSFORM")], deck.sets)
    node, count = np.unique(held // 3, return_counts=True)
    sure = held[~np.isin(held // 3, turned) | np.isin(held // 3, node[count == 3])]
    return np.column_stack([sure // 3, sure % 3]), words
