"""The command line: ``python -m symhbm verify archive.nc``."""

import argparse
import json
import sys
from collections.abc import Sequence
from typing import NoReturn

from symhbm.archive import load, save
from symhbm.audit import FIGURES
from symhbm.verify import summary, verify

_BROKEN, _UNUSABLE = 1, 2
"""Exit codes: a bound does not hold; bad usage, or an archive that cannot be read."""


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        # One line: the usage is what --help is for.
        self.exit(_UNUSABLE, f"{self.prog}: {message}\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code: 0 passed, 1 a bound is broken, 2 bad input.

    ``arguments`` are those of the command line by default. Raises SystemExit for bad usage.
    """
    given = _parser().parse_args(arguments)
    try:
        verified = verify(
            load(given.archive),
            points=given.points,
            bounds=dict(given.bound),
            exact=given.exact,
            progress=sys.stderr.isatty(),
        )
        if given.output is not None:
            save(verified, given.output)
    except (OSError, KeyError, TypeError, ValueError) as error:
        text = error.args[0] if isinstance(error, KeyError) else error
        print(f"python -m symhbm: {' '.join(str(text).split())}", file=sys.stderr)
        return _UNUSABLE
    print(summary(verified))
    return 0 if json.loads(verified.attrs["verification"])["passed"] else _BROKEN


def _parser() -> _Parser:
    parser = _Parser(prog="python -m symhbm", description="Forced response with dry friction.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="command")
    about = "recompute an archive from itself; exit code 1 where a bound is broken"
    command = commands.add_parser("verify", help=about, description=about)
    command.add_argument("archive", help="NetCDF file written by symhbm")
    command.add_argument("--points", type=_count, default="all", metavar="all|N")
    command.add_argument("--exact", type=_count, default=4, metavar="all|none|N")
    command.add_argument(
        "--bound",
        type=_bound,
        action="extend",
        nargs="+",
        default=[],
        metavar="FIGURE=VALUE",
        help=f"largest allowed value, or none; figures: {', '.join(FIGURES)}",
    )
    command.add_argument("--output", help="write the archive with the figures to this file")
    return parser


def _count(text: str) -> int | str:
    return int(text) if text.lstrip("-").isdigit() else text


def _bound(text: str) -> tuple[str, float | None]:
    name, separator, value = text.partition("=")
    try:
        if not separator:
            raise ValueError
        return name, None if value == "none" else float(value)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected FIGURE=VALUE") from None
