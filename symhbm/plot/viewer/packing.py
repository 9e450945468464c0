"""Numbers and texts as a page holds them: arrays as base64, texts short and without controls."""

import base64
import json
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from symhbm.results.reading import printable

DIGITS = 8
"""Significant digits of every number that a page shows of an archive."""
_LONGEST = 160
"""Most characters of a text that comes from an archive."""


def packed(values: ArrayLike, kind: str = "f8") -> str:
    """An array as text, with its type: ``f8``, ``f4``, ``i4`` or ``i1``."""
    array = np.ascontiguousarray(values, dtype=f"<{kind}")
    return f"{kind}:{base64.b64encode(array.tobytes()).decode('ascii')}"


def embedded(data: Any) -> str:
    """JSON that may stand inside of any element of a page."""
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    for sign in "<>&":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return text


def plain(value: Any, longest: int = _LONGEST) -> str:
    """A text in one line, without control characters and not too long."""
    text = value if isinstance(value, str) else str(value)
    line = " ".join(printable(text[: 4 * longest]).split())
    more = len(line) > longest or len(text) > 4 * longest
    return f"{line[:longest]} ..." if more else line


def number(value: Any) -> str:
    """A number to as many digits as a page shows, other things as text."""
    if isinstance(value, (float, np.floating)):
        return f"{float(value):.{DIGITS}g}"
    return plain(value)


def with_units(value: Any, units: Any) -> str:
    """A number and its unit."""
    return number(value) if units in ("1", "", None) else f"{number(value)} {plain(units, 40)}"
