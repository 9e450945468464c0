"""Results of CalculiX: displacements and natural frequencies of ``.frd``, frequencies of ``.dat``.

A result file of text has blocks of lines of a fixed width, which are read at once. Above a block
stand its nodal diameter, ``1PHID``, a line ``100C`` with frequency and kind of analysis, and its
name, ``DISP`` or ``DISPI`` for the imaginary part.
"""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.model.mesh import Mesh, Modes
from symhbm.numerics import FloatArray

_HEADS = re.compile(rb"^    1PHID +(\d+)|^  100C(.*)|^ -4  (\w+)", re.MULTILINE)
_WIDTH, _NUMBER, _VALUE = 50, 10, 12
"""Characters of a line with three values, of its node and of a value."""
_FREQUENCY = 2
"""Kind of analysis of natural modes."""
_TABLE = re.compile(r"^ +(\d+) +(?:(\d+) +)?(?:-?\d\S*E\S+ +){2}(\d\S*E\S+) +-?\d\S*E\S+ *$", re.M)
_TOTALS = re.compile(r"(total mass|center of gravity) for set.*\n\s*\n *(.*)")
_NEAR = 1e-5
"""Distance of a node from where the deck has it, over its distance from 0, that digits leave."""


class _Block(NamedTuple):
    """Values (n, 3) by node, of one set of displacements."""

    name: str
    nodal_diameter: int | None
    value: float
    kind: int
    node: NDArray[np.int64]
    values: FloatArray


def read_results(path: Path, mesh: Mesh) -> tuple[Modes | None, FloatArray | None, list[str]]:
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


def version_of(path: Path) -> str:
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
