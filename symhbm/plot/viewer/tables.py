"""Tables of a page: peaks, events, sets that are not complete, parameters, provenance."""

import json
from collections.abc import Iterable, Sequence
from contextlib import suppress
from html import escape
from typing import Any

import numpy as np
import xarray as xr

from symhbm.plot.drawing import decibel, scaled
from symhbm.plot.viewer.packing import number, plain
from symhbm.plot.viewer.sets import Layout, label_of, spoken, values_of
from symhbm.results.reading import COMPLETE, curve_status, set_dimensions

MOST_ROWS = 400
"""Most rows of a table."""
_LONGEST, _MOST_ATTRIBUTES = 4000, 60
"""Most characters of an attribute, and most attributes."""
_ERRORS = ("peak_truncation_error", "peak_residual_norm")
_HEADS = {
    "peak_dof": "place",
    "peak_kind": "kind",
    "peak_truncation_error": "estimated error",
    "peak_residual_norm": "residual",
    "event_kind": "kind",
    "event_contact": "contact",
}
"""Columns of the tables of peaks and events, as far as an archive has them."""


def table_of(caption: str, head: Sequence[str], rows: Iterable[Sequence[str]], note: str) -> str:
    """A table of texts in HTML; the texts of ``rows`` are markup already."""
    cells = "".join(f'<th scope="col">{escape(name)}</th>' for name in head)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    note = f'<p class="note">{escape(note)}</p>' if note else ""
    return (
        f'{note}<div class="scroll" tabindex="0" role="region" aria-label="{escape(caption)}">'
        f"<table><caption>{escape(caption)}</caption><thead><tr>{cells}</tr></thead>"
        f"<tbody>{body}</tbody></table></div>"
    )


def marks_table(
    dataset: xr.Dataset, layout: Layout, what: str, chosen: dict[tuple, dict], places: list[str]
) -> str | None:
    """All peaks, from the highest on, or all events in their order; None where there are none.

    ``chosen`` has the number of the curve and of the mark of those that the page can show, by
    their positions.
    """
    name, dims = f"{what}_{layout.x}", set_dimensions(dataset)
    if name not in dataset.variables or what not in dataset[name].dims:
        return None

    def table(of: str) -> np.ndarray:
        return dataset[of].transpose(*dims, what).values

    value = table(name)
    found = np.argwhere(np.isfinite(value))
    if not len(found):
        return None
    with_heights = what == "peak" and "peak_amplitude" in dataset.variables
    heights = table("peak_amplitude") if with_heights else np.zeros(value.shape)
    size = heights[tuple(found.T)]
    found = found[np.argsort(-np.where(np.isnan(size), -np.inf, size), kind="stable")]
    others = {n: table(n) for n in _HEADS if n in dataset.variables and what in dataset[n].dims}
    unit = f" [{layout.units}]" if layout.units else ""
    head = ["", *(spoken(dim) for dim in dims), what, f"{layout.title}{unit}"]
    own = dataset["peak_amplitude"].attrs.get("units", "m") if with_heights else "m"
    finite = size[np.isfinite(size)]
    factor, own = (
        scaled(float(finite.max(initial=0.0)), own) if own in ("m", "N", "J") else (1.0, own)
    )
    head += [f"amplitude [{own}]", "dB re 1 m"] * with_heights + [_HEADS[n] for n in others]

    def row(index: tuple[int, ...]) -> list[str]:
        cells = [label_of(dataset, dim, i) for dim, i in zip(dims, index[:-1], strict=True)]
        cells += [str(index[-1]), number(float(value[index]))]
        if with_heights:
            top = float(heights[index])
            level = number(float(decibel(top))) if np.isfinite(top) and top > 0 else ""
            cells += [number(factor * top) if np.isfinite(top) else "unbounded", level]
        for n, entries in others.items():
            entry = entries[index]
            if n == "peak_dof" and 0 <= int(entry) < len(places):
                entry = places[int(entry)]
            hidden = n == "event_contact" and int(entry) < 0
            cells.append("" if hidden else _known(entry, errors=n in _ERRORS))
        return [_button(chosen.get((what, *index))), *map(escape, cells)]

    word = what if len(found) == 1 else f"{what}s"
    note = ""
    if len(found) > MOST_ROWS:
        note = f"The first {MOST_ROWS} of {len(found)} {word}; symhbm export has all of them."
    order = "from the highest on" if with_heights else "in their order along the curves"
    rows = (row(tuple(index)) for index in found[:MOST_ROWS].tolist())
    return table_of(f"{len(found)} {word}, {order}", head, rows, note)


def _button(shown: dict[str, int] | None) -> str:
    if shown is None:
        return ""
    return (
        f'<button type="button" class="go" data-curve="{shown["curve"]}" '
        f'data-mark="{shown["mark"]}">show</button>'
    )


def _known(entry: Any, errors: bool) -> str:
    if isinstance(entry, (float, np.floating)):
        if not np.isfinite(entry):
            return ""
        return f"{float(entry):.2g}" if errors else number(entry)
    return number(entry)


def failed_table(dataset: xr.Dataset) -> str | None:
    """The sets that are not complete, and why; None where all are."""
    ends = curve_status(dataset)
    if ends is None:
        return None
    dims, status = set_dimensions(dataset), ends.values.astype(str)
    bad = np.argwhere(~np.isin(status, [*COMPLETE])).tolist()
    if not bad:
        return None
    head = ["parameter set", "status"]
    rows = [
        [
            escape(values_of(dataset, dict(zip(dims, index, strict=True))) or "the only one"),
            escape(plain(status[tuple(index)], 600)),
        ]
        for index in bad[:MOST_ROWS]
    ]
    total = status.size
    note = f"The first {MOST_ROWS} of {len(bad)}." if len(bad) > MOST_ROWS else ""
    return table_of(f"{len(bad)} of {total} curves are not complete", head, rows, note)


def account_html(rows: Iterable[tuple[str, str]], meanings: dict[str, str]) -> str:
    """Labels and texts of an account as a list of HTML, with the ``meanings`` of some labels."""
    listed = ""
    for label, text in rows:
        # Parameters are indented.
        meaning = meanings.get(label.strip(), "") if label.startswith(" ") else ""
        text = f"{plain(text, 600)}{f' ({plain(meaning)})' if meaning else ''}"
        listed += f"<dt>{escape(plain(label, 60))}</dt><dd>{escape(text)}</dd>"
    return f"<dl>{listed}</dl>"


def provenance_html(dataset: xr.Dataset) -> str:
    """All attributes as they are, long ones cut."""
    parts = []
    for name, value in [*dataset.attrs.items()][:_MOST_ATTRIBUTES]:
        text = str(value)
        with suppress(ValueError):
            text = json.dumps(json.loads(text), indent=1, ensure_ascii=False)
        cut = len(text) > _LONGEST
        text = f"{text[:_LONGEST]}\n... {len(text)} characters in all" if cut else text
        parts.append(f"<dt>{escape(plain(name))}</dt><dd><pre>{escape(_visible(text))}</pre></dd>")
    more = len(dataset.attrs) - len(parts)
    note = f"<p>{more} more attributes are not shown.</p>" if more else ""
    return f"<dl>{''.join(parts)}</dl>{note}"


def _visible(text: str) -> str:
    return "".join(c if c == "\n" or c.isprintable() else " " for c in text)
