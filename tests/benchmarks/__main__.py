"""How fast symhbm is, in ratios of one run: ``python -m tests.benchmarks``."""

import os

# Before NumPy is imported.
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import click  # noqa: E402

from tests.benchmarks import comparison, contacts, own, scale, structures  # noqa: E402
from tests.benchmarks.table import machine, write  # noqa: E402

MEASUREMENTS = {
    "blade": comparison.blade,
    "ring": comparison.ring,
    "opening": comparison.opening,
    "contacts": contacts.contacts,
    "penalty": contacts.penalty,
    "step": own.step,
    "structures": structures.structures,
    "ensemble": own.ensemble,
    "processes": own.processes,
    "growth": own.growth,
    "start": own.start,
    "scale": scale.scale,
}


@click.command()
@click.argument("measurements", nargs=-1, type=click.Choice([*MEASUREMENTS]))
@click.option("--write", "written", is_flag=True, help="Put the tables into docs/benchmarks.md.")
def main(measurements: tuple[str, ...], written: bool) -> None:
    """Measure CPU times of MEASUREMENTS, by default all, and print them as Markdown tables."""
    sections = [f"Measured by `python -m tests.benchmarks` on {machine()}"]
    click.echo(sections[0])
    for measurement in measurements or MEASUREMENTS:
        for table in MEASUREMENTS[measurement]():
            sections.append(str(table))
            click.echo(f"\n{table}")
    if written:
        write("\n\n".join(sections))


if __name__ == "__main__":
    main()
