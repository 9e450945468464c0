"""The command ``symhbm import``."""

import warnings
from pathlib import Path

import click

import symhbm as sh
from symhbm.cli import terminal


@click.command("import")
@click.argument(
    "files", metavar="FILE...", nargs=-1, required=True, type=click.Path(path_type=Path)
)
@click.option(
    "--units",
    metavar="LENGTH-MASS-TIME",
    help="Units of the files, as mm-t-s. By default those in which the materials of a deck are "
    "metals, else m-kg-s.",
)
@terminal.output_option("File to write, a name ending in .nc or .h5.", required=True)
@terminal.overwrite_option
def import_(files: tuple[Path, ...], units: str | None, output: Path, overwrite: bool) -> None:
    """Make one file of a structure of what a finite-element program wrote in FILES.

    FILES are those that sh.read_structure takes: a file of matrices, or the decks of one or several
    jobs of CalculiX of the same mesh. One job has the matrices, at rest or at a speed; several of
    them make a structure that turns. Another one may have the natural modes that the program
    computed itself, of a sector in waves of nodal diameters.

    An account is printed: mass and centre, supports, the sides and the axis of a sector,
    frequencies beside those of the program, and what was dropped. Lines that begin with LOOK are
    doubts.

    \b
    Examples:
      symhbm import sector.inp --output sector.nc
      symhbm import still.inp at9000.inp modes.inp --output sector.nc
      symhbm import sector_stiffness.mtx --units mm-t-s --output sector.h5
    """
    terminal.check_place(output)
    if output.exists() and not overwrite:
        raise FileExistsError(f"--output {output}: there is such a file; --overwrite replaces it")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        structure = sh.read_structure(files[0] if len(files) == 1 else files, units=units)
    program = getattr(structure.places, "program", None)
    told = [str(warning.message) for warning in caught] if program is None else program.account
    sh.save_structure(structure, output, overwrite=overwrite)
    for line in (*told, output):
        terminal.say(line, err=False)
