"""The program ``symhbm``: a group of the commands in `symhbm.cli.verbs`, one file each."""

from importlib import import_module
from pkgutil import iter_modules

import click

from symhbm.cli import verbs
from symhbm.cli.terminal import Program

_FIRST = ("info", "plot", "view", "verify", "export", "resume", "merge")
"""The order in which commands are of use; others follow by name."""


def commands() -> list[click.Command]:
    """The command of each file of `symhbm.cli.verbs`, which has the name of the file."""
    names = {module.name for module in iter_modules(verbs.__path__)}
    ordered = [name for name in _FIRST if name in names] + sorted(names.difference(_FIRST))
    return [getattr(import_module(f"{verbs.__name__}.{name}"), name) for name in ordered]


@click.group(
    cls=Program,
    commands=commands(),
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

    An archive of a structure is made of the files of a finite-element program:

    \b
      symhbm import sector.inp --output sector.nc

    A computation that was interrupted leaves a working file, blade.nc.partial. It can be looked
    at in the same way, and `symhbm resume blade.nc` computes what is missing. `symhbm merge`
    makes one archive of the parts of an ensemble that several jobs computed.

    Amplitudes are in m, frequencies in Hz, all other values in SI units.

    Exit codes: 0 done; 1 a bound of a verification is broken, or a part of a merged ensemble is
    missing; 2 bad input, with one line on stderr that says what is allowed; 130 interrupted.
    """
