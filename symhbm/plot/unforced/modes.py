"""Nonlinear modes: frequency and damping ratio over the amplitude, or over a parameter."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from symhbm.plot.drawing import Family, Member, axis_label, canvas, figure_of, one_solution
from symhbm.plot.ends import mark_ends
from symhbm.results import Description, check_dataset, check_present

_PANELS = {"frequency": (0.54, "frequency [Hz]"), "damping_ratio": (0.0, "damping ratio")}
"""Variables that are drawn, from the top: where their panels begin, and their labels."""
_AMPLITUDE = "amplitude of the first harmonic [m]"
_HEIGHT = 0.46
_SIZE = (6.4, 5.2)
_MARKERS = {"fold": "s", "damping turns": "D"}
"""Marks of events of the curve; those of contacts are circles."""
_MARK: Any = dict(ls="none", markeredgecolor="black", markeredgewidth=0.6, markersize=4.5, zorder=3)


def nonlinear_modes(dataset: xr.Dataset, *, ax: Axes | None = None) -> Figure:
    """Draw frequency and damping ratio over what moves, one line per parameter set.

    Circles are onsets and ends of slip, of contact and of opening, squares folds, diamonds maxima
    and minima of the damping ratio. A red cross is where a curve ends that is not complete.

    Parameters
    ----------
    dataset
        A result of `symhbm.nonlinear_modes`.
    ax
        Axes without a picture, in whose place both panels are drawn; by default a new figure.

    Raises
    ------
    TypeError, KeyError, ValueError
        For what is no such dataset, for several solutions at one amplitude of a grid, and axes
        that hold a picture.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, harmonics=(1, 3, 5))
    >>> modes = sh.nonlinear_modes(problem, over={"normal_load": [1, 3]}, progress=False)
    >>> figure = sh.plot.nonlinear_modes(modes)
    >>> figure.savefig("modes.png")
    """
    check_dataset("dataset", dataset, unforced=True)
    check_present(dataset, "amplitude", *_PANELS)
    if Description(dataset).unforced != "nonlinear mode":
        raise TypeError("dataset: expected a result of nonlinear_modes")
    dataset = one_solution(dataset)
    moves = Description(dataset).moving
    along = "point" if "point" in dataset.dims else moves
    over_amplitude = moves == "amplitude"
    dims = [str(dim) for dim in dataset["frequency"].dims if dim != along]
    family = Family(dataset, dims)
    with canvas(ax, _SIZE, alone=True) as whole:
        whole.set_axis_off()
        panels: list[Any] = []
        for name, (bottom, label) in _PANELS.items():
            panel = whole.inset_axes((0, bottom, 1, _HEIGHT), sharex=panels[0] if panels else None)
            panels.append(panel)
            for member in family:
                _draw(panel, dataset.isel(member.position), name, member)
            panel.set(ylabel=label, xscale="log" if over_amplitude else "linear")
        first, last = panels
        first.tick_params(labelbottom=False)
        label = _AMPLITUDE if over_amplitude else axis_label(dataset, moves)
        last.set_xlabel(label)
        if not (dataset["damping_ratio"] < 0).any():
            last.set_ylim(bottom=0.0)
        family.explain(first)
        return figure_of(whole)


def _draw(panel: Axes, one: xr.Dataset, name: str, member: Member) -> None:
    """Draw a variable of one parameter set, and mark its events."""
    moves = Description(one).moving
    panel.plot(one[moves], one[name], color=member.color, ls=member.style)
    mark_ends(panel, one, moves, one[name].values)
    if "event_kind" not in one.variables or f"event_{name}" not in one.variables:
        return
    kinds = one["event_kind"].values.astype(str)
    for kind in np.unique(kinds[kinds != ""]):
        at = kinds == kind
        points = one[f"event_{moves}"].values[at], one[f"event_{name}"].values[at]
        panel.plot(*points, _MARKERS.get(kind, "o"), markerfacecolor=member.color, **_MARK)
