"""The report as a PDF of A4 pages, drawn by Matplotlib alone."""

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont
from matplotlib.ft2font import FT2Font
from matplotlib.image import imread
from matplotlib.patches import Rectangle

from tests.validation.comparison import Comparison, Part, Verdict
from tests.validation.document import COLUMNS, NOT_COVERED, SCOPE, TITLE, Document

WIDTH, HEIGHT = 841.9, 595.3
"""A4, on its side [pt]."""
LEFT, RIGHT, TOP, BOTTOM = 42.0, 800.0, 556.0, 46.0
BODY, SMALL = 9.0, 7.0
LINE = 1.32
"""Distance of lines over the size of their letters."""
COLOURS = {Verdict.PASSED: "#1d6b3a", Verdict.FAILED: "#b00020", Verdict.MISSING: "#8a4b00"}
SHARES = (0.3, 0.18, 0.06, 0.165, 0.135, 0.095, 0.065)
"""Of the width, by column of the comparisons."""
PAD = 3.0


@cache
def _font(bold: bool) -> FT2Font:
    weight = "bold" if bold else "normal"
    return FT2Font(findfont(FontProperties(family="DejaVu Sans", weight=weight)))


@cache
def _length(text: str, size: float, bold: bool) -> float:
    """Width of a text [pt]."""
    font = _font(bold)
    font.set_size(size, 72)
    font.set_text(text)
    return font.get_width_height()[0] / 64


def wrapped(text: str, width: float, size: float, bold: bool = False) -> list[str]:
    """Lines no wider than that; a word that is wider is broken."""
    lines, line = [], ""
    for word in text.split():
        joined = f"{line} {word}".lstrip()
        if _length(joined, size, bold) <= width:
            line = joined
            continue
        if line:
            lines.append(line)
        while _length(word, size, bold) > width:
            fits = next(
                n for n in range(len(word) - 1, 0, -1) if _length(word[:n], size, bold) <= width
            )
            lines.append(word[:fits])
            word = word[fits:]
        line = word
    return [*lines, line] if line or not lines else lines


class Paper:
    """Pages that are filled from the top; each is a list of what to draw on it."""

    def __init__(self) -> None:
        self.pages: list[list[Callable[[Figure, Axes], Any]]] = []
        self.y = 0.0
        self.new_page()

    def new_page(self) -> None:
        """Go on at the top of another page."""
        self.pages.append([])
        self.y = TOP

    def need(self, height: float) -> bool:
        """Begin another page unless so much is left of this one; whether it did."""
        if self.y - height >= BOTTOM or self.y == TOP:
            return False
        self.new_page()
        return True

    def text(self, text: str, size: float = BODY, *, after: float = 4.0, **style: Any) -> None:
        """A paragraph; what is code in it looks like the rest."""
        text, bold = text.replace("`", ""), style.get("weight") == "bold"
        for line in wrapped(text, RIGHT - LEFT, size, bold):
            self.need(size * LINE)
            self._line(LEFT, self.y, line, size, **style)
            self.y -= size * LINE
        self.y -= after

    def heading(self, text: str, room: float = 60.0) -> None:
        """A heading that does not stand alone at the end of a page."""
        self.need(room)
        self.y -= 8 if self.y < TOP else 0
        self.text(text, 13.0, weight="bold", after=3.0)

    def table(
        self,
        columns: Sequence[str],
        shares: Sequence[float],
        rows: Sequence[tuple[Sequence[str], Verdict | None]],
    ) -> None:
        """A table whose head is on each of its pages; a row stays on one page."""
        widths = [share * (RIGHT - LEFT) for share in shares]
        lefts = [LEFT + sum(widths[:i]) for i in range(len(widths))]

        def row(cells: list[list[str]], verdict: Verdict | None, head: bool) -> None:
            height = max(map(len, cells)) * SMALL * LINE + PAD
            if head or verdict is Verdict.FAILED:
                colour = "#e9ecef" if head else "#fde7ea"
                self._box(LEFT, self.y + SMALL * 0.95 - height, RIGHT - LEFT, height, colour)
            for i, (left, lines) in enumerate(zip(lefts, cells, strict=True)):
                last = i == len(cells) - 1 and verdict is not None
                style = dict(weight="bold" if head or last else "normal")
                style["color"] = COLOURS[verdict] if last else "black"
                for n, line in enumerate(lines):
                    self._line(left, self.y - n * SMALL * LINE, line, SMALL, **style)
            self.y -= height

        def split(cells: Sequence[str], head: bool) -> list[list[str]]:
            # The last column is bold in all rows.
            return [
                wrapped(text, width - 2 * PAD, SMALL, head or i == len(cells) - 1)
                for i, (text, width) in enumerate(zip(cells, widths, strict=True))
            ]

        head = split(columns, True)
        self.need(4 * SMALL * LINE)
        row(head, None, True)
        for texts, verdict in rows:
            cells = split(texts, False)
            if self.need(max(map(len, cells)) * SMALL * LINE + PAD):
                row(head, None, True)
            row(cells, verdict, False)
        self.y -= 6

    def picture(self, path: Path) -> None:
        """A picture, as wide as the page or half of its height, so that tables stay beside it."""
        image = imread(path)
        tall, wide = image.shape[:2]
        scale = min((RIGHT - LEFT) / wide, 0.55 * (TOP - BOTTOM) / tall)
        width, height = wide * scale, tall * scale
        self.need(height + 4)
        box = (LEFT / WIDTH, (self.y - height) / HEIGHT, width / WIDTH, height / HEIGHT)

        def draw(figure: Figure, _: Axes) -> None:
            axes = figure.add_axes(box)
            axes.imshow(image, interpolation="lanczos", aspect="auto")
            axes.set_axis_off()

        self.pages[-1].append(draw)
        self.y -= height + 8

    def _line(self, x: float, y: float, text: str, size: float, **style: Any) -> None:
        self.pages[-1].append(
            lambda _, ax: ax.text(x, y, text, fontsize=size, parse_math=False, **style)
        )

    def _box(self, x: float, y: float, width: float, height: float, colour: str) -> None:
        box = dict(facecolor=colour, edgecolor="none")
        self.pages[-1].append(lambda _, ax: ax.add_patch(Rectangle((x, y), width, height, **box)))

    def write(self, path: Path, footer: str) -> Path:
        """Draw all pages, with their numbers."""
        # Letters of fonts, which can be searched and copied.
        settings = {"pdf.fonttype": 42, "font.family": "DejaVu Sans"}
        with mpl.rc_context(settings), PdfPages(path, metadata={"Title": TITLE}) as pdf:
            for number, drawings in enumerate(self.pages, 1):
                figure = Figure(figsize=(WIDTH / 72, HEIGHT / 72), dpi=150)
                ax = figure.add_axes((0, 0, 1, 1))
                ax.set(xlim=(0, WIDTH), ylim=(0, HEIGHT))
                ax.set_axis_off()
                for draw in drawings:
                    draw(figure, ax)
                told = f"page {number} of {len(self.pages)}"
                ax.text(LEFT, 24, footer, fontsize=SMALL, color="0.35", parse_math=False)
                ax.text(RIGHT, 24, told, fontsize=SMALL, color="0.35", ha="right")
                pdf.savefig(figure)
        return path


def write(document: Document, path: Path) -> Path:
    """Write the report as a PDF."""
    paper = Paper()
    failed = document.count(Verdict.FAILED)
    paper.text(TITLE, 20.0, weight="bold", after=4.0)
    colour = COLOURS[Verdict.FAILED if failed else Verdict.PASSED]
    paper.text(document.result, 12.0, weight="bold", color=colour, after=6.0)
    told = [(pair, None) for pair in document.circumstances]
    paper.table(("what", "of this report"), (0.12, 0.88), told)
    if document.failed:
        paper.heading("What failed")
        _comparisons(paper, [(row, f"{part.title}: {row.what}") for part, row in document.failed])
    paper.heading("Scope")
    for words in SCOPE:
        paper.text(words)
    paper.heading("What is not covered")
    for words in NOT_COVERED:
        paper.text(f"\u2022 {words}", after=2.0)
    paper.new_page()
    paper.heading("Summary")
    counts = []
    for part in document.parts:
        numbers = [str(part.count(verdict)) for verdict in COLOURS]
        verdict = next((v for v in (Verdict.FAILED, *COLOURS) if part.count(v)), None)
        cells = [part.title, *numbers, f"{part.seconds:.1f} s", str(verdict or "")]
        counts.append((cells, verdict))
    shares = (0.5, 0.1, 0.1, 0.1, 0.1, 0.1)
    paper.table(("part", *COLOURS, "CPU time", "verdict"), shares, counts)
    paper.text(document.margins.words)
    paper.picture(document.margins.picture)
    for part in document.parts:
        _part(paper, part)
    dated = f"{TITLE}, {document.made}, {document.command}"
    return paper.write(path, dated)


def _part(paper: Paper, part: Part) -> None:
    paper.heading(part.title, room=110.0)
    paper.text(part.words)
    _comparisons(paper, [(row, row.what) for row in part.rows])
    for picture in part.pictures:
        paper.picture(picture)


def _comparisons(paper: Paper, rows: Sequence[tuple[Comparison, str]]) -> None:
    cells = [
        (
            [
                text.replace("`", "")
                for text in (
                    what,
                    row.source,
                    row.tolerance,
                    row.found,
                    row.expected,
                    row.difference,
                    str(row.verdict),
                )
            ],
            row.verdict,
        )
        for row, what in rows
    ]
    paper.table(COLUMNS, SHARES, cells)
