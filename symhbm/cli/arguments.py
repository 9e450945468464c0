"""Arguments and options that several commands have."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

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


def output_option(text: str) -> Callable[[Any], Any]:
    """The option of a file to write; ``text`` is its help."""
    return click.option("--output", type=click.Path(path_type=Path), metavar="FILE", help=text)
