"""Nastran, read by pyYeti: matrices of ``.op4`` and ``.op2``, and the bulk data beside them.

The job ``sector`` wrote ``sector.op4`` (``OUTPUT4``, ``EXTSEOUT``) or ``sector.op2``. Its bulk
data, ``sector.bdf``, ``.dat``, ``.nas`` or the ``.pch`` of ``EXTSEOUT``, tells what its rows are:
``EXTRN`` of a superelement, or else six degrees of freedom of each grid, in ascending order.
"""

import re
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.files.contents import Contents, contents_of, optional, told
from symhbm.model.mesh import Mesh, Modes, Program
from symhbm.model.places import DIRECTIONS, Places

_BULK = ".pch", ".bdf", ".dat", ".nas"
_HEAD = 2
"""Numbers of an element before those of its nodes: its own and that of its property."""
_SOLIDS = {
    "chexa": {8: "hexahedron", 20: "hexahedron20"},
    "cpenta": {6: "wedge", 15: "wedge15"},
    "ctetra": {4: "tetra", 10: "tetra10"},
}
_ORDER = {
    "hexahedron20": [*range(12), *range(16, 20), *range(12, 16)],
    "wedge15": [*range(9), *range(12, 15), *range(9, 12)],
}
"""Nodes of elements whose upright edges Nastran has before the upper ones."""
_RECTANGULAR = 1
_TURNED = "grids turned to the basic system"
"""What is said of matrices, whose modes are along other directions then."""
_CASE = re.compile(r"^[ \t]*SPC[ \t]*=[ \t]*(\d+)", re.MULTILINE | re.IGNORECASE)
"""The set of supports that the case control chooses."""


def read(files: dict[str, Path], names: Mapping[str, str]) -> Contents:
    """The matrices of one file with its bulk data; ImportError without pyYeti."""
    with np.printoptions():  # which pyYeti changes for all
        bulk, op2, op4 = (
            optional(f"pyyeti.nastran.{name}", "files of Nastran", "nastran")
            for name in ("bulk", "op2", "op4")
        )
    [path] = files.values()
    held: dict[str, Any] = {}
    if path.suffix.lower() == ".op4":
        with told(path, "OP4 file"):
            held = dict(op4.read(str(path), into="dct", sparse=True))
    elif path.suffix.lower() == ".op2":
        with told(path, "OP2 file"):
            held = dict(op2.rdmats(str(path), lower=True))
    lower = {kind: name.lower() for kind, name in names.items()}
    contents = contents_of(path, held, lower) if held else Contents({})
    own = [path] if not held and path.suffix.lower() not in (".op2", ".op4") else []
    beside = [path.with_suffix(suffix) for suffix in _BULK]
    for deck in own or [file for file in beside if file.is_file()][:1]:
        with told(deck, "bulk data of Nastran"):
            contents = _with_bulk(contents, bulk, str(deck))
    results = path.with_suffix(".op2")
    return _with_modes(contents, op2, results) if results.is_file() else contents


def _with_modes(contents: Contents, op2: Any, path: Path) -> Contents:
    """What files hold, with the natural modes of a file of results, where it has them."""
    mesh, program = contents.mesh, contents.program
    if mesh is None:
        return contents
    try:
        with warnings.catch_warnings(), op2.OP2(str(path)) as file:
            warnings.simplefilter("ignore")
            every = file.rdparampost(get_ougs=True, get_mats=False, get_dr_tables=False)
    except Exception as error:  # of results the reader knows few kinds
        notes = (*contents.notes, f"{path.name}: no modes are read ({error})".split("\n")[0])
        return contents._replace(notes=notes)
    table = next((each for name, each in every.items() if name.startswith("oug")), None)
    if table is None:
        return contents
    frequency = table.columns.get_level_values(1).to_numpy(dtype=float)
    node, way = (table.index.get_level_values(k).to_numpy(dtype=np.int64) for k in (0, 1))
    shape = np.full((len(frequency), len(mesh.node), 3), np.nan)
    inside = np.isin(node, mesh.node)
    shape[:, mesh.at(node[inside & (way == 0)])] = 0.0  # scalar points move along one direction
    for k in range(3):
        rows = inside & (np.maximum(way, 1) == k + 1)
        shape[:, mesh.at(node[rows]), k] = table.to_numpy()[rows].T
    whole = not np.isnan(shape).any() and _TURNED not in "".join(contents.notes)
    modes = Modes(frequency, None, shape if whole else None)
    return contents._replace(program=replace(program, modes=modes))


def _with_bulk(contents: Contents, bulk: Any, deck: str) -> Contents:
    """What files hold, with the mesh, the sets and the degrees of freedom of bulk data."""
    grids, notes = bulk.rdgrids(deck), list[str]()
    if grids is None:
        return contents
    systems = bulk.rdcord2cards(deck)
    node = grids[:, 0].astype(np.int64)
    if (grids[:, 1] != 0).any():
        raise ValueError(
            f"grid {node[grids[:, 1] != 0][0]} has coordinates of another system; write bulk data "
            "in the basic one"
        )
    supports = _held(bulk, deck, grids)
    held = supports[supports[:, 1] < 3]
    program = Program("Nastran", materials=_materials(bulk, deck), held=held)
    matrices, places, scalar = contents.matrices, None, node[:0]
    if matrices:
        size = next(iter(matrices.values())).shape[0]
        places = _places(bulk, deck, size, node)
        scalar = np.setdiff1d(places.node, node)
        matrices, places = _without(supports, matrices, places, notes)
        matrices = _turned(matrices, places, grids, systems, notes)
    if len(scalar):
        notes.append(
            f"{len(scalar)} scalar points, modes of a superelement, are called NUMBER:x and said "
            "to be amid the grids"
        )
    amid = np.tile(grids[:, 2:5].mean(axis=0), (len(scalar), 1))
    every, at = np.concatenate([node, scalar]), np.vstack([grids[:, 2:5], amid])
    solids, materials = _elements(bulk, deck, notes)
    mesh = Mesh(every, at, solids, _sets(bulk, deck, node), materials=materials)
    return contents._replace(
        matrices=matrices, places=places, mesh=mesh, program=program, notes=tuple(notes)
    )


def _places(bulk: Any, deck: str, size: int, node: Any) -> Places:
    """Places of the rows."""
    try:
        rows = np.asarray(bulk.rdextrn(deck, expand=True), dtype=np.int64)
    except AttributeError:  # without EXTRN
        rows = np.column_stack([np.repeat(np.sort(node), 6), np.tile(np.arange(1, 7), len(node))])
    if len(rows) != size:
        raise ValueError(
            f"{size} rows of matrices, the bulk data tells {len(rows)} degrees of freedom, of "
            "EXTRN or six of each grid; places= tells them"
        )
    scalar = rows[:, 1] == 0
    names = np.array(DIRECTIONS[:6])[np.where(scalar, 0, rows[:, 1] - 1)]
    return Places(rows[:, 0], names)


def _held(bulk: Any, deck: str, grids: Any) -> NDArray[np.int64]:
    """Grid and direction 0 to 5 of supports, of grids and of what the case control chooses."""
    chosen = {int(n) for n in re.findall(_CASE, Path(deck).read_text(errors="replace"))}
    found = {(int(g), int(c)) for g, cs in grids[:, [0, 6]] for c in str(int(cs)) if c != "0"}
    rows = bulk.rdcards(deck, "spc", return_var="list", keep_name=True) or []
    for name, *values in rows:
        if name == "SPCADD" and values[0] in chosen:
            chosen |= {*values[1:]}
    for name, *values in rows:
        if not values or values[0] not in chosen:
            continue
        if name == "SPC":
            pairs = [*zip(values[1::3], values[2::3], strict=False)]
        else:
            first, last = values[2], values[-1]
            span = range(first, last + 1) if "THRU" in values else values[2:]
            pairs = [(grid, values[1]) for grid in span] if name == "SPC1" else []
        found |= {(grid, int(c)) for grid, ways in pairs for c in str(ways) if c.isdigit()}
    known = [(grid, way - 1) for grid, way in sorted(found) if grid in grids[:, 0]]
    return np.array(known, dtype=np.int64).reshape(-1, 2)


def _without(
    held: NDArray[np.int64], matrices: dict[str, Any], places: Places, notes: list[str]
) -> tuple[dict[str, Any], Places]:
    """Matrices and places without supports, which those of all grids have."""
    ways = np.array([DIRECTIONS.index(way) for way in places.direction])
    fixed = np.isin(6 * places.node + ways, held @ [6, 1])
    if not fixed.any():
        return matrices, places
    first = places.name(int(fixed.argmax()))
    notes.append(f"{fixed.sum()} degrees of freedom held by SPC dropped (the first: {first})")
    kept = np.flatnonzero(~fixed)
    whole = {kind: sp.csc_array(m)[kept][:, kept] for kind, m in matrices.items()}
    return whole, places.of(kept)


def _turned(
    matrices: dict[str, Any], places: Places, grids: Any, systems: Any, notes: list[str]
) -> dict[str, Any]:
    """Matrices over the basic directions."""
    node, own = grids[:, 0].astype(np.int64), grids[:, 5].astype(np.int64)
    turn, turned = sp.lil_array(sp.eye_array(len(places.node))), 0
    for number, system in zip(node[own != 0].tolist(), own[own != 0].tolist(), strict=True):
        rows = places.dofs_of(number) if number in places.node else []
        if not len(rows):
            continue
        known = systems.get(system)
        if known is None or known[0, 1] != _RECTANGULAR or len(rows) % 3:
            raise ValueError(
                f"grid {number}: expected directions of the basic system or of a rectangular one, "
                f"all three, they are of system {system}"
            )
        for first in range(0, len(rows), 3):
            three = list(rows[first : first + 3])
            turn[np.ix_(three, three)] = known[2:].T
        turned += 1
    if not turned:
        return matrices
    notes.append(f"directions of {turned} {_TURNED}")
    return {k: sp.csc_array(turn.T @ m @ turn) for k, m in matrices.items()}


def _elements(bulk: Any, deck: str, notes: list[str]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Nodes of solids by kind, in our order, and the numbers of their materials."""
    parts: dict[str, list[Any]] = {}
    materials: dict[str, list[str]] = {}
    of_property = {
        row[0]: str(row[1]) for row in bulk.rdcards(deck, "psolid", return_var="list") or []
    }
    missing = 0
    for card, kinds in _SOLIDS.items():
        rows = bulk.rdcards(deck, card, return_var="list")
        for row in rows or []:
            nodes = [int(n) if n not in ("", None) else 0 for n in row[_HEAD:]]
            corners = min(kinds)
            kind = kinds.get(len(nodes), "")
            if not any(nodes[corners:]):
                kind, nodes = kinds[corners], nodes[:corners]
            if not kind or 0 in nodes:
                missing += 1
                continue
            order = _ORDER.get(kind, range(len(nodes)))
            parts.setdefault(kind, []).append([nodes[k] for k in order])
            materials.setdefault(kind, []).append(of_property.get(row[1] or row[0], ""))
    if missing:
        notes.append(f"{missing} solids with some of their midside nodes are no part of the mesh")
    return parts, materials


def _sets(bulk: Any, deck: str, node: Any) -> dict[str, Any]:
    """Sets of grids of the case control, called ``SET 7``."""
    every = {f"SET {number}": np.array(each) for number, each in bulk.rdsets(deck).items()}
    return {name: each[np.isin(each, node)] for name, each in every.items() if len(each)}


def _materials(bulk: Any, deck: str) -> dict[str, dict[str, float]]:
    """Young's modulus, Poisson's ratio and density of isotropic materials."""
    result = {}
    for row in bulk.rdcards(deck, "mat1", return_var="list") or []:
        values = [float(v) if v not in ("", None) else 0.0 for v in [*row, 0, 0, 0, 0][:5]]
        number, modulus, shear, poisson, density = values
        if not poisson and shear:
            poisson = modulus / (2 * shear) - 1
        result[str(int(number))] = dict(density=density, modulus=modulus, poisson=poisson)
    return result
