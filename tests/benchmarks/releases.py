"""Ratios over releases: kept in a file, one entry per version, and drawn on the page."""

import json
import re
from collections.abc import Mapping
from math import exp, log
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from tests.benchmarks.table import DOCUMENTS, PAGE

HISTORY = Path(__file__).with_name("releases.json")
PICTURE = DOCUMENTS.parent / "data" / "pictures" / "ratios_over_releases.png"
VERSION = re.compile(r"\bsymhbm (\d+\.\d+\.\d+)")

Ratios = Mapping[str, float]
"""Geometric means by table and column."""


def ratios_in(page: str) -> tuple[str, Ratios]:
    """The version that a page is of, and what its tables say in columns named ``a / b``."""
    found = VERSION.search(page)
    if found is None:
        raise ValueError("page: expected the version that was measured, as in symhbm 0.1.0")
    ratios, caption, header = dict[str, list[float]](), "", list[str]()
    for line in page.splitlines():
        if bold := re.match(r"\*\*(.+?)\*\*", line):
            caption, header = bold[1], []
        elif line.startswith("|") and not header:
            header = cells(line)
        elif line.startswith("|"):
            for name, cell in zip(header, cells(line), strict=True):
                if " / " in name and (number := re.fullmatch(r"[\d.]+", cell)):
                    ratios.setdefault(f"{caption}: {name}", []).append(float(number[0]))
        else:
            header = []
    means = {
        name: float(f"{exp(sum(map(log, values)) / len(values)):.3g}")
        for name, values in ratios.items()
    }
    return found[1], means


def cells(line: str) -> list[str]:
    """The cells of a row of a table in Markdown."""
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def history() -> dict[str, Ratios]:
    """The ratios of all releases that were measured, by version."""
    return json.loads(HISTORY.read_text(encoding="utf-8")) if HISTORY.exists() else {}


def keep() -> None:
    """Put the ratios of the page into the history, and draw all of it."""
    version, ratios = ratios_in(PAGE.read_text(encoding="utf-8"))
    kept = history() | {version: ratios}
    HISTORY.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    drawn(kept).savefig(PICTURE, dpi=150)


def drawn(kept: Mapping[str, Ratios]) -> Figure:
    """A row for each ratio, with a mark for each version, the last one filled."""
    names = [*dict.fromkeys(name for ratios in kept.values() for name in ratios)][::-1]
    with mpl.rc_context({"font.size": 8}):
        figure = Figure(figsize=(7, 0.8 + 0.2 * len(names)), layout="constrained")
        ax = figure.subplots()
        for row, name in enumerate(names):
            known = [ratios[name] for ratios in kept.values() if name in ratios]
            ax.plot(known, [row] * len(known), color="0.6", linewidth=1, zorder=1)
        for number, (version, ratios) in enumerate(kept.items()):
            shade = str(0.7 * (1 - (number + 1) / len(kept)))
            rows = [names.index(name) for name in ratios]
            ax.scatter([*ratios.values()], rows, color=shade, s=18, label=version, zorder=2)
        ax.set(xscale="log", xlabel="ratio, geometric mean over the rows of a table")
        ax.set_yticks(range(len(names)), names)
        ax.grid(axis="x", color="0.9")
        ax.axvline(1, color="0.5", linewidth=0.8)
        ax.legend(title="release", frameon=False, loc="lower right")
    return figure
