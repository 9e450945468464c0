"""One page for all studies: pictures, parameters and landmarks, without any outside resource."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from importlib.metadata import version
from pathlib import Path

import numpy as np
import xarray as xr

from studies.claim import Claim, Finding
from studies.landmark import Landmark, number, unit_of
from studies.page_pictures import embedded, small
from studies.page_style import STYLE
from studies.readings import READINGS
from studies.run import KINDS
from symhbm.model import PARAMETERS
from symhbm.results import Description

TITLE = "Forced response of a bladed disk with dry friction: figures and checks"
SOURCE = (
    "E. Chatelet, D. Rade, G. Jacquet-Richardet, Dynamic Behavior of Cyclic Symmetrical N DOF "
    "System in the Presence of Dry Friction, DINAME 2013, hal-00941429"
)
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""The browser itself refuses every outside resource."""
NORMAL_SIDE = {"normal_stiffness", "centrifugal_load"}
"""Parameters of contacts that open or are pressed by rotation, beside those of the source."""
FEW = 12
"""Largest number of values that are listed one by one."""
COLUMNS = ("landmark", "computed", "expected", "source", "difference", "verdict")


@dataclass(frozen=True)
class Section:
    """What the page says about one study; ``error`` where it failed."""

    name: str
    document: str
    error: str = ""
    parameters: Sequence[tuple[str, str]] = ()
    pictures: Sequence[Path] = ()
    """That on our axes, and that on the axes of the source where these are others, as PNG."""
    archive: str = ""
    landmarks: Sequence[Landmark] = ()
    claims: Sequence[Claim] = ()
    findings: Sequence[Finding] = ()
    made: str = ""
    """Date and time."""
    seconds: float = 0.0
    """Time that it took to compute and to draw."""
    version: str = ""
    """Version of the library that computed the archive."""

    @property
    def title(self) -> str:
        """First line of what the study says about itself."""
        return self.document.partition("\n")[0].rstrip(".") or self.name

    @property
    def paragraphs(self) -> list[str]:
        """The rest of it."""
        return [" ".join(part.split()) for part in self.document.split("\n\n")[1:]]


def parameters(dataset: xr.Dataset) -> list[tuple[str, str]]:
    """Names and values of what a study was computed with."""
    rows = []
    if "problem" in dataset.attrs:
        rows.append(("structure", _structure(Description(dataset))))
    described = {name: (units, long_name) for name, (units, long_name, *_) in PARAMETERS.items()}
    for name in sorted(NORMAL_SIDE & dataset.variables.keys()):
        described[name] = dataset[name].attrs["units"], dataset[name].attrs["long_name"]
    for name, (units, long_name) in described.items():
        values = dataset[name].values if name in dataset.variables else np.zeros(1)
        if name in dataset.variables and (name != "cubic_stiffness" or np.any(values)):
            rows.append((long_name, _values(values, units)))
    if "frequency" in dataset.variables:
        frequency = dataset["frequency"]
        rows.append((frequency.attrs["long_name"], _span(frequency.values, "Hz")))
    for name, words in (("harmonic", "harmonics"), ("highest_harmonic", "highest harmonic")):
        if name in dataset.dims:
            rows.append((words, _values(dataset[name].values, "1")))
    for name, words in (("motion", "motions"), ("law", "laws"), ("case", "points")):
        if name in dataset.dims:
            rows.append((words, "; ".join(map(str, dataset[name].values))))
    return rows


def _structure(description: Description) -> str:
    of_problem, excitation = description.problem, description.forces[0]
    count, n_sectors = of_problem["n_dof"], of_problem.get("n_sectors")
    if not of_problem["lumped"]:
        whole = of_problem.get("n_whole") or count
        unit = "degree" if whole == 1 else "degrees"
        kept = f", {count} of them kept" if count < whole else ""
        body = f"disk of {n_sectors} sectors, each" if n_sectors else "structure"
        return f"{body} of {whole} {unit} of freedom{kept}"
    blades = "one blade" if count == 1 else f"ring of {count} blades"
    if excitation["type"] == "EngineOrder":
        return f"{blades}, travelling wave of an engine order"
    return blades if count == 1 else f"{blades}, force on blade {excitation['place']}"


def _values(values: np.ndarray, units: str) -> str:
    different = np.unique(values[np.isfinite(values)])
    if len(different) > FEW:
        return f"{len(different)} values, {_span(different, units)}"
    return f"{', '.join(map(number, different))} {unit_of(units)}".rstrip()


def _span(values: np.ndarray, units: str) -> str:
    low, high = np.nanmin(values), np.nanmax(values)
    text = number(low) if low == high else f"{number(low)} to {number(high)}"
    return f"{text} {unit_of(units)}".rstrip()


def page(sections: Sequence[Section]) -> str:
    """Return the page as HTML."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<link rel="icon" href="data:,">\n'
        f"<title>{escape(TITLE)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        '<a class="skip" href="#studies">To the first picture</a>\n'
        f"<header><h1>{escape(TITLE)}</h1>\n<p>The figures of the source, computed anew, and what "
        "they were checked against: values published, exact, in closed form, sampled or of "
        "another program, and what the "
        "source says in words, weighed by exact computation. Of the figures of the source only "
        "captions, tick labels and what its text says are known here, not the lines. Decibels are "
        "relative to 1 m, which is a reading: the source gives no reference. Numbers "
        "of pictures, landmarks and claims are computed from the archives beside this page; those "
        "in the words about a study are of the commands that they name, those of a reading in "
        'closed form. Sample -1 is the tuned disk.</p>\n<p class="small">Source: '
        f"{escape(SOURCE)}. "
        f"Computed with symhbm {escape(version('symhbm'))}.</p></header>\n"
        f'<nav id="contents" aria-label="Contents">\n<ol class="cards">\n{_cards(sections)}</ol>\n'
        f'<p class="small">{_totals(sections)}</p></nav>\n'
        + _readings()
        + _claims(sections)
        + '<main id="studies">\n'
        + "\n".join(map(_section, sections))
        + "\n</main>\n</body>\n</html>\n"
    )


def _cards(sections: Sequence[Section]) -> str:
    """A small picture and the title of each section, which lead to it."""
    cards = ""
    for one in sections:
        image = f'<img alt="" src="{small(one.pictures[0])}">' if one.pictures else ""
        title = f"<span>{escape(one.title)}</span>{_state(one)}"
        cards += f'<li><a href="#{escape(one.name)}">{image}{title}</a></li>\n'
    return cards


def _totals(sections: Sequence[Section]) -> str:
    """What all sections found, in numbers."""
    landmarks = [mark for one in sections for mark in one.landmarks]
    claims = [claim for one in sections for claim in one.claims if not is_cited(claim)]
    minutes = sum(one.seconds for one in sections) / 60
    return (
        f"{len(sections)} studies in {minutes:.1f} minutes; landmarks: {_agree(landmarks)}; "
        f"claims of the source: {_hold(claims)}."
    )


def _agree(landmarks: Sequence[Landmark]) -> str:
    met = sum(mark.met for mark in landmarks)
    return f"{met} of {len(landmarks)} agree"


def _hold(claims: Sequence[Claim]) -> str:
    found = f"{sum(claim.holds for claim in claims)} of {len(claims)} hold"
    unlike = sum(not claim.met for claim in claims)
    return found + (f", {unlike} unlike before" if unlike else "")


def _folded(title: str, count: str, body: str, *, wrong: bool = False) -> str:
    """A part of the page that opens on request, or is open where something is wrong."""
    kind = "bad" if wrong else "count"
    told = f' <span class="{kind}">{escape(count)}</span>' if count else ""
    opened = " open" if wrong else ""
    return f"<details{opened}><summary>{escape(title)}{told}</summary>\n{body}</details>\n"


def _readings() -> str:
    """How the source is read where it leaves something open."""
    lines = "".join(
        f"<li><strong>{_text(where)}</strong> {_text(words)}.</li>\n" for where, words in READINGS
    )
    body = f"<ul>\n{lines}</ul>\n"
    return _folded("How the source is read", f"{len(READINGS)} places", body)


def _claims(sections: Sequence[Section]) -> str:
    """What the source says, weighed, those first that do not hold; and what it is silent about."""
    lists = ""
    every = [(one, claim) for one in sections for claim in one.claims]
    kinds = [
        (f"Claims {whose} that {verdict}", holds, cited)
        for whose, cited in (("of the source", False), ("that the source cites,", True))
        for verdict, holds in (("do not hold", False), ("hold", True))
    ]
    for title, holds, cited in kinds:
        chosen = [
            (one, claim)
            for one, claim in every
            if bool(claim.holds) is holds and is_cited(claim) is cited
        ]
        lines = "".join(
            f"<li>{_link(one, claim.where)}: {_text(claim.words)}. "
            f"<em>{_text(claim.computed)}.</em></li>\n"
            for one, claim in chosen
        )
        if lines:
            lists += _folded(title, f"{len(chosen)}", f"<ul>\n{lines}</ul>\n")
    findings: dict[str, list[str]] = {}
    for one in sections:
        for finding in one.findings:
            line = f"<li>{_link(one)}: {_text(finding.computed)}</li>\n"
            findings.setdefault(finding.words, []).append(line)
    ours = "".join(
        f"<p>{_text(words)}:</p>\n<ul>\n{''.join(lines)}</ul>\n"
        for words, lines in findings.items()
    )
    return lists + (_folded("Findings of these studies", f"{len(findings)}", ours) if ours else "")


def is_cited(claim: Claim) -> bool:
    """Whether the source cites the claim from others."""
    return "cited from" in claim.where


def _link(section: Section, words: str | None = None) -> str:
    """A link to a study, by its title up to the colon or by other words."""
    shown = section.title.partition(":")[0] if words is None else words
    return f'<a href="#{escape(section.name)}">{escape(shown)}</a>'


def _text(words: str) -> str:
    """Words as HTML, with what is between back-quotes as code and proper minus signs."""
    signed = re.sub(r"(?<![\w)])-(?=\d)|(?<=\de)-(?=\d)", "\u2212", escape(words))
    return re.sub(r"(`+)(.+?)\1", r"<code>\2</code>", signed)


def _state(section: Section) -> str:
    if section.error:
        return ' <strong class="bad">failed</strong>'
    unmet = sum(not one.met for one in (*section.landmarks, *section.claims, *section.findings))
    return f' <strong class="bad">{unmet} landmarks not met</strong>' if unmet else ""


def _section(section: Section) -> str:
    start = f'<section id="{escape(section.name)}">\n<h2>{escape(section.title)}</h2>\n'
    words = ""
    for text in section.paragraphs:
        style = ' class="small"' if text.startswith("Reference: ") else ""
        words += f"<p{style}>{_text(text)}</p>\n"
    if section.error:
        failed = '<p class="bad">This study failed:</p>'
        return f"{start}{words}{failed}\n<pre>{escape(section.error)}</pre>\n</section>"
    named = "".join(
        f"<dt>{escape(name)}</dt><dd>{_text(value)}</dd>" for name, value in section.parameters
    )
    marks, claims = section.landmarks, section.claims
    wrong = any(not mark.met for mark in marks)
    tables = _folded("Landmarks:", _agree(marks), _table(marks), wrong=wrong)
    if claims:
        wrong = any(not claim.met for claim in claims)
        tables += _folded("Claims of the source:", _hold(claims), _weighed(claims), wrong=wrong)
    if named:
        tables += _folded("Parameters:", f"{len(section.parameters)}", f"<dl>{named}</dl>\n")
    return f"{start}{_pictures(section)}{words}{tables}{_made(section)}</section>"


def _made(section: Section) -> str:
    """Where a study is from: its command, date, duration, version and archive."""
    archive = escape(section.archive)
    rows = (
        ("command", f"<code>python -m studies.{escape(section.name)}</code>"),
        ("computed", escape(f"{section.made}, in {number(section.seconds, 2)} s")),
        ("version", escape(f"symhbm {section.version}".rstrip())),
        ("archive", f'<a href="{archive}">{archive}</a>'),
    )
    return "<dl>" + "".join(f"<dt>{name}</dt><dd>{text}</dd>" for name, text in rows) + "</dl>\n"


def _pictures(section: Section) -> str:
    """That on the axes of the source first, as a reader of it looks for that."""
    captions = ("Beside it, on axes of our own", "On the axes of the source")
    shown = ""
    for caption, picture in reversed([*zip(captions, section.pictures, strict=False)]):
        address, width, height = embedded(picture)
        files = " ".join(
            f'<a href="{escape(picture.stem)}.{kind}">{kind.upper()}</a>' for kind in KINDS
        )
        words = f"{caption}. " if len(section.pictures) > 1 else ""
        shown += (
            f'<figure><a href="{escape(picture.name)}"><img alt="{escape(section.title)}" '
            f'width="{width}" height="{height}" src="{address}"></a>'
            f"<figcaption>{words}Full size: {files}</figcaption></figure>\n"
        )
    return shown


def _table(landmarks: Iterable[Landmark]) -> str:
    head = "".join(f'<th scope="col">{column}</th>' for column in COLUMNS)
    rows = "".join(f"<tr>{_cells(landmark)}</tr>\n" for landmark in landmarks)
    return f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table>"


def _weighed(claims: Sequence[Claim]) -> str:
    """Claims of the source with what is computed."""
    if not claims:
        return ""
    columns = ("claim of the source", "where", "computed", "verdict")
    head = "".join(f'<th scope="col">{column}</th>' for column in columns)
    rows = ""
    for claim in claims:
        kind = "bad" if not claim.met else "good" if claim.holds else "claim"
        texts = claim.words, claim.where, claim.computed, claim.verdict
        rows += "<tr>{}</tr>\n".format(
            "".join(
                f'<td data-label="{column}" class="{style}">{_text(text)}</td>'
                for column, text, style in zip(columns, texts, ("", "", "", kind), strict=True)
            )
        )
    return f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table>\n"


def _cells(landmark: Landmark) -> str:
    unit = f" {landmark.unit}" if landmark.unit else ""
    kind = "good" if landmark.met else "bad"
    digits = 6 if landmark.expected else 3
    difference = "0" if landmark.difference == 0 else number(landmark.difference, 2)
    texts = (
        landmark.name,
        number(landmark.computed, digits) + unit,
        number(landmark.expected, digits) + unit,
        str(landmark.source),
        difference + (unit if landmark.expected == 0 else ""),
        landmark.verdict,
    )
    styles = ("", "number", "number", "", "number", kind)
    return "".join(
        f'<td data-label="{column}" class="{style}">{_text(text)}</td>'
        for column, text, style in zip(COLUMNS, texts, styles, strict=True)
    )


def write(sections: Sequence[Section], path: Path) -> Path:
    """Write the page and return its path."""
    path.write_text(page(sections), encoding="utf-8")
    return path
