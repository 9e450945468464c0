"""Ansys by ansys-mapdl-reader: matrices of ``.full``, meshes of ``.cdb``, results of ``.rst``.

The job ``sector`` wrote ``sector.full``, one triangle in the order of its nodes, whose supports are
rows of zeros. Its mesh and components are those of ``sector.cdb`` (``CDWRITE, DB``) or, without
one, of ``sector.rst``, which has materials and natural modes, too.
"""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.model.files.contents import Contents, not_of_mesh, optional, told
from symhbm.model.mesh import Mesh, Modes, Program
from symhbm.model.places import DIRECTIONS, Places

_KINDS = {
    185: {8: "hexahedron"},
    186: {20: "hexahedron20", 8: "hexahedron"},
    187: {10: "tetra10", 4: "tetra"},
    285: {4: "tetra"},
    45: {8: "hexahedron"},
    95: {20: "hexahedron20", 8: "hexahedron"},
    92: {10: "tetra10", 4: "tetra"},
}
"""Solids by the number of their type and of their nodes, which have the order of ours."""
_WEDGE = {
    "hexahedron": ("wedge", (0, 1, 2, 4, 5, 6)),
    "hexahedron20": ("wedge15", (0, 1, 2, 4, 5, 6, 8, 9, 11, 12, 13, 15, 16, 17, 18)),
}
"""What a brick is whose fourth and eighth corners are its third and seventh."""
_EDGE = re.compile(r"CYCLIC_M\d+[HL]")
"""Components of the high and the low edge of a sector; there are more of several pairs of edges."""
_HEAD = 10
"""Numbers of an element before those of its nodes, among them its material and type."""
_NAMES = {"DENS": "density", "EX": "modulus", "NUXY": "poisson"}


def read(files: dict[str, Path], names: Mapping[str, str]) -> Contents:
    """The files of a job by one of them; ImportError without ansys-mapdl-reader."""
    reader = optional("ansys.mapdl.reader", "files of Ansys", "ansys")
    binary = reader.read_binary
    [path] = files.values()
    beside = {suffix: path.with_suffix(suffix) for suffix in (".full", ".cdb", ".rst")}
    there = {suffix for suffix, file in beside.items() if file.is_file()}
    matrices, places, mesh, held = {}, None, None, None
    program, notes = Program("Ansys", materials={}), list[str]()
    if ".full" in there:
        with told(beside[".full"], "matrices of Ansys"):
            full = binary(str(beside[".full"]))
            _check_whole(beside[".full"], full._header["ptrEND"])
            matrices, places = _matrices(full)
            held = np.asarray(full.const, dtype=np.int64)
            held = held[held[:, 1] < 3]
    result: Any = None
    if ".rst" in there:
        with told(beside[".rst"], "results of Ansys"):
            result = binary(str(beside[".rst"]))
            _check_whole(beside[".rst"], result._resultheader["ptrEnd8"][0])
    if ".cdb" in there:
        with told(beside[".cdb"], "archive of CDWRITE"):
            archive = reader.Archive(str(beside[".cdb"]))
            _check_turned(archive, matrices)
            mesh = _mesh(archive, notes)
    if result is not None:
        with told(beside[".rst"], "results of Ansys"):
            materials = {
                str(int(number)): {_NAMES[k]: float(v) for k, v in each.items() if k in _NAMES}
                for number, each in result.materials.items()
            }
            _check_turned(result.mesh, matrices)
            own = _mesh(result.mesh, notes, result.node_components)
            mesh = own if mesh is None else mesh
            program = _program(result, own, materials)
            _check_same(path, own, mesh)
    if places is not None:
        if mesh is None:
            notes.append(
                "without .cdb or .rst beside: no coordinates and components, and directions may be "
                "those of rotated nodes"
            )
        elif unknown := np.setdiff1d(places.node, mesh.node).tolist():
            raise ValueError(
                f"path={str(path)!r}: node {unknown[0]} of its matrices is not in the mesh beside"
            )
    program = replace(program, held=held)
    return Contents(matrices, places, True, notes=tuple(notes), mesh=mesh, program=program)


def _check_whole(path: Path, words: int) -> None:
    """Raise ValueError for a file that is cut off: the reader would run beyond its end."""
    if path.stat().st_size < 4 * words:
        raise ValueError("it is cut off")


def _matrices(full: Any) -> tuple[dict[str, Any], Places]:
    if full._header["ptrCE"]:
        raise ValueError("constraint equations, as of CE, CP and CERIG, are not read")
    dofs, stiffness, mass = full.load_km()
    if mass is None or not mass.nnz:
        raise ValueError("no mass; write it by a modal analysis, which ANTYPE, MODAL begins")
    node, way = np.asarray(dofs, dtype=np.int64).T
    if way.max() > 5:
        raise ValueError("expected displacements and rotations alone")
    return {"mass": mass, "stiffness": stiffness}, Places(node, np.array(DIRECTIONS[:6])[way])


def _check_turned(held: Any, matrices: dict[str, Any]) -> None:
    """Raise ValueError for matrices along directions of nodes; shapes of results are turned."""
    turned = np.flatnonzero(np.any(held.node_angles != 0, axis=1))
    if turned.size and matrices:
        raise ValueError(
            f"{turned.size} nodes have directions of their own (the first: "
            f"{held.nnum[turned[0]]}); turn them back by NROTAT before the matrices are written"
        )


def _mesh(held: Any, notes: list[str], components: Any = None) -> Mesh:
    """The mesh of an archive or a result."""
    types = {int(number): int(kind) for number, kind in held.ekey}
    parts: dict[str, list[Any]] = {}
    materials: dict[str, list[str]] = {}
    dropped: dict[str, int] = {}
    for element in held.elem:
        nodes, of_type = element[_HEAD:], types[int(element[1])]
        kind = _KINDS.get(of_type, {}).get(len(nodes), "")
        kind, chosen = _collapsed(kind, nodes)
        if not kind:
            name = f"type {of_type}" + " collapsed" * (of_type in _KINDS)
            dropped[name] = dropped.get(name, 0) + 1
            continue
        parts.setdefault(kind, []).append(chosen)
        materials.setdefault(kind, []).append(str(int(element[0])))
    notes += not_of_mesh(dropped)
    sets = held.node_components if components is None else components
    sets = {str(name): np.asarray(nodes) for name, nodes in sets.items()}
    known = {name: nodes[np.isin(nodes, held.nnum)] for name, nodes in sets.items()}
    blocks = {kind: np.array(block) for kind, block in parts.items()}
    return Mesh(held.nnum, held.nodes[:, :3], blocks, known, materials=materials)


def _collapsed(kind: str, nodes: NDArray) -> tuple[str, NDArray]:
    """What an element is whose nodes come twice; ``""`` for what has no kind here."""
    if len(np.unique(nodes)) == len(nodes) and nodes.min() > 0:
        return kind, nodes
    if kind in _WEDGE:
        wedge, at = _WEDGE[kind]
        chosen = nodes[list(at)]
        if len(np.unique(chosen)) == len(chosen) and nodes[2] == nodes[3] and nodes[6] == nodes[7]:
            return wedge, chosen
    return "", nodes


def _program(result: Any, mesh: Mesh, materials: dict[str, Any]) -> Program:
    """Materials and natural modes of a result."""
    told_of: dict[str, Any] = dict(materials=materials)
    if result._resultheader["kan"] == 2:  # natural modes
        frequency, waves, how = np.array(result.time_values), None, {}
        if (n_sectors := int(result.n_sector or 1)) > 1:
            # Two modes of one frequency are the parts of a wave, and of the one that goes back.
            waves, how = np.array(result.harmonic_indices, dtype=np.int64), {"as_complex": True}
            told_of["n_sectors"] = n_sectors
            edges = sorted(name for name in mesh.sets if _EDGE.fullmatch(name))
            told_of["sides"] = (edges[1], edges[0]) if len(edges) == 2 else None
        shape = np.full((len(frequency), len(mesh.node), 3), np.nan, complex if how else float)
        for number in range(len(frequency)):
            node, values = result.nodal_solution(number, **how)
            shape[number, mesh.at(node)] = np.asarray(values)[:, :3]
        told_of["modes"] = Modes(frequency, waves, None if np.isnan(shape).any() else shape)
    return Program(f"Ansys {result.version:g}", **told_of)


def _check_same(path: Path, one: Mesh, other: Mesh) -> None:
    """Raise ValueError where results are of another mesh than the archive."""
    both = np.intersect1d(one.node, other.node)
    apart = np.abs(one.points(both) - other.points(both)).max(initial=0.0)
    if len(both) < len(one.node) or apart > 1e-5 * np.abs(other.coordinates).max():
        raise ValueError(f"path={str(path)!r}: .cdb and .rst beside it are of different meshes")
