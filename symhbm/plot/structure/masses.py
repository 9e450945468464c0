"""Drawings of masses and the elements between them: symbols for few, dots for many."""

import re
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyBboxPatch

from symhbm.model import BLADE_PARAMETERS, Structure
from symhbm.numerics import FloatArray
from symhbm.plot.drawing import OUTSIDE, SYMBOLS
from symhbm.plot.structure.layout import HALF, REACH, Layout
from symhbm.plot.structure.network import Network, places_of_contacts
from symhbm.plot.structure.symbols import Lines, ground, side_by_side

WORDS = {
    "friction": "friction damper",
    "cubic": "cubic spring",
    "contact": "contact",
    "opened": "open contact",
}
"""What contacts are called by the element that they are drawn as."""
COLORS = {
    "spring": "black",
    "damper": "black",
    "friction": "#d55e00",
    "cubic": "#0072b2",
    "contact": "#7b3294",
    "opened": "0.55",
    "line": "0.6",
    "force": "#00795a",
}
MOST_VALUES = 4
"""Largest number of elements side by side that have their values beside them."""
_NAMES = {
    "spring": "$k$",
    "damper": "$c$",
    "friction": r"$k_d$, $\mu$, $F_n$",
    "cubic": r"$\gamma$",
    "contact": "contact",
    "opened": "open",
}


def draw_symbols(
    ax: Axes, model: Structure, parts: Network, kinds: list[list[str]], layout: Layout
) -> None:
    """Draw masses, and symbols of the elements between them; the first of each kind is named."""
    alone = model.n_dof == 1 and parts.linear
    between: dict[tuple[int, int], list[tuple[str, int]]] = {}
    inner: dict[int, list[tuple[str, int]]] = {}
    outer: dict[int, list[tuple[str, int]]] = {}
    for kind, links in (("spring", parts.springs), ("damper", parts.dampers)):
        for i, j in links.pairs.tolist():
            if not links.reason:
                between.setdefault((i, j), []).append((kind, -1))
            elif (i, j) not in between:
                between[i, j] = [("line", -1)]
        for i in np.flatnonzero(links.ground).tolist():
            inner.setdefault(i, []).append((kind, -1))
    places = places_of_contacts(model)
    for number, (dofs, contact_kinds) in enumerate(zip(places, kinds, strict=True)):
        elements = [(kind, number) for kind in contact_kinds]
        first, *others = dofs
        if others:
            pairs = [(min(first, dof), max(first, dof)) for dof in others]
            between.setdefault(pairs[0], []).extend(elements)
            for pair in pairs[1:]:
                between.setdefault(pair, [("line", -1)])
        else:
            same = np.array_equal(layout.inward[first], layout.outward[first])
            (inner if same else outer).setdefault(first, []).extend(elements)
    named: set[str] = set()
    texts = _values_beside(model)
    middle = layout.positions.mean(axis=0)
    names = range(model.n_dof) if model.kept is None else model.kept
    for (i, j), elements in between.items():
        start, end = layout.positions[i], layout.positions[j]
        along = (end - start) / np.linalg.norm(end - start)
        away = (start + end) / 2 - middle
        if np.linalg.norm(away) < 1e-9 or abs(away @ along) > 0.99 * np.linalg.norm(away):
            away = np.array([0.0, 1.0])
        ends = start + HALF * along, end - HALF * along
        _draw_elements(ax, elements, *ends, away, named, texts)
    for table, directions in ((inner, layout.inward), (outer, layout.outward)):
        for i, elements in table.items():
            start = layout.positions[i] + HALF * directions[i]
            end = layout.positions[i] + (HALF + REACH) * directions[i]
            _draw_elements(ax, elements, start, end, _beside(layout, i), named, texts)
            if layout.hub is None or table is outer or not parts.linear:
                half = 0.12 * len(elements) + 0.1
                _add(ax, ground(end, directions[i], max(half, 0.6) if alone else half), "0.25", 0.9)
    for i, centre in enumerate(layout.positions):
        massless = parts.linear and parts.mass[i] == 0
        box = FancyBboxPatch(
            (centre[0] - HALF, centre[1] - HALF),
            2 * HALF,
            2 * HALF,
            boxstyle="round,pad=0,rounding_size=0.04",
            facecolor="white" if massless else "0.9",
            edgecolor="0.2",
            linestyle=(0, (3, 2)) if massless else "-",
            zorder=4,
        )
        ax.add_patch(box)
        label = "$m$" if alone else str(names[i])
        ax.text(centre[0], centre[1], label, ha="center", va="center", fontsize=8.5, zorder=5)
        if not alone and texts.get(("blade", i)):
            outward = layout.outward[i]
            _write(ax, centre + 0.42 * outward, outward, texts["blade", i], "0.2")


def _draw_elements(
    ax: Axes,
    elements: list[tuple[str, int]],
    start: FloatArray,
    end: FloatArray,
    away: FloatArray,
    named: set[str],
    texts: dict[tuple[str, int], str],
) -> None:
    """Draw elements side by side, with their names and values."""
    drawn, bars, middles = side_by_side([kind for kind, _ in elements], start, end)
    across = np.array([start[1] - end[1], end[0] - start[0]]) / np.linalg.norm(end - start)
    turn = 1.0 if across @ away >= 0 else -1.0
    offsets = (middles - (start + end) / 2) @ across
    together: list[str] = []
    for (kind, number), lines, middle, offset in zip(
        elements, drawn, middles, offsets, strict=True
    ):
        _add(ax, lines, COLORS[kind], 1.1)
        text = _NAMES.get(kind, "") if kind not in named else ""
        named.add(kind)
        beside = texts.get((kind, number), "") if len(elements) <= MOST_VALUES else ""
        text = "\n".join(filter(None, (text, beside)))
        if len(elements) > 2:
            together += [text] if text else []
        elif text:
            direction = across * (np.sign(offset) if abs(offset) > 0.01 else turn)
            gap = 0.2 if kind == "friction" else 0.15
            _write(ax, middle + gap * direction, direction, text, COLORS[kind])
    if together:
        direction = across * turn
        gap = np.abs(offsets).max() + 0.2
        _write(ax, (start + end) / 2 + gap * direction, direction, "\n".join(together), "0.2")
    _add(ax, bars, "0.2", 1.1)


def _beside(layout: Layout, dof: int) -> FloatArray:
    """Direction to the names of elements to the ground: below, where a force is above."""
    return np.array([0.0, -1.0]) if len(layout.positions) == 1 else layout.onward[dof]


def _write(ax: Axes, at: FloatArray, direction: FloatArray, text: str, color: str) -> None:
    """Write a text that begins at a point and goes on in a direction."""
    ha = "left" if direction[0] > 0.4 else "right" if direction[0] < -0.4 else "center"
    # Room for the text within the axes.
    ax.update_datalim([at + 0.35 * direction])
    va = "bottom" if direction[1] > 0.4 else "top" if direction[1] < -0.4 else "center"
    ax.text(at[0], at[1], text, ha=ha, va=va, fontsize=7.5, color=color, zorder=6, linespacing=1.15)


def _values_beside(model: Structure) -> dict[tuple[str, int], str]:
    """Texts beside single masses and contacts: values of parameters that differ."""
    beside: dict[tuple[str, int], str] = {}
    for name, values in model.parameters.items():
        if len(values) < 2 or np.all(values == values[0]):
            continue
        if name in BLADE_PARAMETERS:
            keys, symbol = [("blade", i) for i in range(len(values))], SYMBOLS[name][0]
        else:
            group = model.group_of(name)
            keys = [(group.law.drawn_as, j) for j in group.contacts.tolist()]
            symbol = model.records[name].shown_as(name)[0]
        for key, value in zip(keys, values, strict=True):
            line = f"{symbol} {number(float(value))}"
            beside[key] = f"{beside[key]}\n{line}" if key in beside else line
    return beside


def draw_dots(
    ax: Axes, model: Structure, parts: Network, kinds: list[list[str]], layout: Layout
) -> None:
    """Draw dots and lines; contacts in colour."""
    positions = layout.positions
    size = float(np.clip(900 / model.n_dof, 1.5, 14))
    handles = []
    pairs = np.unique(np.concatenate([parts.springs.pairs, parts.dampers.pairs]), axis=0)
    if len(pairs):
        words = "coupling" if parts.springs.reason or parts.dampers.reason else "springs or dampers"
        lines = LineCollection(list(positions[pairs]), colors="0.7", linewidths=0.7, zorder=1)
        lines.set_rasterized(len(pairs) > 5000)
        ax.add_collection(lines)
        handles.append(Line2D([], [], color="0.7", label=f"{words} between pairs, {len(pairs)}"))
    grounded = (parts.springs.ground > 0) | (parts.dampers.ground > 0)
    for chosen, face, words in (
        (~grounded, "0.35", "degrees of freedom"),
        (grounded, "white", "held to the ground"),
    ):
        if chosen.any():
            style: Any = dict(marker="o", linestyle="", color="0.35", markerfacecolor=face)
            label = f"{words}, {int(chosen.sum())}"
            dots = Line2D(*positions[chosen].T, markersize=np.sqrt(size) + 0.5, zorder=2, **style)
            dots.set_rasterized(model.n_dof > 5000)
            ax.add_line(dots)
            handles.append(Line2D([], [], markersize=5, label=label, **style))
    places = places_of_contacts(model)
    for kind, words in WORDS.items():
        numbers = [j for j, contact_kinds in enumerate(kinds) if kind in contact_kinds]
        between = [places[j] for j in numbers if len(places[j]) > 1]
        joins = np.array([(first, dof) for first, *others in between for dof in others])
        alone = np.array([places[j] for j in numbers if len(places[j]) == 1])
        if len(joins):
            look: Any = dict(
                colors=COLORS[kind], linewidths=2.2 if kind != "cubic" else 1.0, zorder=3
            )
            ax.add_collection(LineCollection(list(positions[joins]), **look))
            label = f"{words} between, {len(between)}"
            handles.append(Line2D([], [], color=COLORS[kind], linewidth=2.2, label=label))
        if len(alone):
            mark = "v" if kind != "cubic" else "1"
            style = dict(marker=mark, linestyle="", color=COLORS[kind], markersize=7)
            ax.add_line(Line2D(*positions[alone[:, 0]].T, zorder=4, **style))
            label = f"{words} to the ground, {len(alone)}"
            handles.append(Line2D([], [], label=label, **style))
    ax.legend(handles=handles, **OUTSIDE)


def draw_hub(ax: Axes, layout: Layout, label: str) -> None:
    """The circle in the middle that masses stand around."""
    assert layout.hub is not None
    look: Any = dict(facecolor="0.94", edgecolor="0.25", linewidth=0.9, zorder=0)
    ax.add_patch(Circle((0, 0), layout.hub, **look))
    ax.text(0, 0, label, ha="center", va="center", fontsize=9, color="0.25")


def draw_forces(ax: Axes, layout: Layout, size: FloatArray, detailed: bool) -> None:
    """Arrows as long as the force on each degree of freedom (n_dof,) is large."""
    top = size.max(initial=0.0) or 1.0
    arrow = dict(arrowstyle="-|>", color=COLORS["force"], linewidth=1.3, shrinkA=0, shrinkB=0)
    for i in np.flatnonzero(size):
        out, on = layout.outward[i], layout.onward[i]
        if np.array_equal(out, on):
            out = np.array([0.0, 1.0])
        away = HALF + 0.1 if detailed else 0.1
        start = layout.positions[i] + away * out - 0.22 * on
        end = start + (0.45 * size[i] / top) * on
        ax.annotate("", end.tolist(), start.tolist(), arrowprops=arrow, zorder=6)
        ax.update_datalim([start, end])


def number(value: float) -> str:
    """Short text of a number, without zeros to count in its power of ten."""
    return re.sub(r"e([+-])0*", lambda sign: "e" + sign[1].strip("+"), f"{value:g}")


def _add(ax: Axes, lines: Lines, color: str, width: float) -> None:
    look: Any = dict(colors=color, linewidths=width, zorder=3, capstyle="round")
    ax.add_collection(LineCollection(lines, **look))
