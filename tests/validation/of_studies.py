"""Comparisons that studies make: landmarks, claims of the source and findings."""

from collections.abc import Iterable
from pathlib import Path
from time import process_time

from studies.__main__ import STUDIES, study
from studies.index import Section
from tests.validation.comparison import (
    Comparison,
    Part,
    Verdict,
    missing,
    of_landmark,
    of_statement,
)

QUICK = (
    "fig04_hysteresis_loop",
    "fig07_nodal_diameters",
    "fig08_engine_orders",
    "fig10_friction_coefficient",
)
"""Studies of the quick report, some 10 s of CPU time together."""


def parts(names: Iterable[str], folder: Path) -> Iterable[Part]:
    """Run studies one after the other; their archives and pictures are in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        start = process_time()
        section = study(name, folder, lambda _: None)
        yield _part(section, process_time() - start)


def chosen(quick: bool) -> tuple[str, ...]:
    """Names of the studies of a report."""
    return QUICK if quick else tuple(STUDIES)


def _part(section: Section, seconds: float) -> Part:
    rows: list[Comparison] = [of_landmark(mark) for mark in section.landmarks]
    rows += [of_statement(one) for one in (*section.claims, *section.findings)]
    if section.error.startswith("ModuleNotFoundError"):
        rows = [missing("all of this study", "", section.error)]
    elif section.error:
        what = "all of this study"
        rows = [Comparison(what, "", "", section.error, "", "", Verdict.FAILED)]
    words = f"`python -m studies.{section.name}`. " + " ".join(section.paragraphs[:1])
    return Part(f"Study: {section.title}", words, rows, section.pictures, seconds)
