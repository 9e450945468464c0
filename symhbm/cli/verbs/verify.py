"""The command ``symhbm verify``."""

import sys
from pathlib import Path

import click

import symhbm as sh
from symhbm.cli import terminal
from symhbm.model.contacts import ContactLaw
from symhbm.response import FIGURES, summary
from symhbm.results import Description
from symhbm.results.reading import completeness


@click.command()
@terminal.archive_argument
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
@terminal.output_option("Write the archive with the figures of every point to this file.")
@terminal.overwrite_option
@terminal.law_option
def verify(
    archive: Path,
    points: str,
    exact: str,
    bounds: tuple[str, ...],
    output: Path | None,
    overwrite: bool,
    laws: list[ContactLaw],
) -> int:
    """Recompute every point and every peak of ARCHIVE from itself alone.

    The exit code is 1 where a bound is broken. Nothing that is stored is believed: residual and
    energy balance are recomputed from the Fourier coefficients, the friction by marching a
    slider, and some points are compared with the exact periodic motion, which shows what the
    harmonics left out amount to. Of an archive without the coefficients of its points the peaks
    are recomputed, as far as those were kept; of nonlinear modes and limit cycles events,
    stability and folds as well. The table has the worst value of each figure (all
    relative), its bound, whether that holds, and where.

    \b
    Examples:
      symhbm verify blade.nc
      symhbm verify blade.nc --exact 10 --bound exact_difference=0.01
      symhbm verify disk.nc --points 100 --exact none --output checked.nc
    """
    limits = dict(map(terminal.bound, bounds))
    terminal.check_place(output)
    if output is not None and output.exists() and not overwrite:
        raise FileExistsError(f"--output {output}: there is such a file; --overwrite replaces it")
    with terminal.opened(archive) as dataset:
        verified = sh.verify(
            dataset,
            points=terminal.number(points),  # type: ignore[arg-type]
            bounds=limits,
            exact=terminal.number(exact),  # type: ignore[arg-type]
            laws=laws,
            progress=sys.stderr.isatty(),
        )
        if output is not None:
            sh.save(verified, output, overwrite=overwrite)
        complete, waiting, failed = completeness(dataset)
    terminal.say(summary(verified), err=False)
    incomplete = waiting + failed.total()
    if incomplete:
        total = complete + incomplete
        terminal.say(
            f"symhbm verify: {incomplete} of {total} curves are incomplete, what there is of them "
            "was checked; symhbm info says why"
        )
    return 0 if (Description(verified).verification or {})["passed"] else terminal.BROKEN
