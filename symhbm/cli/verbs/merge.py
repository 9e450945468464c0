"""The command ``symhbm merge``."""

from pathlib import Path

import click

from symhbm.cli import terminal
from symhbm.results.archive import merged


@click.command()
@click.argument(
    "parts", metavar="PART...", nargs=-1, required=True, type=click.Path(path_type=Path)
)
@terminal.output_option("The archive to write.", required=True)
@terminal.overwrite_option
@click.option(
    "--unfinished",
    is_flag=True,
    help="Take what there is of parts that are still computed or were interrupted, PART.partial.",
)
@terminal.progress_option
def merge(
    parts: tuple[Path, ...], output: Path, overwrite: bool, unfinished: bool, progress: bool
) -> int:
    """Make one archive of the PARTs of a sweep, equal bit by bit to that of one job.

    Parts are what `frf` and `follow` compute with part=, each in a job of its own. They may come in
    any order, and overlap where their values are the same. Parts that are damaged, unfinished or of
    another computation are named, and nothing is written.

    Where parts are missing, what there is becomes OUTPUT.partial, the missing parameter sets are
    named, and the exit code is 1; `symhbm resume OUTPUT` computes them.

    \b
    Examples:
      symhbm merge part*.nc --output disks.nc
      symhbm merge part*.nc --output so-far.nc --unfinished
    """
    terminal.check_place(output)
    try:
        summary = merged(
            parts, output, overwrite=overwrite, unfinished=unfinished, progress=progress
        )
    except FileExistsError as error:
        text = str(error).replace("overwrite=True", "--overwrite")
        raise FileExistsError(text) from error
    twice = f", {summary.n_repeated} of them twice" if summary.n_repeated else ""
    terminal.say(
        f"{summary.n_done} of {summary.n_sets} parameter sets from {summary.n_parts} parts{twice}",
        err=False,
    )
    terminal.say(summary.path, err=False)
    if not summary.missing:
        return 0
    terminal.say(f"symhbm merge: {summary.missing}; symhbm resume {output} computes them")
    return terminal.BROKEN
