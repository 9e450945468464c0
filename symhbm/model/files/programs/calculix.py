"""CalculiX: decks, the matrices of ``*FREQUENCY, SOLVER=MATRIXSTORAGE``, and results.

The job ``sector`` has the deck ``sector.inp``; it wrote one triangle of the stiffness and of the
mass, ``sector.sti`` and ``sector.mas``, node and direction of each row, ``sector.dof``, and results
in ``sector.frd`` and ``sector.dat``. Degrees of freedom that are held, or depend on others, are no
rows. Modes may be those of another job, of the same sector with cyclic symmetry.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from symhbm.model.cyclic import PER_MINUTE
from symhbm.model.files.contents import LOOK, Contents, told
from symhbm.model.files.programs.cards import Card
from symhbm.model.files.programs.deck import Deck
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
        modes, displacement, told_of = read_results(path, mesh)
        axis, n_sectors, ties = _cyclic(deck)
        speed = _speed(deck, notes)
    matrices, places = _matrices(path, deck)
    with told(path, "deck of CalculiX"):
        held, said = (None, []) if places is None else _held(deck, places)
    notes = [*deck.notes, *notes, *said]
    program = Program(
        name=f"CalculiX{version_of(path)}",
        speed=speed,
        axis=axis,
        n_sectors=n_sectors,
        sides=ties,
        materials=deck.materials,
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
        node, way = np.array([*map(int, words)]).reshape(-1, 2).T
        direction = np.array(_WAYS)[way - 1]
    modal = _modal(deck)
    if modal is not None and modal.options.get("GLOBAL", "YES").upper() == "NO":
        raise ValueError(f"path={str(path)!r}: expected matrices along x, y and z, not GLOBAL=NO")
    size, result = len(node), {}
    for kind, suffix in (("mass", ".mas"), ("stiffness", ".sti")):
        with told(path.with_suffix(suffix), "matrix of CalculiX"):
            entries = np.loadtxt(path.with_suffix(suffix), ndmin=2)
            row, column = entries[:, :2].T.astype(np.int32) - 1
            largest = 1 + int(max(row.max(), column.max()))
            if largest == 2 * size and deck.of("CYCLIC SYMMETRY MODEL"):
                raise ValueError(
                    "matrices of waves of one nodal diameter, which *CYCLIC SYMMETRY MODEL makes; "
                    "write those of the sector from a deck without it and without its *TIE"
                )
            if largest != size:
                raise ValueError(f"{largest} rows, {of_rows.name} has {size}")
            if not np.bincount(row[row == column], minlength=size).all():
                raise ValueError("some rows have no diagonal entry")
            shape = (size, size)
            result[kind] = sp.coo_array((entries[:, 2], (row, column)), shape=shape).tocsc()
    return result, Places(node, direction)


def _turns(row: list[str]) -> bool:
    """Whether a row of *DLOAD is a load of rotation."""
    return len(row) > 2 and row[1].upper() == "CENTRIF"


def _cyclic(deck: Deck) -> tuple[str | None, int | None, tuple[str, str] | None]:
    """Axis, number of sectors, and the names of the sides."""
    rows = [row for card in deck.of("CYCLIC SYMMETRY MODEL") for row in card.rows[:1]]
    turns = [row[2:] for card in deck.of("DLOAD") for row in card.rows if _turns(row)]
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
        if _turns(row) and card.step <= step
    ]
    if not loads:
        return None
    if "PERTURBATION" not in head[0].options:
        notes.append("matrices and modes are those at rest: their *STEP has no PERTURBATION")
        return None
    return float(np.sqrt(loads[-1][1])) / PER_MINUTE


def _held(deck: Deck, places: Places) -> tuple[Any, list[str]]:
    """Supports (n, 2), node and direction, and in words what is no row of the matrices."""
    mesh = deck.mesh
    if (others := np.setdiff1d(places.node, mesh.node)).size:
        raise ValueError(
            f"node {others[0]} of the matrices is none of *NODE: shells, beams and rigid bodies "
            "have nodes of their own, which are not read"
        )
    missing, fixed, lasting = np.zeros((3, len(mesh.node), 3), dtype=bool)
    for block in mesh.elements.values():
        missing[mesh.at(block)] = True
    missing[mesh.at(places.node), np.searchsorted(_WAYS, places.direction)] = False
    boundary = deck.of("BOUNDARY")
    for mask, some in ((fixed, boundary), (lasting, [c for c in boundary if not c.step])):
        node, way = deck.held(some).T
        mask[mesh.at(node), way] = True
    held, rest = missing & fixed, missing & ~fixed
    cards = ", ".join(f"*{word}" for word in _DEPENDENT if deck.of(word)) or "*TRANSFORM"
    told_of = {
        f"supports: {held.sum()} directions of {held.any(axis=1).sum()} nodes": held,
        f"{rest.sum()} degrees of freedom depend on others and are no rows, by {cards}": rest,
    }
    words = [
        f"{words} (the first: {mesh.node[first]}:{_WAYS[way]})"
        for words, each in told_of.items()
        for first, way in np.argwhere(each)[:1].tolist()
    ]
    # Of nodes with axes of their own, one direction of a support is none of x, y and z.
    turned = deck.members([[card.options["NSET"]] for card in deck.of("TRANSFORM")], deck.sets)
    partly = np.isin(mesh.node, turned) & missing.any(axis=1) & ~missing.all(axis=1)
    if partly.any():
        words.append(
            f"{LOOK}{partly.sum()} nodes are held along axes of their own, by *TRANSFORM: a motion "
            f"along one of x, y and z moves them along others (the first: {mesh.node[partly][0]})"
        )
    # Those before all steps hold in each: where the matrices have them free, the deck was changed.
    held = (held | lasting) & ~np.isin(mesh.node, turned)[:, None] | held.all(axis=1, keepdims=True)
    at, way = np.nonzero(held)
    return np.column_stack([mesh.node[at], way]), words
