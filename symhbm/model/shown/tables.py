"""Tables of notebooks."""

from collections.abc import Iterable
from html import escape

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
