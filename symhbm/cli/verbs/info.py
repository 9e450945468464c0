"""The command ``symhbm info``."""

from pathlib import Path

import click

import symhbm as sh
from symhbm.cli.terminal import archive_argument, opened, say
from symhbm.model.files import is_structure
from symhbm.results.telling import as_text
from symhbm.workers import amount


@click.command()
@archive_argument
def info(archive: Path) -> None:
    """Tell what is in ARCHIVE, in words.

    Says what was computed (structure, parameters, excitation, harmonics), how much of it is
    complete and what failed and why, what came out (highest peak, events, contacts that slip,
    dissipation), and how far to trust it (largest residual, truncation error). An unfinished
    run, ARCHIVE.partial, tells how many curves are still to come.

    Of a structure that symhbm import made it prints the account that import printed.

    Peaks are local maxima over the band; the largest response is printed as well where it is none,
    as at an end of the band. "mistuned" and "swept" mark parameters that differ between blades
    or contacts, and between curves.

    \b
    Examples:
      symhbm info blade.nc
      symhbm info disk.nc.partial
    """
    if is_structure(archive):
        structure = sh.read_structure(archive)
        program = getattr(structure.places, "program", None)
        say("\n".join([repr(structure), *(program.account if program else ())]), err=False)
        return
    with opened(archive) as dataset:
        say(f"{'archive':<23} {archive}, {amount(archive.stat().st_size)}", err=False)
        say(as_text(dataset), err=False)
