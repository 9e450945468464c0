"""Input and output of all commands: arguments, errors of one line, archives, whole files."""

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

import click
import xarray as xr

from symhbm.model.contacts import ContactLaw
from symhbm.numerics import check
from symhbm.results.archive import SUFFIX, existing, load, working_file
from symhbm.results.reading import At, printable

BROKEN, _UNUSABLE, _INTERRUPTED, _PIPE = 1, 2, 130, 141
"""Exit codes: broken bound or missing part; bad usage or an unusable file; the shell's own."""


class _Failure(click.ClickException):
    def __init__(self, message: str, ctx: click.Context):
        super().__init__(message)
        self.ctx = ctx


class Program(click.Group):
    """Group of commands that prints each error and each warning in one line, without usage."""

    def main(self, *args: Any, **kwargs: Any) -> NoReturn:
        """Run a command and exit with its code."""
        kwargs["standalone_mode"] = False
        try:
            code = super().main(*args, **kwargs)
        except click.Abort as abort:
            # The notes of the interrupted command tell which results are kept.
            say("\n".join(getattr(abort.__cause__, "__notes__", ["symhbm: interrupted"])))
            code = _INTERRUPTED
        except click.ClickException as error:
            context = getattr(error, "ctx", None)
            where = context.command_path if context else "symhbm"
            if isinstance(error, _Failure) and error.ctx.invoked_subcommand in self.commands:
                where += f" {error.ctx.invoked_subcommand}"
            hint = f"; see {where} --help" if isinstance(error, click.UsageError) else ""
            text = " ".join(error.format_message().split()).rstrip(".")
            say(f"{where}: {text}{hint}")
            code = _UNUSABLE
        sys.exit(code)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command that was asked for."""
        try:
            with warnings.catch_warnings():
                warnings.showwarning = lambda message, *_, **__: say(f"symhbm: {message}")
                code = super().invoke(ctx)
            sys.stdout.flush()
        except BrokenPipeError:
            # The reader closed the pipe: the rest of the buffer is discarded, too.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return _PIPE
        except (ImportError, OSError, LookupError, RuntimeError, TypeError, ValueError) as error:
            if isinstance(error, (click.exceptions.Exit, click.Abort)):
                raise
            text = error.args[0] if isinstance(error, KeyError) and error.args else error
            raise _Failure(str(text), ctx) from error
        return code

    def list_commands(self, ctx: click.Context) -> list[str]:
        """All commands, in the order in which they are of use."""
        return list(self.commands)

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        """Find a command by its name."""
        if not args[0].startswith("-"):
            check.known(args[0], self.commands, "command")
        return super().resolve_command(ctx, args)


@contextmanager
def opened(archive: Path) -> Iterator[xr.Dataset]:
    """An archive whose variables are read on demand."""
    if archive.is_dir():
        raise ValueError(f"ARCHIVE {archive}: a directory, expected a file")
    working = working_file(archive)
    if not archive.exists() and working.exists():
        raise ValueError(f"ARCHIVE {archive}: no such file, but an unfinished run {working}")
    with load(archive, lazy=True) as dataset:
        yield dataset


def names_of(archives: tuple[Path, ...], labels: tuple[str, ...]) -> list[str]:
    """What several archives are called; raises ValueError for another number of labels."""
    if labels and len(labels) != len(archives):
        raise ValueError(f"--label: expected {len(archives)}, one per ARCHIVE, got {len(labels)}")
    names = list(labels) or [Path(final_name(archive)).stem for archive in archives]
    if len({*names}) < len(names):
        raise ValueError(f"--label: expected different ones, got {', '.join(names)}")
    return names


def check_place(output: Path | None) -> None:
    """Raise ValueError unless a file can be written there, or is not wanted."""
    if output is None:
        return
    if not output.name or output.is_dir() or not output.parent.is_dir():
        raise ValueError(
            f"--output {output}: cannot be written, expected a file name in an existing directory"
        )


def final_name(archive: Path) -> str:
    """Name of an archive, also from that of its working file."""
    return archive.name.removesuffix(SUFFIX)


def say(text: object, *, err: bool = True) -> None:
    """Print lines to standard error, or to standard output, without control characters."""
    click.echo("\n".join(map(printable, str(text).split("\n"))), err=err)


def number(text: str) -> int | str:
    """An integer, or the text as it is."""
    return int(text) if text.lstrip("-").isdigit() else text


def bound(text: str) -> tuple[str, float | None]:
    """Name and value of ``FIGURE=VALUE``; raises ValueError for another form."""
    name, sign, value = text.partition("=")
    try:
        if not sign:
            raise ValueError
        return name, None if value == "none" else float(value)
    except ValueError:
        raise ValueError(f"--bound {text}: expected FIGURE=VALUE") from None


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


def _at(text: str | None) -> At | None:
    """A word, the number of a peak, or a value."""
    if text is None or text in ("peak", "largest"):
        return text  # type: ignore[return-value]
    try:
        return int(text) if text.isdigit() else float(text)
    except ValueError:
        raise click.BadParameter(
            f"{text}: expected peak, largest, the number of a peak, or with a decimal point the "
            "value of what moves"
        ) from None


at_option = click.option(
    "--at",
    metavar="POINT",
    callback=lambda _context, _option, text: _at(text),
    help="One point of each curve: peak (the highest), largest, the number of a peak from 0, or, "
    "with a decimal point, a frequency as 151.0.",
)
law_option = click.option(
    "--law",
    "laws",
    multiple=True,
    metavar="MODULE:CLASS",
    callback=lambda _context, _option, names: [_law(name) for name in names],
    help="A contact law of your own that ARCHIVE was computed with: it is imported, from the "
    "present folder too. May be repeated.",
)


archive_argument = click.argument(
    "archive",
    metavar="ARCHIVE",
    type=click.Path(path_type=Path),
    callback=lambda _context, _option, path: existing(path),
)
archives_argument = click.argument(
    "archives",
    metavar="ARCHIVE...",
    nargs=-1,
    required=True,
    type=click.Path(path_type=Path),
    callback=lambda _context, _option, paths: tuple(existing(path) for path in paths),
)
label_option = click.option(
    "--label",
    "labels",
    multiple=True,
    help="What a legend calls an ARCHIVE, in the order of several; by default their names.",
)
overwrite_option = click.option("--overwrite", is_flag=True, help="Replace an existing file.")
progress_option = click.option(
    "--no-progress",
    "progress",
    is_flag=True,
    callback=lambda _context, _option, hidden: not hidden and sys.stderr.isatty(),
    help="Show no bar.",
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
