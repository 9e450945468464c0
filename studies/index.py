"""One page for all studies: pictures, parameters and landmarks, without any outside resource."""

import json
import re
from base64 import b64encode
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape
from importlib.metadata import version
from pathlib import Path

import numpy as np
import xarray as xr

from studies.claim import Claim, Finding
from studies.landmark import Landmark, number
from studies.readings import READINGS
from symhbm.model import PARAMETERS

TITLE = "Forced response of a bladed disk with dry friction: figures and checks"
SOURCE = (
    "E. Chatelet, D. Rade, G. Jacquet-Richardet, Dynamic Behavior of Cyclic Symmetrical N DOF "
    "System in the Presence of Dry Friction, DINAME 2013, hal-00941429"
)
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""The browser itself refuses every outside resource."""
UNITS = {"1": "", "N m-1": "N/m", "N s m-1": "N s/m", "N m-3": "N/m³"}
NORMAL_SIDE = {"normal_stiffness"}
"""Parameters of contacts that open, beside those of the source."""
FEW = 12
"""Largest number of values that are listed one by one."""
COLUMNS = ("landmark", "computed", "expected", "source", "difference", "verdict")
STYLE = """
:root { color-scheme: light dark; --ink: #1c1e21; --soft: #5c6269; --line: #d9dce0;
  --paper: #ffffff; --good: #1d6b3a; --claim: #8a4b00; --bad: #b00020; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e7e9; --soft: #a3a9b1; --line: #3a3e44;
  --paper: #17191c; --good: #7cd09b; --claim: #f0b05e; --bad: #ff8a95; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.5rem 1.2rem 4rem; max-width: 62rem; background: var(--paper);
  color: var(--ink); font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; }
h1 { font-size: 1.7rem; line-height: 1.25; margin: 1rem 0 0.6rem; }
h2 { font-size: 1.25rem; line-height: 1.3; margin: 0 0 0.5rem; }
code { font-size: 0.92em; }
h3 { font-size: 1rem; margin: 1.6rem 0 0.3rem; }
p { margin: 0.5rem 0; max-width: 46rem; }
a { color: inherit; }
section { margin-top: 3rem; padding-top: 1.5rem; border-top: 1px solid var(--line); }
ol, ul { padding-left: 1.9rem; }
li { margin: 0.15rem 0; }
figure { margin: 1rem 0; }
figcaption { color: var(--soft); font-size: 0.92rem; }
img { display: block; width: 100%; max-width: 50rem; height: auto; margin: 0 0 0.3rem;
  padding: 0.5rem; background: #ffffff; border: 1px solid var(--line); border-radius: 4px; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 0.1rem 1.2rem; margin: 0.6rem 0;
  font-size: 0.92rem; }
dt { color: var(--soft); }
dd { margin: 0; }
table { border-collapse: collapse; width: 100%; font-size: 0.88rem; line-height: 1.4; }
th, td { padding: 0.28rem 0.7rem 0.28rem 0; border-bottom: 1px solid var(--line);
  text-align: left; vertical-align: top; }
th { color: var(--soft); font-weight: 600; }
td.number { font-variant-numeric: tabular-nums; white-space: nowrap; }
td:nth-child(4), td:nth-child(6) { min-width: 6.5rem; }
.good { color: var(--good); } .claim { color: var(--claim); } .bad { color: var(--bad); }
.bad { font-weight: 700; }
.small { color: var(--soft); font-size: 0.9rem; }
pre { white-space: pre-wrap; overflow-wrap: anywhere; }
@media (max-width: 44rem) {
  dl { grid-template-columns: 1fr; } dd { margin: 0 0 0.3rem; }
  thead { display: none; }
  tr { display: block; padding: 0.4rem 0; border-bottom: 1px solid var(--line); }
  td { display: grid; grid-template-columns: 6.5rem 1fr; padding: 0.05rem 0; border: 0; }
  td::before { content: attr(data-label); color: var(--soft); }
  td:first-child { display: block; font-weight: 600; } td:first-child::before { content: none; }
}
@media print {
  :root { --ink: #000; --soft: #444; --line: #bbb; --paper: #fff; --good: #000; --claim: #000;
    --bad: #000; }
  body { max-width: none; padding: 0; font-size: 10.5pt; }
  section { break-before: page; border: 0; margin: 0; }
  table { font-size: 8.5pt; } td.number { white-space: normal; }
  figure, tr, dl { break-inside: avoid; } h2, h3 { break-after: avoid; }
}
"""


@dataclass(frozen=True)
class Section:
    """What the page says about one study; ``error`` where it failed."""

    name: str
    document: str
    error: str = ""
    parameters: Sequence[tuple[str, str]] = ()
    pictures: Sequence[bytes] = field(default=(), repr=False)
    """That on our axes, and that on the axes of the source where these are others."""
    archive: str = ""
    landmarks: Sequence[Landmark] = ()
    claims: Sequence[Claim] = ()
    findings: Sequence[Finding] = ()

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
        rows.append(("structure", _structure(json.loads(dataset.attrs["problem"]))))
    described = {name: (units, long_name) for name, (units, long_name, *_) in PARAMETERS.items()}
    for name in NORMAL_SIDE & dataset.variables.keys():
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


def _structure(problem: dict) -> str:
    excitation, count = problem["excitation"], problem["n_dof"]
    blades = "one blade" if count == 1 else f"ring of {count} blades"
    if excitation["type"] == "EngineOrder":
        return f"{blades}, travelling wave of an engine order"
    if "dof" not in excitation:
        return f"structure of {count} degrees of freedom"
    return blades if count == 1 else f"{blades}, force on blade {excitation['dof']}"


def _values(values: np.ndarray, units: str) -> str:
    different = np.unique(values[np.isfinite(values)])
    if len(different) > FEW:
        return f"{len(different)} values, {_span(different, units)}"
    return f"{', '.join(map(number, different))} {UNITS.get(units, units)}".rstrip()


def _span(values: np.ndarray, units: str) -> str:
    low, high = np.nanmin(values), np.nanmax(values)
    text = number(low) if low == high else f"{number(low)} to {number(high)}"
    return f"{text} {UNITS.get(units, units)}".rstrip()


def page(sections: Sequence[Section]) -> str:
    """Return the page as HTML."""
    contents = "".join(
        f'<li><a href="#{escape(one.name)}">{escape(one.title)}</a>{_state(one)}</li>'
        for one in sections
    )
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<link rel="icon" href="data:,">\n'
        f"<title>{escape(TITLE)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        f"<header><h1>{escape(TITLE)}</h1>\n<p>The figures of the source, computed anew, and what "
        "they were checked against: values published, exact, or in closed form, and what the "
        "source says in words, weighed by exact computation. Of the figures of the source only "
        "captions, tick labels and what its text says are known here, not the lines. Decibels are "
        "relative to 1 m, which is a reading: the source gives no reference. Every "
        'computed number is read from the archives beside this page.</p>\n<p class="small">Source: '
        f"{escape(SOURCE)}. "
        f"Computed with symhbm {escape(version('symhbm'))}.</p></header>\n"
        f"<main>\n<nav><h3>Contents</h3>\n<ol>{contents}</ol>\n"
        + _readings()
        + _claims(sections)
        + "</nav>\n"
        + "\n".join(map(_section, sections))
        + "\n</main>\n</body>\n</html>\n"
    )


def _readings() -> str:
    """How the source is read where it leaves something open."""
    lines = "".join(
        f"<li><strong>{_text(where)}</strong> {_text(words)}.</li>\n" for where, words in READINGS
    )
    return f"<h3>How the source is read</h3>\n<ul>\n{lines}</ul>\n"


def _claims(sections: Sequence[Section]) -> str:
    """What the source says, weighed, those first that do not hold; and what it is silent about."""
    lists = ""
    for heading, holds in (("do not hold", False), ("hold", True)):
        lines = "".join(
            f"<li>{_link(one)}: {_text(claim.words)}. <em>{_text(claim.computed)}.</em></li>\n"
            for one in sections
            for claim in one.claims
            if claim.holds is holds
        )
        lists += (
            f"<h3>Claims of the source that {heading}</h3>\n<ul>\n{lines}</ul>\n" if lines else ""
        )
    findings: dict[str, list[str]] = {}
    for one in sections:
        for finding in one.findings:
            line = f"<li>{_link(one)}: {_text(finding.computed)}</li>\n"
            findings.setdefault(finding.words, []).append(line)
    ours = "".join(
        f"<p>{_text(words)}:</p>\n<ul>\n{''.join(lines)}</ul>\n"
        for words, lines in findings.items()
    )
    return lists + (f"<h3>Findings of these studies</h3>\n{ours}" if ours else "")


def _link(section: Section) -> str:
    return f'<a href="#{escape(section.name)}">{escape(section.title.partition(":")[0])}</a>'


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
    for text in section.paragraphs:
        style = ' class="small"' if text.startswith("Reference: ") else ""
        start += f"<p{style}>{_text(text)}</p>\n"
    if section.error:
        failed = '<p class="bad">This study failed:</p>'
        return f"{start}{failed}\n<pre>{escape(section.error)}</pre>\n</section>"
    named = "".join(
        f"<dt>{escape(name)}</dt><dd>{_text(value)}</dd>" for name, value in section.parameters
    )
    archive = escape(section.archive)
    return (
        f"{start}{_pictures(section)}"
        f"<h3>Parameters</h3>\n<dl>{named}</dl>\n"
        f"<h3>Landmarks</h3>\n{_table(section.landmarks)}\n{_weighed(section.claims)}"
        f'<p class="small">Archive: <a href="{archive}">{archive}</a></p>\n</section>'
    )


def _pictures(section: Section) -> str:
    """That on the axes of the source first, as a reader of it looks for that."""
    captions = ("Beside it, on axes of our own", "On the axes of the source")
    shown = ""
    for caption, picture in reversed([*zip(captions, section.pictures, strict=False)]):
        image = b64encode(picture).decode()
        shown += f'<figure><img alt="{escape(section.title)}" src="data:image/png;base64,{image}">'
        if len(section.pictures) > 1:
            shown += f"<figcaption>{caption}</figcaption>"
        shown += "</figure>\n"
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
