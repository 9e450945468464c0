"""Commands that take numbers out of an archive, and put what is missing into it."""

import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import click

import symhbm as sh
from symhbm.cli.commands import archive_argument, main, select_option
from symhbm.cli.pieces import completeness
from symhbm.cli.selection import select
from symhbm.cli.table import TABLES, rows, write
from symhbm.cli.terminal import check_place, final_name, opened, say, whole
from symhbm.results.archive import SUFFIX
from symhbm.workers import attend


@main.command()
@archive_argument
@click.option(
    "--table",
    type=click.Choice(TABLES),
    default="points",
    show_default=True,
    help="What a row is: a point, a peak, an event, or a parameter set with its status.",
)
@select_option
@click.option(
    "--variables",
    metavar="NAME,NAME",
    help="Variables to write. By default all that belong to the rows but the Fourier "
    "coefficients; all means these as well.",
)
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="File to write, whole or not at all; by default standard output.",
)
def export(
    archive: Path,
    table: str,
    choices: tuple[str, ...],
    variables: str | None,
    output: Path | None,
) -> None:
    """Write a table of ARCHIVE as comma-separated values.

    The first line names the columns with their units, as in "amplitude_3 [m]" for blade 3 or
    "coefficient_dof0_h1_cos [m]" for a Fourier coefficient; columns that place a row (parameter
    values, frequency) come first. Numbers have all their digits, a value that is not known is
    an empty field. pandas, Excel and numpy.genfromtxt(..., delimiter=",") read it.

    \b
    Examples:
      symhbm export blade.nc --output blade.csv
      symhbm export blade.nc --table peaks
      symhbm export disk.nc --select sample=0 --select frequency=200:220 --variables amplitude
    """
    wanted = None if variables is None else [name.strip() for name in variables.split(",")]
    check_place(output)
    with opened(archive) as dataset:
        selection = select(dataset, choices)
        lines: Iterator[Any] = rows(selection, table, wanted)
        if output is None:
            written = write(lines, sys.stdout)
        else:
            with whole(output) as file:
                written = write(lines, file)
            click.echo(output)
        complete, waiting, failed = completeness(selection.dataset)
    incomplete = waiting + failed.total()
    if written == 0:
        say("symhbm export: no rows, the table has its header alone")
    if incomplete and table != "sets":
        total = complete + incomplete
        say(f"symhbm export: {incomplete} of {total} curves are incomplete, --table sets says why")


@main.command()
@archive_argument
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes that compute; by default one for each core.",
)
@click.option("--no-progress", is_flag=True, help="Show no bar.")
def resume(archive: Path, workers: int | None, no_progress: bool) -> None:
    """Finish the interrupted run that should have become ARCHIVE.

    Whatever was complete is kept, the other curves are computed as they would have been. ARCHIVE
    is the name that was asked for, or that of the working file beside it, ARCHIVE.partial. The
    run may be interrupted and resumed again at any time.

    \b
    Examples:
      symhbm resume disk.nc
      symhbm resume disk.nc.partial --workers 4
    """
    target = archive.with_name(final_name(archive))
    working = target.with_name(target.name + SUFFIX)
    if not working.exists():
        if not target.exists():
            raise FileNotFoundError(f"{str(target)!r}: no such file, nor {working.name}")
        click.echo(f"{target}: complete, there is nothing to resume, nothing was computed")
        return
    with opened(working) as dataset:
        complete, waiting, failed = completeness(dataset)
    total = complete + waiting + failed.total()
    count = min(workers or os.cpu_count() or 1, waiting)
    progress = not no_progress and sys.stderr.isatty()
    pool = ProcessPoolExecutor(count, initializer=attend) if count > 1 else None
    try:
        with sh.resume(target, executor=pool, progress=progress) as dataset:
            _, left, failed = completeness(dataset)
    except KeyboardInterrupt as interrupt:
        if not hasattr(interrupt, "__notes__"):
            interrupt.add_note(f"symhbm: interrupted; what is complete is kept in {working}")
        raise
    finally:
        if pool is not None:
            pool.shutdown(cancel_futures=True)
    click.echo(
        f"{total - waiting} of {total} curves were there, {waiting - left} computed, "
        f"{failed.total()} of all are incomplete"
    )
    click.echo(target)
