"""Fronts of two aims, and the values of the designs along them."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from symhbm.continuation import Status
from symhbm.plot.drawing import LINE_STYLES, OUTSIDE, canvas, figure_of, is_wide, shades
from symhbm.results import check_dataset, check_present

_SIZE = (6.4, 5.6)
_PLACES = {"aims": (0.46, 0.54), "values": (0.0, 0.36)}
"""Lower end and height of both panels."""
_LINE: Any = dict(color="0.6", lw=1.0, zorder=1)


def pareto_front(dataset: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw the front of two aims, and below it the values of its designs over the second aim.

    Squares are the ends, each the optimum of one aim, circles the points between them; crosses are
    designs that were found and are not on the front. Lines join points and are no result.

    Parameters
    ----------
    dataset
        A result of `symhbm.pareto_front`.
    ax
        Axes without a picture, in whose place both panels are drawn; by default a new figure.

    Returns
    -------
    The figure.

    Raises
    ------
    TypeError, KeyError, ValueError
        For no dataset, one without a front, and axes that are none.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> front = sh.pareto_front(
    ...     sh.HarmonicBalance(blade, sh.PointForce()), "normal_load", (0.5, 20), (5, 40),
    ...     aims={
    ...         "peak [m]": lambda peaks, parameters: peaks["largest"],
    ...         "load [N]": lambda peaks, parameters: parameters["normal_load"][0],
    ...     },
    ...     n_points=3, progress=False,
    ... )
    >>> sh.plot.pareto_front(front).savefig("front.png")
    """
    check_dataset("dataset", dataset)
    if "front_aim" not in dataset.variables:
        raise TypeError("dataset: expected a result of pareto_front")
    check_present(dataset, "front_aim", "front_value", "front_kind", "removed_aim")
    names = dataset["aim"].values
    with canvas(ax, _SIZE, alone=True) as whole:
        whole.set_axis_off()
        above, below = (whole.inset_axes((0, low, 1, height)) for low, height in _PLACES.values())
        below.sharex(above)
        order = np.argsort(dataset["front_aim"].values[:, 1], kind="stable")
        first, second = dataset["front_aim"].values[order].T
        ends = dataset["front_kind"].values[order] == "end"
        above.plot(second, first, **_LINE)
        above.plot(second[~ends], first[~ends], "o", color="black", ms=5, label="between")
        above.plot(second[ends], first[ends], "s", color="black", ms=7, label="optimum of one aim")
        removed = dataset["removed_aim"].values
        removed = removed[np.isfinite(removed).all(axis=1)]
        if len(removed):
            above.plot(removed[:, 1], removed[:, 0], "x", color="tab:red", label="not on the front")
        _values(below, dataset, order, second)
        above.tick_params(labelbottom=False)
        above.set(ylabel=str(names[0]))
        below.set(xlabel=str(names[1]))
        if dataset["design_status"].item() == Status.FRONT_INCOMPLETE:
            above.plot([], [], " ", label="incomplete, design_status tells why")
        _scales(above, first, second)
        above.legend(loc="best")
        return figure_of(whole)


def _values(ax: Axes, dataset: xr.Dataset, order: np.ndarray, along: np.ndarray) -> None:
    """Draw the values of all variables, each over its smallest where their units differ."""
    values = dataset["front_value"].values[order]
    labels = dataset["variable"].values
    units = dataset["variable_units"].values
    alike = len(set(units.tolist())) == 1
    shown = values if alike else values / values.min(axis=0)
    colors = shades(len(labels))
    for number, label in enumerate(labels):
        style = LINE_STYLES[number % len(LINE_STYLES)]
        text = str(label).replace("_", " ")
        ax.plot(
            along, shown[:, number], ls=style, marker="o", ms=4, color=colors[number], label=text
        )
    unit = "" if units[0] == "1" else f" [{units[0]}]"
    one = str(labels[0]).replace("_", " ")
    ax.set_ylabel((f"{one}{unit}" if len(labels) == 1 else f"value{unit}") if alike else "relative")
    if is_wide(shown):
        ax.set_yscale("log")
    if len(labels) > 1:
        ax.legend(**OUTSIDE)


def _scales(ax: Axes, first: np.ndarray, second: np.ndarray) -> None:
    """Logarithmic scales where values ask for them."""
    if is_wide(first):
        ax.set_yscale("log")
    if is_wide(second):
        ax.set_xscale("log")
