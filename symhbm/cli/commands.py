"""The command line ``symhbm``: for those who have an archive and no script."""

import json
import os
import sys
from pathlib import Path

import click

import symhbm as sh
from symhbm.audit import FIGURES
from symhbm.cli.picture import KINDS, draw
from symhbm.cli.terminal import (
    BROKEN,
    Program,
    bound,
    check_place,
    final_name,
    number,
    opened,
    size,
)
from symhbm.cli.words import describe
from symhbm.verify import summary

_PICTURES = ("png", "pdf", "svg")
archive_argument = click.argument("archive", metavar="ARCHIVE", type=click.Path(path_type=Path))
select_option = click.option(
    "--select",
    "choices",
    multiple=True,
    metavar="NAME=VALUE",
    help="Only this part: normal_load=3, sample=0,4 or frequency=100:200 (ends included). Names "
    "are the dimensions of the archive; those without labels count from 0. May be repeated.",
)


@click.group(
    cls=Program,
    no_args_is_help=False,
    context_settings=dict(help_option_names=["-h", "--help"], max_content_width=100),
)
@click.version_option(package_name="symhbm", message="%(prog)s %(version)s")
def main() -> None:
    """Forced response of bladed disks with dry friction: what to do with an archive.

    An archive is the NetCDF file (.nc) that a computation leaves behind. A look at one usually
    goes like this:

    \b
      symhbm info blade.nc                        what is in it, in words
      symhbm plot blade.nc                        a picture beside it
      symhbm verify blade.nc                      every stored point, recomputed
      symhbm export blade.nc --output b.csv    the numbers, for other programs

    A computation that was interrupted leaves a working file, blade.nc.partial. It can be looked
    at in the same way, and `symhbm resume blade.nc` computes what is missing.

    Amplitudes are in m, frequencies in Hz, all other values in SI units.

    Exit codes: 0 done; 1 a bound of a verification is broken; 2 bad input, with one line on
    stderr that says what is allowed; 130 interrupted.
    """


@main.command()
@archive_argument
def info(archive: Path) -> None:
    """Tell what is in ARCHIVE, in words.

    Says what was computed (structure, parameters, excitation, harmonics), how much of it is
    complete and what failed and why, what came out (highest peak, events, contacts that slip,
    dissipation), and how far to trust it (largest residual, truncation error). An unfinished
    run, ARCHIVE.partial, tells how many curves are still to come.

    Peaks are local maxima over the band; the largest response is told as well where it is none,
    as at an end of the band. "mistuned" and "swept" mark parameters that differ between blades
    or contacts, and between curves.

    \b
    Examples:
      symhbm info blade.nc
      symhbm info disk.nc.partial
    """
    with opened(archive) as dataset:
        click.echo(f"{'archive':<23} {archive}, {size(archive.stat().st_size)}")
        click.echo(describe(dataset))


@main.command()
@archive_argument
@click.option(
    "--kind",
    type=click.Choice(KINDS),
    help="What to draw. By default hysteresis for a motion in time, envelope for an ensemble, "
    "disk for one point of a disk, else response.",
)
@select_option
@click.option("--dof", type=int, help="The blade (degree of freedom) to show, from 0.")
@click.option("--contact", type=int, help="The contact to show, from 0.")
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help=f"Picture to write, .{', .'.join(_PICTURES)}; by default ARCHIVE_KIND.png beside ARCHIVE.",
)
def plot(
    archive: Path,
    kind: str | None,
    choices: tuple[str, ...],
    dof: int | None,
    contact: int | None,
    output: Path | None,
) -> None:
    """Draw a picture of ARCHIVE and print its path.

    \b
      response    amplitude over the frequency (or what was followed), a line per parameter set
      envelope    an ensemble of responses as bands
      disk        the response around the disk
      blades      the response of every blade
      hysteresis  friction force over relative displacement
      stick-map   where contacts stick and where they slip
      model       the structure and the force on it

    \b
    Examples:
      symhbm plot blade.nc
      symhbm plot blade.nc --select normal_load=1,3 --output loads.pdf
      symhbm plot disk.nc --kind response --select sample=0 --dof 3
    """
    if output is not None and output.suffix.lstrip(".").lower() not in _PICTURES:
        raise ValueError(f"--output {output}: expected a name ending in .{', .'.join(_PICTURES)}")
    check_place(output)
    with opened(archive) as dataset:
        options = {k: v for k, v in (("dof", dof), ("contact", contact)) if v is not None}
        # The picture goes to a file, whatever screen there is.
        os.environ["MPLBACKEND"] = "agg"
        kind, figure = draw(dataset, kind, choices, options)
    output = output or archive.with_name(f"{Path(final_name(archive)).stem}_{kind}.png")
    figure.savefig(output)
    figure.clear()
    click.echo(output)


@main.command()
@archive_argument
@click.option(
    "--points", default="all", metavar="all|N", help="Points to check, evenly spread. Default all."
)
@click.option(
    "--exact",
    default="4",
    metavar="all|none|N",
    help="Points to compare with the exact periodic motion, up to a second each. Default 4.",
)
@click.option(
    "--bound",
    "bounds",
    multiple=True,
    metavar="FIGURE=VALUE",
    help=f"Largest allowed value of a figure, or none. Figures: {', '.join(FIGURES)}. "
    "May be repeated.",
)
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write the archive with the figures of every point to this file.",
)
@click.option("--overwrite", is_flag=True, help="Replace an existing file.")
def verify(
    archive: Path,
    points: str,
    exact: str,
    bounds: tuple[str, ...],
    output: Path | None,
    overwrite: bool,
) -> int:
    """Recompute every point and every peak of ARCHIVE from itself alone.

    The exit code is 1 where a bound is broken. Nothing that is stored is believed: residual and
    energy balance are recomputed from the Fourier coefficients, the friction by marching a
    slider, and some points are compared with the exact periodic motion, which shows what the
    harmonics left out amount to. Of an archive without the coefficients of its points the peaks
    are recomputed, as far as those were kept. The table has the worst value of each figure (all
    relative), its bound, whether that holds, and where.

    \b
    Examples:
      symhbm verify blade.nc
      symhbm verify blade.nc --exact 10 --bound exact_difference=0.01
      symhbm verify disk.nc --points 100 --exact none --output checked.nc
    """
    limits = dict(map(bound, bounds))
    check_place(output)
    if output is not None and output.exists() and not overwrite:
        raise FileExistsError(f"--output {output}: there is such a file; --overwrite replaces it")
    with opened(archive) as dataset:
        verified = sh.verify(
            dataset,
            points=number(points),  # type: ignore[arg-type]
            bounds=limits,
            exact=number(exact),  # type: ignore[arg-type]
            progress=sys.stderr.isatty(),
        )
        if output is not None:
            sh.save(verified, output, overwrite=overwrite)
    click.echo(summary(verified))
    return 0 if json.loads(verified.attrs["verification"])["passed"] else BROKEN
