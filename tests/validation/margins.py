"""A figure of all comparisons: how much of what is allowed each difference takes."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import shorten
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tests.validation.comparison import Part, Verdict

LEAST, MOST = 1e-9, 1e4
"""Shares beyond these are drawn at these."""


class Drawn(NamedTuple):
    """A picture, and what it shows in words."""

    picture: Path
    words: str


def margins(parts: Sequence[Part], path: Path) -> Drawn:
    """Draw the share of each numerical comparison, part by part."""
    shown = [part for part in parts if any(row.share is not None for row in part.rows)]
    with mpl.rc_context({"font.family": "DejaVu Sans", "font.size": 9}):
        figure = Figure(figsize=(9.6, 1.2 + 0.26 * len(shown)), dpi=200, layout="constrained")
        FigureCanvasAgg(figure)
        ax = figure.add_subplot()
        for height, part in enumerate(shown):
            for row in part.rows:
                if row.share is None:
                    continue
                passed = row.verdict is Verdict.PASSED
                at = np.clip(row.share, LEAST, MOST)
                style = ("o", "#1d6b3a") if passed else ("X", "#b00020")
                ax.plot(at, height, style[0], color=style[1], ms=3.5 if passed else 8, alpha=0.7)
        ax.axvline(1.0, color="black", linewidth=1)
        ax.set(xscale="log", xlim=(LEAST / 2, MOST * 2), xlabel="difference over what is allowed")
        titles = [shorten(part.title, 48, placeholder=" ...") for part in shown]
        ax.set_yticks(range(len(shown)), [title.replace("$", r"\$") for title in titles])
        ax.set_ylim(len(shown) - 0.5, -0.5)
        ax.grid(axis="x", alpha=0.3)
        figure.savefig(path)
    words = (
        "One mark for each comparison of numbers. Right of the line at 1 are those that failed, as "
        f"crosses; shares below {LEAST:g}, zero among them, stand at the left end, and those above "
        f"{MOST:g} at the right one."
    )
    return Drawn(path, words)
