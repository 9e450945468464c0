"""Drawings of masses and the elements between them: symbols for few, dots for many."""

import re
from typing import Any

import numpy as np

from symhbm.model import BLADE_PARAMETERS, Structure
from symhbm.numerics import FloatArray
from symhbm.plot.drawing import SYMBOLS
from symhbm.plot.picture import Panel
from symhbm.plot.structure.network import HALF, REACH, Layout, Network, places_of_contacts
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
    panel: Panel, model: Structure, parts: Network, kinds: list[list[str]], layout: Layout
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
        _draw_elements(panel, elements, *ends, away, named, texts)
    for table, directions in ((inner, layout.inward), (outer, layout.outward)):
        for i, elements in table.items():
            start = layout.positions[i] + HALF * directions[i]
            end = layout.positions[i] + (HALF + REACH) * directions[i]
            _draw_elements(panel, elements, start, end, _beside(layout, i), named, texts)
            if layout.hub is None or table is outer or not parts.linear:
                half = 0.12 * len(elements) + 0.1
                wall = ground(end, directions[i], max(half, 0.6) if alone else half)
                _add(panel, wall, "0.25", 0.9)
    for i, centre in enumerate(layout.positions):
        massless = parts.linear and parts.mass[i] == 0
        box: Any = dict(
            boxstyle="round,pad=0,rounding_size=0.04",
            facecolor="white" if massless else "0.9",
            edgecolor="0.2",
            linestyle=(0, (3, 2)) if massless else "-",
            zorder=4,
        )
        panel.add("box", centre - HALF, 2 * HALF, 2 * HALF, **box)
        label = "$m$" if alone else str(names[i])
        panel.text(centre, label, ha="center", va="center", fontsize=8.5, zorder=5)
        if not alone and texts.get(("blade", i)):
            outward = layout.outward[i]
            _write(panel, centre + 0.42 * outward, outward, texts["blade", i], "0.2")


def _draw_elements(
    panel: Panel,
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
        _add(panel, lines, COLORS[kind], 1.1)
        text = _NAMES.get(kind, "") if kind not in named else ""
        named.add(kind)
        beside = texts.get((kind, number), "") if len(elements) <= MOST_VALUES else ""
        text = "\n".join(filter(None, (text, beside)))
        if len(elements) > 2:
            together += [text] if text else []
        elif text:
            direction = across * (np.sign(offset) if abs(offset) > 0.01 else turn)
            gap = 0.2 if kind == "friction" else 0.15
            _write(panel, middle + gap * direction, direction, text, COLORS[kind])
    if together:
        direction = across * turn
        gap = np.abs(offsets).max() + 0.2
        _write(panel, (start + end) / 2 + gap * direction, direction, "\n".join(together), "0.2")
    _add(panel, bars, "0.2", 1.1)


def _beside(layout: Layout, dof: int) -> FloatArray:
    """Direction to the names of elements to the ground: below, where a force is above."""
    return np.array([0.0, -1.0]) if len(layout.positions) == 1 else layout.onward[dof]


def _write(panel: Panel, at: FloatArray, direction: FloatArray, text: str, color: str) -> None:
    """Write a text that begins at a point and goes on in a direction."""
    ha = "left" if direction[0] > 0.4 else "right" if direction[0] < -0.4 else "center"
    # Room for the text within the axes.
    panel.add("room", [at + 0.35 * direction])
    va = "bottom" if direction[1] > 0.4 else "top" if direction[1] < -0.4 else "center"
    look: Any = dict(ha=ha, va=va, fontsize=7.5, color=color, zorder=6, linespacing=1.15)
    panel.text(at, text, **look)


def _values_beside(model: Structure) -> dict[tuple[str, int], str]:
    """Texts beside single masses and contacts: values of parameters that differ."""
    beside: dict[tuple[str, int], str] = {}
    for name, values in model.parameters.items():
        if len(values) < 2 or np.all(values == values[0]):
            continue
        if name in BLADE_PARAMETERS:
            keys, symbol = [("blade", i) for i in range(len(values))], SYMBOLS[name][0]
        else:
            group = model.groups.owner(name)
            keys = [(group.law.drawn_as, j) for j in group.contacts.tolist()]
            symbol = model.records[name].shown_as(name)[0]
        for key, value in zip(keys, values, strict=True):
            line = f"{symbol} {number(float(value))}"
            beside[key] = f"{beside[key]}\n{line}" if key in beside else line
    return beside


def draw_dots(
    panel: Panel, model: Structure, parts: Network, kinds: list[list[str]], layout: Layout
) -> None:
    """Draw dots and lines; contacts in colour."""
    positions = layout.positions
    size = float(np.clip(900 / model.n_dof, 1.5, 14))
    pairs = np.unique(np.concatenate([parts.springs.pairs, parts.dampers.pairs]), axis=0)
    if len(pairs):
        words = "coupling" if parts.springs.reason or parts.dampers.reason else "springs or dampers"
        look: Any = dict(colors="0.7", linewidths=0.7, zorder=1, rasterized=len(pairs) > 5000)
        panel.add("segments", positions[pairs], **look)
        panel.entry(f"{words} between pairs, {len(pairs)}", color="0.7")
    grounded = (parts.springs.ground > 0) | (parts.dampers.ground > 0)
    for chosen, face, words in (
        (~grounded, "0.35", "degrees of freedom"),
        (grounded, "white", "held to the ground"),
    ):
        if chosen.any():
            style: Any = dict(marker="o", linestyle="", color="0.35", markerfacecolor=face)
            dots: Any = dict(markersize=np.sqrt(size) + 0.5, rasterized=model.n_dof > 5000)
            panel.line(*positions[chosen].T, zorder=2, **dots, **style)
            panel.entry(f"{words}, {int(chosen.sum())}", markersize=5, **style)
    places = places_of_contacts(model)
    for kind, words in WORDS.items():
        numbers = [j for j, contact_kinds in enumerate(kinds) if kind in contact_kinds]
        between = [places[j] for j in numbers if len(places[j]) > 1]
        joins = np.array([(first, dof) for first, *others in between for dof in others])
        alone = np.array([places[j] for j in numbers if len(places[j]) == 1])
        if len(joins):
            width = 2.2 if kind != "cubic" else 1.0
            look = dict(colors=COLORS[kind], linewidths=width, zorder=3)
            panel.add("segments", positions[joins], **look)
            panel.entry(f"{words} between, {len(between)}", color=COLORS[kind], linewidth=2.2)
        if len(alone):
            mark = "v" if kind != "cubic" else "1"
            style = dict(marker=mark, linestyle="", color=COLORS[kind], markersize=7)
            panel.line(*positions[alone[:, 0]].T, zorder=4, **style)
            panel.entry(f"{words} to the ground, {len(alone)}", **style)


def draw_hub(panel: Panel, layout: Layout, label: str) -> None:
    """The circle in the middle that masses stand around."""
    assert layout.hub is not None
    look: Any = dict(facecolor="0.94", edgecolor="0.25", linewidth=0.9, zorder=0)
    panel.add("circle", (0, 0), layout.hub, **look)
    panel.text((0, 0), label, ha="center", va="center", fontsize=9, color="0.25")


def draw_forces(panel: Panel, layout: Layout, size: FloatArray, detailed: bool) -> None:
    """Arrows as long as the force on each degree of freedom (n_dof,) is large."""
    top = size.max(initial=0.0) or 1.0
    arrow: Any = dict(arrowstyle="-|>", color=COLORS["force"], linewidth=1.3, shrinkA=0, shrinkB=0)
    for i in np.flatnonzero(size):
        out, on = layout.outward[i], layout.onward[i]
        if np.array_equal(out, on):
            out = np.array([0.0, 1.0])
        away = HALF + 0.1 if detailed else 0.1
        start = layout.positions[i] + away * out - 0.22 * on
        end = start + (0.45 * size[i] / top) * on
        panel.add("arrow", start.tolist(), end.tolist(), **arrow)


def number(value: float) -> str:
    """Short text of a number, without zeros to count in its power of ten."""
    return re.sub(r"e([+-])0*", lambda sign: "e" + sign[1].strip("+"), f"{value:g}")


def _add(panel: Panel, lines: Lines, color: str, width: float) -> None:
    look: Any = dict(colors=color, linewidths=width, zorder=3, capstyle="round")
    panel.add("segments", lines, **look)
