"""Input decks of CalculiX and Abaqus: cards with options and rows, and the mesh that they tell."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.model.mesh import Mesh, element
from symhbm.numerics import FloatArray

KINDS = {
    "C3D4": "tetra",
    "C3D6": "wedge",
    "C3D8": "hexahedron",
    "C3D10": "tetra10",
    "C3D15": "wedge15",
    "C3D20": "hexahedron20",
}
"""Solids by the beginning of their types, whose nodes have the order of ours."""


class Card(NamedTuple):
    """A keyword in capitals, its options by name in capitals, the lines below it, its step."""

    keyword: str
    options: dict[str, str]
    lines: list[str]
    step: int

    @property
    def rows(self) -> list[list[str]]:
        """Words of each line."""
        return [[word.strip() for word in line.rstrip(",").split(",")] for line in self.lines]

    def numbers(self, width: int) -> FloatArray:
        """All numbers of the lines, in rows of so many; ValueError for what is none."""
        words = ",".join(line.rstrip().rstrip(",") for line in self.lines).upper().split(",")
        values = np.array([word.replace("D", "E") for word in words if self.lines], dtype=float)
        if len(values) % width:
            raise ValueError(f"*{self.keyword}: expected {width} numbers in a row")
        return values.reshape(-1, width)


def cards(path: Path) -> Iterator[Card]:
    """The cards of a deck and of those that it includes."""
    made: list[Card] = []
    for line in _lines(path):
        if not line.startswith("*"):
            if made:
                made[-1].lines.append(line)
            continue
        words = [word.strip() for word in line[1:].split(",")]
        pairs = (word.partition("=") for word in words[1:] if word)
        options = {name.strip().upper(): value.strip().strip('"') for name, _, value in pairs}
        keyword = " ".join(words[0].upper().split())
        step = (made[-1].step if made else 0) + (keyword == "STEP")
        made.append(Card(keyword, options, [], step))
    return iter(made)


def _lines(path: Path) -> Iterator[str]:
    """Lines without comments, of files that are included as well."""
    with path.open(encoding="latin-1") as file:
        for line in file:
            text = line.strip()
            if not text or text.startswith("**"):
                continue
            if text[:8].upper() == "*INCLUDE":
                yield from _lines(path.parent / text.partition("=")[2].strip().strip('"'))
            else:
                yield text


class Deck:
    """What the cards of a deck tell: mesh, materials, and the cards themselves.

    ``dropped``: types of elements that are no solids, with their numbers.
    """

    def __init__(self, path: Path):
        self.path = path
        self.cards = [*cards(path)]
        self.dropped: dict[str, int] = {}
        self._named: dict[str, str] = {}

    def of(self, *keywords: str) -> list[Card]:
        """The cards of some keywords, in their order."""
        return [card for card in self.cards if card.keyword in keywords]

    def name(self, given: str) -> str:
        """A name as it was written first: capitals do not count."""
        return self._named.setdefault(given.upper(), given)

    @cached_property
    def nodes(self) -> tuple[NDArray[np.int64], FloatArray]:
        """Numbers and coordinates; the last line of a node counts."""
        table = [_padded(card) for card in self.of("NODE")]
        if not table:
            raise ValueError("expected *NODE")
        whole = np.concatenate(table)[::-1]
        node, first = np.unique(whole[:, 0].astype(np.int64), return_index=True)
        return node, whole[first, 1:]

    @cached_property
    def elements(self) -> dict[str, tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Numbers of elements (n,), and of their nodes (n, n_nodes), by kind."""
        parts: dict[str, list[NDArray]] = {}
        for card in self.of("ELEMENT"):
            family, kind = card.options.get("TYPE", ""), _kind_of(card)
            if kind is None:
                self.dropped[family] = self.dropped.get(family, 0) + len(card.lines)
                continue
            block = card.numbers(1 + len(element(kind).points)).astype(np.int64)
            parts.setdefault(kind, []).append(block)
        whole = {kind: np.concatenate(blocks) for kind, blocks in parts.items()}
        return {kind: (block[:, 0], block[:, 1:]) for kind, block in whole.items()}

    @cached_property
    def sets(self) -> dict[str, NDArray[np.int64]]:
        """Nodes of sets, in their order."""
        return self._gathered("NSET", "NODE")

    @cached_property
    def element_sets(self) -> dict[str, NDArray[np.int64]]:
        """Elements of sets, in their order."""
        return self._gathered("ELSET", "ELEMENT")

    def _gathered(self, keyword: str, owner: str) -> dict[str, NDArray[np.int64]]:
        """Sets of cards of their own, of nodes or elements, and surfaces of nodes."""
        result: dict[str, NDArray[np.int64]] = {}
        for card in self.of(keyword, owner, "SURFACE"):
            of_nodes = keyword == "NSET" and card.options.get("TYPE", "").upper() == "NODE"
            given = card.options.get("NAME" if of_nodes else keyword)
            if given is None:
                continue
            if card.keyword == "NODE":
                more = _padded(card)[:, 0]
            elif card.keyword == "ELEMENT":
                kind = _kind_of(card)
                more = card.numbers(1 + len(element(kind).points))[:, 0] if kind else ()
            elif "ELSET" in card.options and keyword == "NSET":
                more = self.nodes_of_elements(self.element_sets[self.name(card.options["ELSET"])])
            elif "GENERATE" in card.options:
                spans = (np.array(row, dtype=int) for row in card.rows)
                more = np.concatenate([np.arange(s[0], s[1] + 1, *s[2:]) for s in spans])
                more = more[np.isin(more, self.nodes[0])] if keyword == "NSET" else more
            else:
                more = self.members(card.rows, result)
            name = self.name(given)
            result[name] = np.append(result.get(name, ()), more).astype(np.int64)
        return result

    def members(
        self, rows: Iterable[list[str]], known: dict[str, NDArray[np.int64]]
    ) -> NDArray[np.int64]:
        """Numbers of rows of numbers and of names of sets; KeyError for unknown names."""
        words = [word for row in rows for word in row if word]
        parts = [[int(w)] if w.lstrip("-").isdigit() else known[self.name(w)] for w in words]
        return np.concatenate([np.zeros(0, dtype=np.int64), *parts])

    def nodes_of_elements(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """Nodes of some elements, ascending."""
        blocks = [nodes[np.isin(number, numbers)] for number, nodes in self.elements.values()]
        return np.unique(np.concatenate([*map(np.ravel, blocks), np.zeros(0, dtype=np.int64)]))

    @cached_property
    def surfaces(self) -> dict[str, dict[str, NDArray[np.int64]]]:
        """Faces of surfaces of elements by kind, whose lines tell elements or sets and a face."""
        result: dict[str, dict[str, NDArray[np.int64]]] = {}
        for card in self.of("SURFACE"):
            if card.options.get("TYPE", "ELEMENT").upper() != "ELEMENT":
                continue
            faces: dict[str, list[NDArray]] = {}
            for of, side in card.rows:
                chosen = self.members([[of]], self.element_sets)
                for kind, (number, nodes) in self.elements.items():
                    rows = nodes[np.isin(number, chosen)]
                    known = element(kind).faces
                    if len(rows) and side[:1].upper() == "S" and int(side[1:]) <= len(known):
                        face, local = known[int(side[1:]) - 1]
                        faces.setdefault(face, []).append(rows[:, list(local)])
            name = self.name(card.options["NAME"])
            result[name] = {kind: np.concatenate(blocks) for kind, blocks in faces.items()}
        return result

    @cached_property
    def mesh(self) -> Mesh:
        """Nodes, solids, sets and surfaces; surfaces of nodes are sets."""
        solids = {kind: nodes for kind, (_, nodes) in self.elements.items()}
        return Mesh(*self.nodes, solids, self.sets, self.surfaces)

    @cached_property
    def materials(self) -> dict[str, dict[str, float]]:
        """Density, modulus, Poisson's ratio and damping by the names of materials, as written."""
        result: dict[str, dict[str, float]] = {}
        told: dict[str, float] = {}
        for card in self.cards:
            if card.keyword == "MATERIAL":
                told = result.setdefault(self.name(card.options["NAME"]), {})
            elif card.keyword == "DENSITY":
                told["density"] = float(card.rows[0][0])
            elif card.keyword == "ELASTIC" and card.options.get("TYPE", "ISO").upper()[:3] == "ISO":
                told["modulus"], told["poisson"] = map(float, card.rows[0][:2])
                if len(card.rows) > 1:  # of several temperatures: enough to tell units, no more
                    del told["poisson"]
            elif card.keyword == "DAMPING" and not card.step:
                names = {"ALPHA": "mass_share", "BETA": "stiffness_share", "STRUCTURAL": "loss"}
                told |= {names[k]: float(v) for k, v in card.options.items() if k in names}
        return result

    @cached_property
    def densities(self) -> dict[str, FloatArray]:
        """Of each element, by kind, by its section; NaN where none is told."""
        result = {kind: np.full(len(number), np.nan) for kind, (number, _) in self.elements.items()}
        for card in self.of("SOLID SECTION"):
            material = self.materials.get(self.name(card.options.get("MATERIAL", "")), {})
            chosen = self.element_sets.get(self.name(card.options.get("ELSET", "")), ())
            for kind, (number, _) in self.elements.items():
                result[kind][np.isin(number, chosen)] = material.get("density", np.nan)
        return result


def _kind_of(card: Card) -> str | None:
    """The kind of the elements of a card, None for other ones than solids."""
    return KINDS.get(card.options.get("TYPE", "").upper().rstrip("RIHTMS"))


def _padded(card: Card) -> FloatArray:
    """Numbers of nodes and their coordinates, of which the last ones may be left out as 0."""
    if all(line.rstrip(", ").count(",") == 3 for line in card.lines):
        return card.numbers(4)
    rows = card.rows
    words = [word or "0" for row in rows for word in (row + ["0"] * 4)[:4]]
    return card._replace(lines=[",".join(words)] * bool(rows)).numbers(4)
