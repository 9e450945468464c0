"""The command ``symhbm export``."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

import symhbm as sh
from symhbm.cli import terminal
from symhbm.cli.selection import Selection, rows, select, write
from symhbm.results.archive import draft_of
from symhbm.results.reading import KINDS, At, completeness

_OTHER = (".xlsx", ".xls", ".ods", ".nc", ".h5", ".mat", ".json", ".parquet", ".png")
"""Endings of files that are no text of comma-separated values."""


@click.command()
@terminal.archive_argument
@click.option(
    "--table",
    type=click.Choice(KINDS),
    default="points",
    show_default=True,
    help="What a row is: a point, a peak, an event, or a parameter set with its status.",
)
@terminal.select_option
@terminal.at_option
@click.option(
    "--variables",
    metavar="NAME,NAME",
    help="Variables to write. By default all that belong to the rows but the Fourier "
    "coefficients; all means these as well.",
)
@terminal.output_option("File to write, whole or not at all; by default, or as -, standard output.")
def export(
    archive: Path,
    table: str,
    choices: tuple[str, ...],
    at: At | None,
    variables: str | None,
    output: Path | None,
) -> None:
    """Write a table of ARCHIVE as comma-separated values.

    The first line names the columns with their units, as in "amplitude_tip:z [m]" for a place,
    "amplitude_3 [m]" for blade 3 or "coefficient_dof0_h1_cos [m]" for a Fourier coefficient;
    columns that place a row (parameter values, frequency) come first. Numbers have all their
    digits, a value that is not known is an empty field. pandas, Excel and
    numpy.genfromtxt(..., delimiter=",") read it.

    \b
    Examples:
      symhbm export blade.nc --output blade.csv
      symhbm export blade.nc --table peaks
      symhbm export blade.nc --at peak
      symhbm export disk.nc --select sample=0 --select frequency=200:220 --variables amplitude
    """
    wanted = None if variables is None else [name.strip() for name in variables.split(",")]
    if str(output) == "-":
        output = None
    terminal.check_place(output)
    if output is not None and output.suffix in _OTHER:
        raise ValueError(
            f"--output {output}: expected a name ending in .csv, what is written is "
            "comma-separated values"
        )
    with terminal.opened(archive) as dataset:
        selection = select(dataset, choices)
        if at is not None:
            part = selection.limited(selection.dataset)
            selection = Selection(sh.datasets.at(part, at))
        lines: Iterator[Any] = rows(selection, table, wanted)
        if output is None:
            written = write(lines, sys.stdout)
        else:
            with draft_of(output) as draft, draft.open("w", encoding="utf-8", newline="") as file:
                written = write(lines, file)
            terminal.say(output, err=False)
        complete, waiting, failed = completeness(selection.dataset)
    incomplete = waiting + failed.total()
    if written == 0:
        terminal.say("symhbm export: no rows, the table has its header alone")
    if incomplete and table != "sets":
        total = complete + incomplete
        terminal.say(
            f"symhbm export: {incomplete} of {total} curves are incomplete, --table sets says why"
        )
