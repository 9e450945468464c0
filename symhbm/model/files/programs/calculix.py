"""CalculiX: decks, the matrices of ``*FREQUENCY, SOLVER=MATRIXSTORAGE``, and results.

The job ``sector`` has the deck ``sector.inp``; it wrote one triangle of the stiffness and of the
mass, ``sector.sti`` and ``sector.mas``, node and direction of each row, ``sector.dof``, and results
in ``sector.frd`` and ``sector.dat``. Degrees of freedom that are held, or depend on others, are no
rows. Modes may be those of another job, of the same sector with cyclic symmetry.

Results are displacements and natural frequencies of ``.frd``, frequencies of ``.dat``. A result
file of text has blocks of lines of a fixed width, which are read at once. Above a block stand its
nodal diameter, ``1PHID``, a line ``100C`` with frequency and kind of analysis, and its name,
``DISP`` or ``DISPI`` for the imaginary part.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.cyclic import PER_MINUTE
from symhbm.model.files.contents import LOOK, Contents, told
from symhbm.model.files.programs.deck import Card, Deck
from symhbm.model.mesh import Mesh, Modes, Program
from symhbm.model.places import Places
from symhbm.numerics import FloatArray

_ROUND_OFF = 1e-9
"""Share of the length of an axis."""
_WAYS = "x", "y", "z"
_DEPENDENT = "EQUATION", "MPC", "TIE", "RIGID BODY", "COUPLING", "DISTRIBUTING COUPLING"
_HEADS = re.compile(rb"^    1PHID +(\d+)|^  100C(.*)|^ -4  (\w+)", re.MULTILINE)
_WIDTH, _NUMBER, _VALUE = 50, 10, 12
"""Characters of a line with three values, of its node and of a value."""
_FREQUENCY = 2
"""Kind of analysis of natural modes."""
_TABLE = re.compile(r"^ +(\d+) +(?:(\d+) +)?(?:-?\d\S*E\S+ +){2}(\d\S*E\S+) +-?\d\S*E\S+ *$", re.M)
_TOTALS = re.compile(r"(total mass|center of gravity) for set.*\n\s*\n *(.*)")
_NEAR = 1e-5
"""Distance of a node from where the deck has it, over its distance from 0, that digits leave."""


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
        modes, displacement, told_of = _results(path, mesh)
        axis, n_sectors, ties = _cyclic(deck)
        speed = _speed(deck, notes)
    matrices, places = _matrices(path, deck)
    with told(path, "deck of CalculiX"):
        held, said = (None, []) if places is None else _held(deck, places)
    notes = [*deck.notes, *notes, *said]
    program = Program(
        name=f"CalculiX{_version(path)}",
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


class _Block(NamedTuple):
    """Values (n, 3) by node, of one set of displacements."""

    name: str
    nodal_diameter: int | None
    value: float
    kind: int
    node: NDArray[np.int64]
    values: FloatArray


def _results(path: Path, mesh: Mesh) -> tuple[Modes | None, FloatArray | None, list[str]]:
    """Natural modes, the static displacement (n_nodes, 3), and what is to be said of them."""
    modes, displacement, notes = None, None, list[str]()
    results, table = path.with_suffix(".frd"), path.with_suffix(".dat")
    if results.is_file():
        content = results.read_bytes()
        if not content.rstrip().endswith(b"9999"):
            raise ValueError(f"{results.name} is cut off, its last line is not 9999")
        blocks = _blocks(content)
        if blocks and (moved := _moved(mesh, content)) is not None:
            raise ValueError(
                f"{results.name} is of another mesh than {path.name}: node {moved} is elsewhere"
            )
        still = [block for block in blocks if block.kind != _FREQUENCY and block.name == "DISP"]
        displacement = _over(mesh, still[-1]) if still else None
        modes = _modes(mesh, blocks)
    text = table.read_text(encoding="latin-1") if table.is_file() else ""
    notes += [
        f"{what}, by the program in its units: {' '.join(v.split())}"
        for what, v in _TOTALS.findall(text)
    ]
    if modes is None:
        rows = _TABLE.findall(text)
        if rows:
            frequency = np.array([float(row[2]) for row in rows])
            waves = np.array([int(row[0]) for row in rows]) if rows[0][1] else None
            modes = Modes(frequency, waves)
            notes.append(f"modes of {table.name} without shapes, which *NODE FILE writes")
    return modes, displacement, notes


def _version(path: Path) -> str:
    """Version of the program that wrote the results of a job, if there are any."""
    results = path.with_suffix(".frd")
    head = results.read_bytes()[:2000] if results.is_file() else b""
    found = re.search(rb"1UVERSION +Version +(\S+)", head)
    return f" {found[1].decode()}" if found else ""


def _moved(mesh: Mesh, content: bytes) -> int | None:
    """A node of a mesh that is elsewhere in a result file, None without one."""
    begin = re.search(rb"^    2C.*\n", content, re.MULTILINE)
    node, points = _numbers(content, begin.end() if begin else 0)
    same = np.isin(node, mesh.node)
    off = np.abs(points[same] - mesh.points(node[same])).max(axis=1)
    moved = off > _NEAR * np.abs(mesh.coordinates).max()
    return int(node[same][np.argmax(moved)]) if moved.any() else None


def _blocks(content: bytes) -> list[_Block]:
    result, waves, head = [], None, b""
    for found in _HEADS.finditer(content):
        if found[1] is not None:
            waves = int(found[1])
        elif found[2] is not None:
            head = found[0]
        elif found[3] in (b"DISP", b"DISPI"):
            begin = content.find(b"\n -1", found.end()) + 1
            value, kind = float(head[12:24]), int(head[56:58])
            node, values = _numbers(content, begin)
            result.append(_Block(found[3].decode(), waves, value, kind, node, values))
            waves = None
    return result


def _numbers(content: bytes, begin: int) -> tuple[NDArray[np.int64], FloatArray]:
    """Nodes and three values of the lines from some byte on; ValueError for other ones."""
    end = content.find(b"\n -3", begin) + 1
    if not 0 < begin < end or (end - begin) % _WIDTH:
        raise ValueError("expected lines of a node and three values, as text")
    lines = np.frombuffer(content[begin:end], dtype="S1").reshape(-1, _WIDTH)
    first = _WIDTH - 1 - 3 * _VALUE
    node = np.ascontiguousarray(lines[:, first - _NUMBER : first]).view(f"S{_NUMBER}")
    values = np.ascontiguousarray(lines[:, first:-1]).view(f"S{_VALUE}")
    return node.astype(np.int64).ravel(), values.astype(float).reshape(-1, 3)


def _over(mesh: Mesh, block: _Block) -> FloatArray | None:
    """Values over the nodes of a mesh, None where some were not written."""
    order = np.argsort(block.node)
    at = np.minimum(np.searchsorted(block.node[order], mesh.node), len(order) - 1)
    known = block.node[order][at] == mesh.node
    return block.values[order][at] if known.all() else None


def _modes(mesh: Mesh, blocks: list[_Block]) -> Modes | None:
    """Modes of blocks, real and imaginary parts one after the other."""
    chosen = [block for block in blocks if block.kind == _FREQUENCY and block.name == "DISP"]
    if not chosen:
        return None
    imaginary = [block for block in blocks if block.name == "DISPI"]
    whole = [_over(mesh, block) for block in chosen]
    other = [_over(mesh, block) for block in imaginary]
    shape = None
    if all(part is not None for part in whole + other):
        shape = np.array(whole, dtype=complex if other else float)
        shape = shape + 1j * np.array(other) if len(other) == len(whole) else shape
    waves = [block.nodal_diameter for block in chosen]
    cyclic = bool(imaginary) and None not in waves
    frequency = np.array([block.value for block in chosen])
    return Modes(frequency, np.array(waves) if cyclic else None, shape)
