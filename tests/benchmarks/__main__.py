"""How fast symhbm is, in ratios of one run: ``python -m tests.benchmarks``."""

import os
from pathlib import Path

# Before NumPy is imported.
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import click  # noqa: E402

from tests.benchmarks import (  # noqa: E402
    comparison,
    contacts,
    elements,
    own,
    releases,
    scale,
    structures,
)
from tests.benchmarks.table import PAGE, SCALE, machine, write  # noqa: E402

MEASUREMENTS = {
    "blade": comparison.blade,
    "ring": comparison.ring,
    "opening": comparison.opening,
    "contacts": contacts.contacts,
    "penalty": contacts.penalty,
    "step": own.step,
    "structures": structures.structures,
    "elements": elements.elements,
    "ensemble": own.ensemble,
    "processes": own.processes,
    "growth": own.growth,
    "start": own.start,
    "scale": scale.scale,
}


@click.command()
@click.argument("measurements", nargs=-1, type=click.Choice([*MEASUREMENTS]))
@click.option("--write", "written", is_flag=True, help="Put the tables into docs.")
def main(measurements: tuple[str, ...], written: bool) -> None:
    """Measure CPU times of MEASUREMENTS, by default all, and print them as Markdown tables."""
    click.echo(f"Measured on {machine()}")
    pages: dict[Path, list[str]] = {}
    for measurement in measurements or MEASUREMENTS:
        page, command = (SCALE, " scale") if measurement == "scale" else (PAGE, "")
        first = f"Measured by `python -m tests.benchmarks{command}` on {machine()}"
        sections = pages.setdefault(page, [first])
        for table in MEASUREMENTS[measurement]():
            sections.append(str(table))
            click.echo(f"\n{table}")
    if written:
        for page, sections in pages.items():
            write("\n\n".join(sections), page)
        if PAGE in pages:
            releases.keep()


if __name__ == "__main__":
    main()
