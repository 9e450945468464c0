"""What structures and problems show of themselves, as text and as tables of notebooks."""

from collections.abc import Iterable
from html import escape
from typing import Any

import numpy as np

from symhbm.model.linear import gyroscopic_part, natural_modes_of

Rows = list[tuple[str, str]]
"""Labels and texts."""


def as_table(title: str, rows: Iterable[tuple[str, str]]) -> str:
    """HTML of a small table, a row for each label with its text."""
    cell = '<t{0} style="text-align: left; vertical-align: top">{1}</t{0}>'
    lines = [
        f"<tr>{cell.format('h', escape(label))}{cell.format('d', escape(text))}</tr>"
        for label, text in rows
    ]
    return f"<table><caption><b>{escape(title)}</b></caption>{''.join(lines)}</table>"


_MOST_PARAMETERS = 24
"""Parameters with a line each; a structure of many groups has more."""
_MOST_GROUPS = 8
_MOST_DOFS = 300
"""Largest structure whose natural frequencies take no time, some hundredths of a second."""
_FREQUENCIES = 4


def as_text(structure: Any) -> str:
    """Size, parameters and the remark of a structure, a line each."""
    lines = [f"{type(structure).__name__}: {', '.join(_size(structure))}"]
    lines += [f"  {name:<21} {text}" for name, text in _parameters(structure)]
    lines += [f"  {remark}" for remark in _remarks(structure)]
    return "\n".join(lines)


def rows_of(structure: Any) -> Rows:
    """Labels and texts on a structure, what takes long to compute left out."""
    rows = [("structure", ", ".join(_size(structure)))]
    rows += [("", remark) for remark in _remarks(structure)]
    rows += _contacts(structure)
    rows += _parameters(structure)
    for words, stuck in (("contacts open", False), ("contacts stuck", True)):
        natural = _natural_frequencies(structure, stuck)
        if len(natural):
            more = ", ..." if structure.n_dof > len(natural) == _FREQUENCIES else ""
            text = ", ".join(f"{frequency:.4g}" for frequency in natural) + f"{more} Hz"
            rows.append((f"natural frequencies, {words}", text))
    return rows


def _remarks(structure: Any) -> list[str]:
    """What else a structure tells of itself, one line or none."""
    return [structure.remark] if hasattr(structure, "remark") else []


def _size(structure: Any) -> list[str]:
    kind = "lumped blade" if structure.lumped else "degree of freedom"
    plural = kind.replace("degree", "degrees") if " of " in kind else f"{kind}s"
    n_dof, n_contacts = structure.n_dof, structure.n_contacts
    return [
        f"{n_dof} {kind if n_dof == 1 else plural}",
        f"{n_contacts} contact{'' if n_contacts == 1 else 's'}",
    ]


def _parameters(structure: Any) -> Rows:
    rows = []
    for name, value in structure.parameters.items():
        if value.size and (name != "cubic_stiffness" or value.any()):
            low, high = value.min(), value.max()
            text = f"{low:g}" if low == high else f"{low:g} .. {high:g}"
            rows.append((name, f"{text} {structure.about(name).shown_as(name)[1]}".rstrip()))
    left = len(rows) - _MOST_PARAMETERS
    return rows if left <= 0 else [*rows[:_MOST_PARAMETERS], ("...", f"{left} more parameters")]


def _contacts(structure: Any) -> Rows:
    groups = [group for group in structure.groups if group.acts]
    words = [f"{group.name}: {group.n} of {group.law!r}" for group in groups[:_MOST_GROUPS]]
    words += [f"{len(groups) - _MOST_GROUPS} more groups"] if len(groups) > _MOST_GROUPS else []
    return [("contacts", "; ".join(words))] if words else []


def _natural_frequencies(structure: Any, stuck: bool) -> np.ndarray:
    """The lowest natural frequencies [Hz], none where they take time or have no meaning.

    Those of what turns change with the speed, and those of a sector with the nodal diameters.
    """
    size = structure.n_dof
    if not structure.has_matrices or structure.nodal_diameters is not None or size > _MOST_DOFS:
        return np.empty(0)
    if stuck and not structure.groups.stuck_springs.any():
        return np.empty(0)
    if gyroscopic_part(structure.damping_matrix) is not None:
        return np.empty(0)
    try:
        return natural_modes_of(structure, None, min(_FREQUENCIES, size), stuck)[0]
    except ValueError:  # some motion has neither mass nor stiffness, or grows
        return np.empty(0)
