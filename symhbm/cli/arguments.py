"""Arguments and options that several commands have."""

import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from symhbm.model.contacts import ContactLaw
from symhbm.results.archive import working_file


def _law(name: str) -> ContactLaw:
    module, _, kind = name.partition(":")
    sys.path.insert(0, str(Path.cwd()))
    try:
        law = getattr(import_module(module), kind)
        law = law() if isinstance(law, type) else law
    except (ImportError, AttributeError, TypeError, ValueError) as error:
        raise click.BadParameter(
            f"{name}: expected MODULE:CLASS of a contact law, or a law of a module ({error})"
        ) from error
    finally:
        sys.path.pop(0)
    if not isinstance(law, ContactLaw):
        raise click.BadParameter(f"{name}: expected a contact law, got {law!r}")
    return law


law_option = click.option(
    "--law",
    "laws",
    multiple=True,
    metavar="MODULE:CLASS",
    callback=lambda _context, _option, names: [_law(name) for name in names],
    help="A contact law of your own that ARCHIVE was computed with: it is imported, from the "
    "present folder too. May be repeated.",
)


def _archive(_context: click.Context, _option: click.Parameter, path: Path) -> Path:
    """The archive of a name that may lack its ``.nc``, as `symhbm.load` takes it."""
    named = path.with_name(f"{path.name}.nc")
    is_there = [each.exists() or working_file(each).exists() for each in (path, named)]
    return named if is_there == [False, True] else path


archive_argument = click.argument(
    "archive", metavar="ARCHIVE", type=click.Path(path_type=Path), callback=_archive
)
select_option = click.option(
    "--select",
    "choices",
    multiple=True,
    metavar="NAME=VALUE",
    help="Only this part: normal_load=3, sample=0,4 or frequency=100:200 (ends included). Names "
    "are the dimensions of the archive; those without labels count from 0. May be repeated.",
)


def output_option(text: str, required: bool = False) -> Callable[[Any], Any]:
    """The option of a file to write; ``text`` is its help."""
    kind = click.Path(path_type=Path)
    return click.option("-o", "--output", type=kind, metavar="FILE", help=text, required=required)
