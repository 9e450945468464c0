"""The report as one page of HTML without any outside resource."""

from html import escape
from pathlib import Path

from studies.index import POLICY, _text
from studies.page_pictures import embedded
from studies.page_style import STYLE
from tests.validation.comparison import Comparison, Part, Verdict
from tests.validation.document import COLUMNS, NOT_COVERED, SCOPE, TITLE, Document

KINDS = {Verdict.PASSED: "good", Verdict.FAILED: "bad", Verdict.MISSING: "claim"}


def page(document: Document) -> str:
    """Return the page."""
    made = "".join(
        f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>" for name, value in document.circumstances
    )
    state = "bad" if document.count(Verdict.FAILED) else "good"
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<link rel="icon" href="data:,">\n'
        f"<title>{TITLE}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        f'<header><h1>{TITLE}</h1>\n<p class="{state}">{escape(document.result)}</p>\n'
        f'<dl>{made}</dl>\n<p>The same on pages: <a href="validation.pdf">PDF</a>.</p></header>\n'
        f"<main>\n{_failures(document)}"
        f"<section><h2>Scope</h2>\n{''.join(f'<p>{_text(one)}</p>' for one in SCOPE)}</section>\n"
        "<section><h2>What is not covered</h2>\n<ul>"
        f"{''.join(f'<li>{_text(one)}</li>' for one in NOT_COVERED)}</ul></section>\n"
        f"<section><h2>Summary</h2>\n{_summary(document)}\n"
        f"<p>{_text(document.margins.words)}</p>\n"
        f"{_picture(document.margins.picture, 'Differences over what is allowed')}</section>\n"
        + "".join(_part(part, number) for number, part in enumerate(document.parts))
        + "</main>\n</body>\n</html>\n"
    )


def _failures(document: Document) -> str:
    """All that failed, before anything else."""
    if not document.failed:
        return ""
    lines = "".join(
        f"<li><strong>{_text(part.title)}</strong>: {_text(row.what)}: found "
        f"{_text(row.found)}, expected {_text(row.expected)} ({_text(row.difference)})</li>"
        for part, row in document.failed
    )
    return f'<section><h2 class="bad">What failed</h2>\n<ul>{lines}</ul></section>\n'


def _summary(document: Document) -> str:
    columns = ("part", *KINDS, "CPU time")
    head = "".join(f'<th scope="col">{column}</th>' for column in columns)
    rows = ""
    for number, part in enumerate(document.parts):
        title = f'<a href="#part-{number}">{_text(part.title)}</a>'
        counts = (
            f'<td data-label="{kind}" class="number {style if part.count(kind) else ""}">'
            f"{part.count(kind)}</td>"
            for kind, style in KINDS.items()
        )
        cpu = f'<td data-label="CPU time" class="number">{part.seconds:.1f} s</td>'
        rows += f'<tr><td data-label="part">{title}</td>{"".join(counts)}{cpu}</tr>\n'
    return f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table>"


def _part(part: Part, number: int) -> str:
    head = "".join(f'<th scope="col">{column}</th>' for column in COLUMNS)
    body = "".join(f"<tr>{_cells(row)}</tr>\n" for row in part.rows)
    pictures = "".join(_picture(picture, part.title) for picture in part.pictures)
    return (
        f'<section id="part-{number}">\n<h2>{_text(part.title)}</h2>\n<p>{_text(part.words)}</p>\n'
        f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody>\n</table>\n"
        f"{pictures}</section>\n"
    )


def _picture(picture: Path, words: str) -> str:
    address, width, height = embedded(picture)
    size = f'width="{width}" height="{height}"'
    return f'<figure><img alt="{escape(words)}" {size} src="{address}"></figure>\n'


def _cells(row: Comparison) -> str:
    texts = (row.what, row.source, row.tolerance, row.found, row.expected, row.difference)
    cells = "".join(
        f'<td data-label="{column}">{_text(text)}</td>'
        for column, text in zip(COLUMNS, texts, strict=False)
    )
    style = KINDS[row.verdict]
    return f'{cells}<td data-label="verdict" class="{style}"><strong>{row.verdict}</strong></td>'
