"""Cards of the decks of CalculiX and Abaqus: keywords with options, and the rows below them."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from symhbm.numerics import FloatArray


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
