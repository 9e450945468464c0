"""A comparison of the report: a value found beside the one expected, within what is allowed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from studies.claim import Claim, Finding
from studies.landmark import Landmark, number


class Verdict(StrEnum):
    """What becomes of a comparison."""

    PASSED = "passed"
    FAILED = "FAILED"
    MISSING = "not run"


@dataclass(frozen=True)
class Comparison:
    """One row of the report, as text; ``share`` is the difference over what is allowed."""

    what: str
    source: str
    tolerance: str
    found: str
    expected: str
    difference: str
    verdict: Verdict
    share: float | None = None


@dataclass
class Part:
    """Comparisons of one kind, or of one study, and its pictures as PNG."""

    title: str
    words: str
    rows: list[Comparison]
    pictures: Sequence[Path] = field(default_factory=list)
    seconds: float = 0.0
    """CPU time."""

    def count(self, verdict: Verdict) -> int:
        """Number of comparisons of this verdict."""
        return sum(row.verdict is verdict for row in self.rows)


def of_landmark(mark: Landmark) -> Comparison:
    """A landmark of a study."""
    return compared(
        mark.name,
        mark.computed,
        mark.expected,
        mark.tolerance,
        str(mark.source),
        unit=mark.unit,
        scale=1.0 if mark.expected == 0 else None,
    )


def compared(
    what: str,
    found: Any,
    expected: Any,
    tolerance: float,
    source: str,
    *,
    unit: str = "",
    scale: float | None = None,
) -> Comparison:
    """Compare values, of arrays that which differs most.

    The difference is relative to the expected value, or to ``scale`` where that is given.
    """
    found, expected = (np.atleast_1d(np.asarray(one, dtype=float)) for one in (found, expected))
    # Values of another number are no comparison, and one that is not a number differs most.
    if found.shape != expected.shape or found.size == 0:
        shapes = f"{found.size} values", f"{expected.size} values"
        return Comparison(what, source, "", *shapes, "another number", Verdict.FAILED)
    found, expected = found.ravel(), expected.ravel()
    size = np.abs(expected) if scale is None else np.full(expected.shape, scale)
    off = np.abs(found - expected)
    relative = np.divide(off, size, out=np.where(off == 0, 0.0, np.inf), where=size > 0)
    relative = np.where(np.isnan(relative), np.inf, relative)
    worst = int(np.argmax(relative))
    passed = bool(relative[worst] <= tolerance)
    many = f"{what} ({found.size} values, the worst)" if found.size > 1 else what
    share = float(relative[worst] / tolerance) if tolerance else None
    return Comparison(
        many,
        source,
        number(tolerance, 2),
        f"{number(found[worst], 10)} {unit}".rstrip(),
        f"{number(expected[worst], 10)} {unit}".rstrip(),
        number(relative[worst], 2),
        Verdict.PASSED if passed else Verdict.FAILED,
        share,
    )


def of_statement(one: Claim | Finding) -> Comparison:
    """A claim of the source, whose verdict is known, or a finding of a study."""
    verdict = Verdict.PASSED if one.met else Verdict.FAILED
    if isinstance(one, Finding):
        return Comparison(
            one.words, "finding of our own", "", one.computed, "is found", one.verdict, verdict
        )
    expected = "holds" if one.expected else "does not hold"
    return Comparison(
        one.words, f"source, {one.where}", "", one.computed, expected, one.verdict, verdict
    )


def missing(what: str, source: str, why: str) -> Comparison:
    """A comparison that was not run, and why."""
    return Comparison(what, source, "", why, "", "", Verdict.MISSING)


def computed(title: str, words: str, compute: Callable[[], list[Comparison]]) -> Part:
    """Compute a part; what goes wrong is a comparison that failed."""
    start = process_time()
    try:
        rows = compute()
    except Exception as error:
        why = f"{type(error).__name__}: {error}"
        rows = [Comparison("all of this part", "", "", why, "", "", Verdict.FAILED)]
    return Part(title, words, rows, seconds=process_time() - start)
