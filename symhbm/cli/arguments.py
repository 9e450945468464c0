"""Arguments and options that several commands have."""

from pathlib import Path

import click

archive_argument = click.argument("archive", metavar="ARCHIVE", type=click.Path(path_type=Path))
select_option = click.option(
    "--select",
    "choices",
    multiple=True,
    metavar="NAME=VALUE",
    help="Only this part: normal_load=3, sample=0,4 or frequency=100:200 (ends included). Names "
    "are the dimensions of the archive; those without labels count from 0. May be repeated.",
)
