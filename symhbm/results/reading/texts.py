"""Texts of archives as they may be shown."""

import unicodedata


def printable(text: str) -> str:
    """A text in one line: control characters, which a terminal obeys, are spaces."""
    if text.isprintable():
        return text
    return "".join(" " if unicodedata.category(c)[0] == "C" else c for c in text)
