"""The command ``symhbm view``."""

from contextlib import ExitStack
from pathlib import Path

import click

import symhbm as sh
from symhbm.cli import terminal
from symhbm.cli.selection import select
from symhbm.model.files import is_structure


@click.command()
@terminal.archives_argument
@terminal.label_option
@terminal.select_option
@click.option(
    "--tuned",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Archive of the tuned structure: shows the amplification of an ensemble.",
)
@terminal.output_option("Page to write, .html; by default ARCHIVE.html beside ARCHIVE.")
def view(
    archives: tuple[Path, ...],
    labels: tuple[str, ...],
    choices: tuple[str, ...],
    tuned: Path | None,
    output: Path | None,
) -> None:
    """Write one page to look into ARCHIVE with a browser, and print its path.

    Of several archives, what differs is told, and their curves are drawn over the same axes.

    The page needs no network and no server, and has at most 15 MB: curves with menus for swept
    parameters and places, what every point tells under the pointer, peaks and events with loops
    of contacts and shapes of the motion, bands of ensembles, nonlinear modes and limit cycles,
    tables, parameters and provenance. Large archives are thinned, and the page tells to what.

    Of a structure that symhbm import made the page shows the mesh, and what import found.

    It needs plotly: pip install 'symhbm[view]'.

    \b
    Examples:
      symhbm view blade.nc
      symhbm view built.nc thicker.nc --label "as built" --label "thicker shroud"
      symhbm view disks.nc --tuned tuned.nc --output disks.html
      symhbm view disk.nc --select sample=0:20
    """
    names, archive = terminal.names_of(archives, labels), archives[0]
    output = output or archive.with_name(f"{Path(terminal.final_name(archive)).stem}.html")
    terminal.check_place(output)
    if len(archives) == 1 and is_structure(archive):
        sh.view(sh.read_structure(archive), output, name=terminal.final_name(archive))
        terminal.say(output, err=False)
        return
    with ExitStack() as files:
        parts = [
            selection.limited(selection.dataset)
            for selection in (
                select(files.enter_context(terminal.opened(path)), choices) for path in archives
            )
        ]
        reference = None if tuned is None else files.enter_context(terminal.opened(tuned))
        shown = dict(zip(names, parts, strict=True)) if len(parts) > 1 else parts[0]
        sh.view(shown, output, tuned=reference, name=terminal.final_name(archive))
    terminal.say(output, err=False)
