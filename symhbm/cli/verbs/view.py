"""The command ``symhbm view``."""

from contextlib import ExitStack
from pathlib import Path

import click

import symhbm as sh
from symhbm.cli import terminal
from symhbm.cli.selection import select


@click.command()
@terminal.archive_argument
@terminal.select_option
@click.option(
    "--tuned",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Archive of the tuned structure: shows the amplification of an ensemble.",
)
@terminal.output_option("Page to write, .html; by default ARCHIVE.html beside ARCHIVE.")
def view(archive: Path, choices: tuple[str, ...], tuned: Path | None, output: Path | None) -> None:
    """Write one page to look into ARCHIVE with a browser, and print its path.

    The page needs no network and no server, and has at most 15 MB: curves with menus for swept
    parameters and places, what every point tells under the pointer, peaks and events with loops
    of contacts and shapes of the motion, bands of ensembles, nonlinear modes and limit cycles,
    tables, parameters and provenance. Large archives are thinned, and the page tells to what.

    It needs plotly: pip install 'symhbm[view]'.

    \b
    Examples:
      symhbm view blade.nc
      symhbm view disks.nc --tuned tuned.nc --output disks.html
      symhbm view disk.nc --select sample=0:20
    """
    output = output or archive.with_name(f"{Path(terminal.final_name(archive)).stem}.html")
    terminal.check_place(output)
    with ExitStack() as files:
        selection = select(files.enter_context(terminal.opened(archive)), choices)
        reference = None if tuned is None else files.enter_context(terminal.opened(tuned))
        part = selection.limited(selection.dataset)
        sh.view(part, output, tuned=reference, name=terminal.final_name(archive))
    terminal.say(output, err=False)
