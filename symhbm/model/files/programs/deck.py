"""Input decks of CalculiX and Abaqus: the mesh, the materials and the supports that cards tell.

Cards are keywords with options, and the rows below them.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from symhbm.model.files.contents import LOOK, not_of_mesh
from symhbm.model.mesh import Mesh, element
from symhbm.numerics import FloatArray

_KINDS = {
    "C3D4": "tetra",
    "C3D6": "wedge",
    "C3D8": "hexahedron",
    "C3D10": "tetra10",
    "C3D15": "wedge15",
    "C3D20": "hexahedron20",
}
"""Solids by the beginning of their types, whose nodes have the order of ours."""
_HELD = {"PINNED": (1, 2, 3), "ENCASTRE": (1, 2, 3), "XSYMM": (1,), "YSYMM": (2,), "ZSYMM": (3,)}


@dataclass(eq=False, frozen=True)
class Card:
    """A keyword in capitals, its options by name in capitals, the text below it, its step."""

    keyword: str
    options: dict[str, str]
    parts: list[str]
    step: int

    def option(self, name: str) -> str:
        """The value of an option in capitals, ``""`` where it is not given."""
        return self.options.get(name, "").upper()

    @cached_property
    def lines(self) -> list[str]:
        """Lines that are not empty."""
        return [line.strip() for line in "\n".join(self.parts).split("\n") if line.strip()]

    @cached_property
    def rows(self) -> list[list[str]]:
        """Words of each line."""
        return [[word.strip() for word in line.rstrip(",").split(",")] for line in self.lines]

    def numbers(self, width: int) -> FloatArray:
        """All numbers of the lines, in rows of so many; ValueError for what is none."""
        text = "\n".join(self.parts)
        if "D" in text or "d" in text:
            text = text.upper().replace("D", "E")
        values = np.array([*map(float, text.replace(",", " ").split())])
        if len(values) % width:
            raise ValueError(f"*{self.keyword}: expected {width} numbers in a row")
        return values.reshape(-1, width)

    def padded(self, width: int) -> FloatArray:
        """A row of numbers for each line, of which the last ones may be left out as 0."""
        letters = np.frombuffer("\n".join(self.parts).strip().encode("latin-1"), np.uint8)
        begin = np.append(0, np.flatnonzero(letters == ord("\n")) + 1)
        if (np.add.reduceat(letters == ord(","), begin, dtype=int) == width - 1).all():
            values = self.numbers(1)
            if len(values) == width * len(begin):
                return values.reshape(-1, width)
        words = [[word or "0" for word in (row + ["0"] * width)[:width]] for row in self.rows]
        lines = "\n".join(map(",".join, words))
        return Card(self.keyword, {}, [lines], self.step).numbers(width)


def cards(path: Path) -> list[Card]:
    """The cards of a deck and of those that it includes."""
    made: list[Card] = []
    for head, body in _parts(path):
        if head is None:
            if made:
                made[-1].parts.append(body)
            continue
        words = [word.strip() for word in head.split(",")]
        pairs = (word.partition("=") for word in words[1:] if word)
        options = {name.strip().upper(): value.strip().strip('"') for name, _, value in pairs}
        keyword = " ".join(words[0].upper().split())
        step = (made[-1].step if made else 0) + (keyword == "STEP")
        made.append(Card(keyword, options, [body], step))
    return made


def _parts(path: Path) -> Iterator[tuple[str | None, str]]:
    """Lines of keywords with the lines below, None for lines that go on below the last one.

    Decks of a million nodes are cut at their asterisks at once, not line by line.
    """
    text = re.sub(r"\n[ \t]+(?=\*)", "\n", "\n" + path.read_text(encoding="latin-1"))
    first, *parts = text.split("\n*")
    yield None, first
    for part in parts:
        head, _, body = part.partition("\n")
        while head.rstrip().endswith(",") and "=" in body.partition("\n")[0]:
            more, _, body = body.partition("\n")
            head += more
        if head[:7].upper() == "INCLUDE":
            yield from _parts(path.parent / head.partition("=")[2].strip().strip('"'))
        comment = head.startswith("*") or head[:7].upper() == "INCLUDE"
        yield None if comment else head, body


_HELD |= {"XASYMM": (2, 3), "YASYMM": (1, 3), "ZASYMM": (1, 2)}
"""Displacements that are held by the names of supports."""


class Deck:
    """What the cards of a deck tell: mesh, materials, and the cards themselves.

    ``notes`` are what is to be said of the mesh once it was asked for.
    """

    def __init__(self, path: Path):
        self.path = path
        self.cards = cards(path)
        self.notes: list[str] = []
        self._named: dict[str, str] = {}

    def of(self, *keywords: str) -> list[Card]:
        """The cards of some keywords, in their order."""
        return [card for card in self.cards if card.keyword in keywords]

    def name(self, given: str) -> str:
        """A name as it was written first: capitals do not count."""
        return self._named.setdefault(given.upper(), given)

    @cached_property
    def _tables(self) -> dict[Card, FloatArray]:
        """Numbers of each card of nodes and of solids."""
        tables: dict[Card, FloatArray] = {card: card.padded(4) for card in self.of("NODE")}
        dropped: dict[str, int] = {}
        for card in self.of("ELEMENT"):
            family, kind = card.options.get("TYPE", ""), _kind_of(card)
            if kind is None:
                dropped[family] = dropped.get(family, 0) + len(card.lines)
            else:
                tables[card] = card.numbers(1 + len(element(kind).points))
        self.notes += not_of_mesh(dropped)
        return tables

    @cached_property
    def nodes(self) -> tuple[NDArray[np.int64], FloatArray]:
        """Numbers and coordinates; the last line of a node counts."""
        table = [self._tables[card] for card in self.of("NODE")]
        if not table:
            raise ValueError("expected *NODE")
        whole = np.concatenate(table)
        number = whole[:, 0].astype(np.int64)
        order = np.argsort(number, kind="stable")
        last = np.append(np.diff(number[order]) > 0, True)
        again = ~last[:-1] & np.any(np.diff(whole[order], axis=0) != 0, axis=1)
        if again.any():
            self.notes.append(
                f"{LOOK}{again.sum()} nodes have several places, the last ones count (the first: "
                f"{number[order][:-1][again][0]})"
            )
        return number[order][last], whole[order][last][:, 1:]

    @cached_property
    def elements(self) -> dict[str, tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Numbers of elements (n,), and of their nodes (n, n_nodes), by kind."""
        parts: dict[str, list[NDArray]] = {}
        for card in self.of("ELEMENT"):
            if (kind := _kind_of(card)) is not None:
                parts.setdefault(kind, []).append(self._tables[card].astype(np.int64))
        whole = {kind: np.concatenate(blocks) for kind, blocks in parts.items()}
        number = np.sort(np.concatenate([np.zeros(0), *(block[:, 0] for block in whole.values())]))
        if (again := number[1:][np.diff(number) == 0]).size:
            raise ValueError(f"element {again[0]:g} comes twice")
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
            of_nodes = keyword == "NSET" and card.option("TYPE") == "NODE"
            given = card.options.get("NAME" if of_nodes else keyword)
            if given is None:
                continue
            name = self.name(given)
            if card.keyword == owner:
                more = self._tables[card][:, 0] if card in self._tables else ()
            elif "ELSET" in card.options and keyword == "NSET":
                more = self.nodes_of_elements(self.element_sets[self.name(card.options["ELSET"])])
            elif "GENERATE" in card.options:
                more = np.concatenate([self._generated(name, row) for row in card.rows])
                if keyword == "NSET":
                    more = self._there(name, more)
            else:
                more = self.members(card.rows, result)
            result[name] = np.append(result.get(name, ()), more).astype(np.int64)
        return result

    def _generated(self, name: str, row: list[str]) -> NDArray[np.int64]:
        """Numbers from a first to a last one."""
        first, last, step = [*map(int, row), 1][:3]
        if step < 1 or (last - first) % step or last < first:
            self.notes.append(
                f"{LOOK}set {name} is generated from {first} to {last} by {step}, which does not "
                "lead there"
            )
        return np.arange(first, last + 1, max(step, 1))

    def _there(self, name: str, given: NDArray[np.int64]) -> NDArray[np.int64]:
        """Those of generated numbers that nodes have."""
        known = np.isin(given, self.nodes[0])
        if not known.all():
            self.notes.append(
                f"set {name}: {len(given) - known.sum()} of {len(given)} generated numbers are "
                f"those of no node (the first: {given[~known][0]})"
            )
        return given[known]

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
            if card.option("TYPE") not in ("", "ELEMENT"):
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
        """Nodes, solids with their materials, sets and surfaces; surfaces of nodes are sets."""
        solids = {kind: nodes for kind, (_, nodes) in self.elements.items()}
        return Mesh(*self.nodes, solids, self.sets, self.surfaces, self._sections)

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
            elif card.keyword == "ELASTIC" and card.option("TYPE")[:3] in ("", "ISO"):
                told["modulus"], told["poisson"] = map(float, card.rows[0][:2])
                if len(card.rows) > 1:  # of several temperatures: enough to tell units, no more
                    del told["poisson"]
            elif card.keyword == "DAMPING" and not card.step:
                names = {"ALPHA": "mass_share", "BETA": "stiffness_share", "STRUCTURAL": "loss"}
                told |= {names[k]: float(v) for k, v in card.options.items() if k in names}
        return result

    @property
    def _sections(self) -> dict[str, NDArray]:
        """The material of each element by kind, ``""`` of those without a section."""
        written = {name.upper(): name for name in self.materials}
        result = {kind: np.full(len(each), "", object) for kind, (each, _) in self.elements.items()}
        for card in self.of("SOLID SECTION"):
            material = card.options.get("MATERIAL", "")
            if material.upper() not in written:
                raise ValueError(f"*SOLID SECTION of the unknown material {material}")
            chosen = self.element_sets.get(self.name(card.options.get("ELSET", "")), ())
            for kind, (number, _) in self.elements.items():
                result[kind][np.isin(number, chosen)] = written[material.upper()]
        return {kind: names.astype(str) for kind, names in result.items()}

    def held(self, cards: Iterable[Card]) -> NDArray[np.int64]:
        """Node and direction 0 to 2 of supports, (n, 2), in the axes of their nodes."""
        parts = [np.zeros((0, 2), dtype=np.int64)]
        for row in (row for card in cards for row in card.rows):
            ways = _HELD.get(row[1].upper())
            if ways is None:
                first, last = (int(row[k] if row[k:] and row[k] else row[1]) for k in (1, 2))
                ways = range(first, min(last, 3) + 1)
            nodes = self.members([row[:1]], self.sets)
            parts += [np.column_stack([nodes, np.full(len(nodes), way - 1)]) for way in ways]
        every = np.unique(np.concatenate(parts), axis=0)
        return every[np.isin(every[:, 0], self.nodes[0])]


def _kind_of(card: Card) -> str | None:
    """The kind of the elements of a card, None for other ones than solids."""
    return _KINDS.get(card.option("TYPE").rstrip("RIHTMS"))
