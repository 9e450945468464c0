"""A picture as plain data: panels with axes, and what is drawn over them in its order."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from numpy.typing import ArrayLike

FAMILY = ListedColormap(colormaps["viridis"](np.linspace(0.88, 0.0, 256)))
"""Colours whose lightness falls steadily, so that they differ in greyscale too."""


class Item(NamedTuple):
    """What is drawn: its kind, its numbers, how it looks, and its text in the legend.

    ``kind`` is a method of `Panel`; ``look`` has colours, widths and marks in Matplotlib's words.
    """

    kind: str
    data: tuple[Any, ...]
    look: dict[str, Any]
    label: str


@dataclass
class Axis:
    """One axis of a panel.

    ``limits`` are those of the data where they are None; ``ticks`` are positions and texts, those
    of ``whole`` numbers lie at them, and those without ``marks`` are texts alone. ``room`` is the
    share left free beyond the data, None for the usual one, which ``sticky`` items may take away.
    ``size`` is that of the label.
    """

    label: str = ""
    log: bool = False
    limits: tuple[float | None, float | None] | None = None
    ticks: tuple[ArrayLike, Sequence[str] | None] | None = None
    whole: bool = False
    marks: bool = True
    room: float | None = None
    sticky: bool = True
    grid: bool = True
    size: Any = None
    tick_size: Any = None


class Colours(NamedTuple):
    """Colours of numbers from ``low`` to ``high`` in a map of colours, and what they are."""

    map: Any
    low: float
    high: float
    log: bool = False
    label: str = ""
    percent: bool = False

    @property
    def scale(self) -> ScalarMappable:
        """Numbers to colours, as Matplotlib has it."""
        return ScalarMappable((LogNorm if self.log else Normalize)(self.low, self.high), self.map)

    def of(self, values: Any) -> Any:
        """Colours of some numbers."""
        return self.scale.to_rgba(values)


@dataclass
class Panel:
    """Two axes, the items over them, and what stands around.

    The legend stands ``"outside"``, ``"below"``, where it is ``"best"`` or nowhere, ``""``;
    ``legend`` may have more of Matplotlib's words. A ``bare`` panel has no axes, one that is not
    ``framed`` their texts; an ``even`` one has the same unit along both, and adjusts its ``"box"``
    or its ``"datalim"``.
    ``place`` is the lower end and the height of one of several panels.
    """

    x: Axis = field(default_factory=Axis)
    y: Axis = field(default_factory=Axis)
    items: list[Item] = field(default_factory=list)
    title: str = ""
    title_size: float | None = None
    legend_at: str = "outside"
    legend: dict[str, Any] = field(default_factory=dict)
    bar: Colours | None = None
    bare: bool = False
    framed: bool = True
    even: str = ""
    place: tuple[float, float] = (0.0, 1.0)

    def add(self, kind: str, *data: Any, label: str = "", **look: Any) -> None:
        """Draw an item over those before it."""
        self.items.append(Item(kind, data, look, label))

    def line(self, x: ArrayLike, y: ArrayLike, label: str = "", **look: Any) -> None:
        """A line through points, broken at NaN, or marks at points (n,)."""
        self.add("line", x, y, label=label, **look)

    def band(
        self, x: ArrayLike, low: ArrayLike, high: ArrayLike, label: str = "", **look: Any
    ) -> None:
        """The area between two lines."""
        self.add("band", x, low, high, label=label, **look)

    def text(self, at: ArrayLike, text: str, **look: Any) -> None:
        """A text at a point (2,), or ``offset`` from it in typographic points."""
        self.add("text", at, text, **look)

    def entry(self, label: str, **look: Any) -> None:
        """An entry of the legend alone: a line, or a patch where it has a ``facecolor``."""
        self.add("entry", label=label, **look)


@dataclass
class Picture:
    """Panels from top to bottom over one ``x``, and the size of a figure of them [inch].

    Pictures that are ``alone`` take the whole place of axes. It shows so many ``results``.
    """

    panels: list[Panel]
    size: tuple[float, float] | None = None
    alone: bool = False
    results: int = 1
