"""Nonlinear modes: frequency and damping ratio over the amplitude, or over a parameter."""

import xarray as xr
from matplotlib.axes import Axes

from symhbm.plot.drawing import Family, axis_label, one_solution
from symhbm.plot.marks import FIRST_HARMONIC, mark_ends, mark_events
from symhbm.plot.picture import Axis, Panel, Picture
from symhbm.plot.rendering import pictured
from symhbm.results import Description, check_dataset, check_present

_PANELS = {"frequency": (0.54, "frequency [Hz]"), "damping_ratio": (0.0, "damping ratio")}
"""Variables that are drawn, from the top: where their panels begin, and their labels."""


@pictured
def nonlinear_modes(dataset: xr.Dataset, *, ax: Axes | None = None) -> Picture:
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
    of_amplitude = moves == "amplitude"
    label = FIRST_HARMONIC if of_amplitude else axis_label(dataset, moves)
    dims = [str(dim) for dim in dataset["frequency"].dims if dim != along]
    family, panels = Family(dataset, dims), []
    for name, (bottom, words) in _PANELS.items():
        panel = Panel(Axis(log=of_amplitude), Axis(words), place=(bottom, 0.46))
        for member, one in family.curves():
            panel.line(one[moves].values, one[name].values, **member.look)
            mark_ends(panel, one, moves, one[name].values)
            mark_events(panel, one, name, member.color)
        panels.append(panel)
    panels[-1].x.label = label
    if not (dataset["damping_ratio"] < 0).any():
        panels[-1].y.limits = (0.0, None)
    family.explain(panels[0])
    return Picture(panels, (6.4, 5.2), alone=True)
