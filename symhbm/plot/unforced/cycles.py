"""Limit cycles: their amplitude over the parameter, and which of them are stable."""

from collections.abc import Iterator

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from symhbm.plot.drawing import Family, axis_label, check_anything
from symhbm.plot.marks import FIRST_HARMONIC, at_an_end, draw_ends, is_complete, mark_events
from symhbm.plot.picture import Axis, Panel, Picture
from symhbm.plot.rendering import pictured
from symhbm.results import Description, check_dataset, check_present

_STYLES = {1: "-", 0: "--", -1: ":"}
"""Lines of cycles that are stable, unstable, and of which it is not known."""
_AT_END = 1.1
"""Ratio of amplitudes that are one, at the ends of their band."""


@pictured
def limit_cycles(dataset: xr.Dataset, *, ax: Axes | None = None) -> Picture:
    """Draw the amplitude of limit cycles over the parameter that moves, one colour per set.

    Cycles that are not stable are dashed, dotted where it is not known; without ``stability`` all
    lines are solid. Squares are folds, where two cycles meet, circles onsets and ends of slip, of
    contact and of opening; changes of stability are marked as in `response`.
    A red cross is where a branch ends of cycles that are not complete.

    Parameters
    ----------
    dataset
        A result of `symhbm.limit_cycles` along a parameter, not on a grid.
    ax
        Axes to draw into; by default a new figure.

    Raises
    ------
    TypeError, KeyError, ValueError
        For what is no such dataset, and for one without a cycle.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=-0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, harmonics=(1, 3, 5))
    >>> cycles = sh.limit_cycles(problem, "damping", (-30, 0), stability=True, progress=False)
    >>> figure = sh.plot.limit_cycles(cycles)
    >>> figure.savefig("cycles.png")
    """
    check_dataset("dataset", dataset, unforced=True)
    description = Description(dataset)
    if description.unforced != "limit cycle" or description.moving == "amplitude":
        raise TypeError("dataset: expected a result of limit_cycles over a parameter")
    if "point" not in dataset.dims:
        raise ValueError("dataset: expected points along branches of cycles, got a grid; ask for "
                         "them without at=")  # fmt: skip
    name = description.moving
    check_present(dataset, "amplitude", "cycle_branch", name)
    check_anything(dataset, "amplitude")
    dims = [str(dim) for dim in dataset["amplitude"].dims if dim != "point"]
    family = Family(dataset, dims)
    panel = Panel(Axis(axis_label(dataset, name)), Axis(FIRST_HARMONIC, log=True))
    for member, one in family.curves():
        value, amplitude = one[name].values, one["amplitude"].values
        for part, verdict in _runs(one):
            look = dict(color=member.color, linestyle=_STYLES[verdict])
            panel.line(value[part], amplitude[part], **look)
        ends = np.array([] if is_complete(one) else [*_ends(one, name)], dtype=int)
        draw_ends(panel, value[ends], amplitude[ends])
        mark_events(panel, one, "amplitude", member.color)
    family.explain(panel)
    return Picture([panel])


def _runs(one: xr.Dataset) -> Iterator[tuple[slice, int]]:
    """Parts of branches whose cycles are alike, each up to the first point of the next one."""
    found = np.isfinite(one["amplitude"].values)
    branch = np.where(found, one["cycle_branch"].values, -1)
    known = "stability" in one.variables
    stable = one["stability"].values if known else np.ones(len(found), dtype=int)
    begin = 0
    for i in range(1, len(found) + 1):
        ends = i == len(found) or branch[i] != branch[begin]
        if ends or stable[i] != stable[begin]:
            if branch[begin] >= 0:
                yield slice(begin, i if ends else i + 1), int(stable[begin])
            begin = i


def _ends(one: xr.Dataset, name: str) -> Iterator[int]:
    """First and last points of branches that are not closed, inside the band and its amplitudes."""
    value, amplitude = one[name].values, one["amplitude"].values
    description = Description(one)
    inside = np.isfinite(amplitude) & ~at_an_end(value, description.band)
    low, high = description.request["amplitudes"]
    inside &= (amplitude > _AT_END * low) & (amplitude < high / _AT_END)
    branch = one["cycle_branch"].values
    for number in np.unique(branch[np.isfinite(amplitude)]):
        own = np.flatnonzero(np.isfinite(amplitude) & (branch == number))
        first, last = int(own[0]), int(own[-1])
        closed = np.isclose([value[first], amplitude[first]], [value[last], amplitude[last]]).all()
        if first == last or not closed:
            yield from (end for end in {first, last} if inside[end])
