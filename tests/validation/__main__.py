"""Everything that is checked, computed anew, as HTML and PDF: ``python -m tests.validation``."""

import os

# Before NumPy is imported.
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import sys  # noqa: E402
from collections.abc import Iterable, Sequence  # noqa: E402
from pathlib import Path  # noqa: E402

import click  # noqa: E402

from studies.__main__ import STUDIES  # noqa: E402
from studies.run import RESULTS  # noqa: E402
from tests.validation import exact, of_cases, of_studies, page, paper, published  # noqa: E402
from tests.validation.comparison import Part, Verdict  # noqa: E402
from tests.validation.document import Document, command_line, now  # noqa: E402
from tests.validation.margins import margins  # noqa: E402


def report(quick: bool, studies: Iterable[str], output: Path) -> Document:
    """Compute all comparisons; write ``validation.html`` and ``validation.pdf``."""
    output.mkdir(parents=True, exist_ok=True)
    begun, parts = now(), []
    compared = exact.parts(quick), published.parts(quick), of_cases.parts(quick)
    for each in (*compared, of_studies.parts(studies, output)):
        for part in each:
            parts.append(part)
            click.echo(told(part))
    return write(parts, quick, output, begun)


def told(part: Part) -> str:
    """A part in a line."""
    counts = ", ".join(f"{part.count(verdict)} {verdict}" for verdict in Verdict)
    return f"{part.title}: {counts}"


def write(parts: Sequence[Part], quick: bool, output: Path, made: str) -> Document:
    """Write both files, and tell what failed."""
    drawn = margins(parts, output / "validation_margins.png")
    document = Document(parts, drawn, command_line(), made, quick)
    (output / "validation.html").write_text(page.page(document), encoding="utf-8")
    click.echo(str(output / "validation.html"))
    click.echo(str(paper.write(document, output / "validation.pdf")))
    for part, row in document.failed:
        line = f"{part.title}: {row.what}: found {row.found}, expected {row.expected}"
        click.echo(f"FAILED: {line} ({row.difference})", err=True)
    click.echo(document.result)
    return document


@click.command()
@click.argument("studies", nargs=-1, type=click.Choice([*STUDIES]))
@click.option("--quick", is_flag=True, help="A few studies and points: a minute of CPU time.")
@click.option("--output", type=click.Path(path_type=Path), default=RESULTS, show_default="results")
def main(studies: tuple[str, ...], quick: bool, output: Path) -> None:
    """Compare with all that is exact, published or of other programs; with STUDIES, or all."""
    document = report(quick, studies or of_studies.chosen(quick), output)
    sys.exit(int(document.count(Verdict.FAILED) > 0))


if __name__ == "__main__":
    main()
