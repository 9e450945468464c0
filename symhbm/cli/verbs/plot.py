"""The command ``symhbm plot``."""

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from symhbm.cli import terminal
from symhbm.cli.selection import draw, kinds
from symhbm.model.contacts import ContactLaw
from symhbm.results.reading import At

_PICTURES = ("png", "pdf", "svg")
"""Formats of pictures."""


class _Kind(click.ParamType):
    """The kinds of pictures, which are looked up late: Matplotlib is slow to import."""

    name = "kind"

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str | None:
        return click.Choice(kinds()).get_metavar(param, ctx)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        return click.Choice(kinds()).convert(value, param, ctx)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        return click.Choice(kinds()).shell_complete(ctx, param, incomplete)


@click.command()
@terminal.archives_argument
@terminal.label_option
@click.option(
    "--kind",
    type=_Kind(),
    help="What to draw. By default hysteresis for a motion in time, nonlinear-modes, "
    "limit-cycles and flutter-limit for those, pareto-front for a front of two aims, envelope for "
    "an ensemble, disk for one point of a disk, else response.",
)
@terminal.select_option
@click.option(
    "--place",
    metavar="PLACE",
    help="What to show: a degree of freedom from 0, 'blade 3', a label or node as tip, one of its "
    "directions as tip:y, or several of these, divided by commas.",
)
@click.option(
    "--contact",
    metavar="CONTACT",
    help="The contact to show, from 0, or for hysteresis the name of a group.",
)
@terminal.at_option
@terminal.output_option(
    f"Picture to write, .{', .'.join(_PICTURES)}; by default ARCHIVE_KIND.png beside ARCHIVE."
)
@terminal.law_option
def plot(
    archives: tuple[Path, ...],
    labels: tuple[str, ...],
    kind: str | None,
    choices: tuple[str, ...],
    place: str | None,
    contact: str | None,
    at: At | None,
    output: Path | None,
    laws: list[ContactLaw],
) -> None:
    """Draw a picture of ARCHIVE and print its path; of several they are in one picture.

    \b
      response      amplitude over the frequency (or what was followed), a line per parameter set
      pareto-front  a front of two aims, and the values of its designs
      envelope      an ensemble of responses as bands
      disk          the response around the disk
      blades        the response of every blade
      nonlinear-modes  frequency and damping ratio over the amplitude, or a parameter
      limit-cycles  their amplitude over a parameter
      flutter-limit the negative damping that contacts hold, over a parameter
      hysteresis    friction force over relative displacement
      normal-force  normal force over the period
      states        where contacts stick, slip, open or never touch, each of them
      stick-map     where contacts stick and where they slip, over a swept parameter
      contact-map   what contacts do at one point, where they are
      model         the structure and the force on it
      phase         the phase lag of one degree of freedom over the frequency
      bode, nyquist, phase-portrait  amplitude over phase, both in a plane, and a period of motion
      backbone      where resonances and modes are, to compare with responses
      transmissibility  motion over that of a moving base

    \b
    Examples:
      symhbm plot blade.nc
      symhbm plot built.nc thicker.nc --label "as built" --label "thicker shroud"
      symhbm plot blade.nc --select normal_load=1,3 --output loads.pdf
      symhbm plot disk.nc --kind response --select sample=0 --place "blade 3"
      symhbm plot disk.nc --kind hysteresis --at peak --contact shroud
    """
    if output is not None and output.suffix.removeprefix(".").lower() not in _PICTURES:
        raise ValueError(f"--output {output}: expected a name ending in .{', .'.join(_PICTURES)}")
    terminal.check_place(output)
    names = terminal.names_of(archives, labels)
    number = None if contact is None else terminal.number(contact)
    given = ("place", _places(place)), ("contact", number), ("at", at)
    options = {name: value for name, value in given if value is not None}
    with ExitStack() as files:
        opened = [files.enter_context(terminal.opened(archive)) for archive in archives]
        named = labels or len(opened) > 1
        shown = dict(zip(names, opened, strict=True)) if named else opened[0]
        kind, figure = draw(shown, kind, choices, options, laws)
    stem = Path(terminal.final_name(archives[0])).stem
    output = output or archives[0].with_name(f"{stem}_{kind}.png")
    figure.savefig(output)
    figure.clear()
    terminal.say(output, err=False)


def _places(text: str | None) -> int | str | list[int | str] | None:
    """Places as pictures take them: numbers as numbers, and one of them alone."""
    if text is None:
        return None
    parts = [part.strip() for part in text.split(",")]
    places: list[int | str] = [int(part) if part.isdigit() else part for part in parts]
    return places[0] if len(places) == 1 else places
