"""The claims of the source in one table, `docs/claims.md`: ``python -m studies.claims_table``.

The table is made from the archives of `python -m studies`, so that no number in it is typed.
"""

import sys
from collections.abc import Mapping, Sequence
from importlib import import_module

import symhbm as sh
from studies.__main__ import STUDIES, statements
from studies.claim import Claim, Finding
from studies.readings import READINGS
from studies.run import RESULTS

PAGE = RESULTS.parent.parent / "docs" / "claims.md"
HEAD = """# What the source says, weighed

E. Chatelet, D. Rade, G. Jacquet-Richardet, *Dynamic Behavior of Cyclic Symmetrical N DOF System
in the Presence of Dry Friction*, DINAME 2013 (hal-00941429). Its claims are beside what the
studies of this repository compute, all with one harmonic unless it is said; decibels are relative
to 1 m, the source gives no reference. Of its figures only captions, tick labels and the text are
known here, not the lines.

`python -m studies` computes all studies, `python -m studies.NAME` one of them, and
`python -m studies.claims_table` makes this page from their archives.
"""
READ = """
## How the source is read

Where the source leaves something open, the studies take it as follows.

| where | reading |
|---|---|
"""
FINDINGS = """
## What the source is silent about

Findings of these studies, in no sentence of the source.
"""


def page(claims: Mapping[str, Sequence[Claim]], findings: Mapping[str, Sequence[Finding]]) -> str:
    """Return the page: the claims of the source, then what the studies find beside them."""
    lines = [HEAD, "| claim | where | what we find | verdict | study |", "|---" * 5 + "|"]
    for name, stated in claims.items():
        lines += [
            _row(f"{one.words}.", one.where, f"{one.computed}.", one.verdict, f"`{name}`")
            for one in stated
        ]
    lines += [READ + "\n".join(_row(where, f"{words}.") for where, words in READINGS)]
    lines += [FINDINGS, "| finding | numbers | study |", "|---" * 3 + "|"]
    for name, stated in findings.items():
        lines += [_row(f"{one.words}.", f"{one.computed}.", f"`{name}`") for one in stated]
    return "\n".join(lines) + "\n"


def _row(*cells: str) -> str:
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"


def main() -> int:
    """Write the page from the archives; 1 where one is missing."""
    claims, findings = {}, {}
    for name in STUDIES:
        module, archive = import_module(f"studies.{name}"), RESULTS / f"{name}.nc"
        if not (hasattr(module, "claims") or hasattr(module, "findings")):
            continue
        if not archive.exists():
            print(f"{archive}: missing; run python -m studies first", file=sys.stderr)
            return 1
        dataset = sh.load(archive)
        claims[name] = statements(module, "claims", dataset)
        findings[name] = statements(module, "findings", dataset)
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(page(claims, findings), encoding="utf-8")
    print(PAGE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
