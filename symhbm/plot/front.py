"""Fronts of two aims, and the values of the designs along them."""

from typing import Unpack

import numpy as np
import xarray as xr

from symhbm.continuation import Status
from symhbm.plot.drawing import LINE_STYLES, is_wide, shades
from symhbm.plot.lines import curved
from symhbm.plot.looks import Look, pictured
from symhbm.plot.picture import Axis, Panel, Picture
from symhbm.results import check_dataset, check_present


@pictured
def pareto_front(dataset: xr.Dataset, **common: Unpack[Look]) -> Picture:
    """Draw the front of two aims, and below it the values of its designs over the second aim.

    Squares are the ends, each the optimum of one aim, circles the points between them; crosses are
    designs that were found and are not on the front. The line is drawn through the points.

    Parameters
    ----------
    dataset
        A result of `symhbm.pareto_front`.
    common
        As of all pictures.

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
    ...     sh.HarmonicBalance(blade, sh.forces.PointForce()), "normal_load", (0.5, 20), (5, 40),
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
    names = [str(name) for name in dataset["aim"].values]
    order = np.argsort(dataset["front_aim"].values[:, 1], kind="stable")
    first, second = dataset["front_aim"].values[order].T
    above = Panel(
        Axis(log=is_wide(second)), Axis(names[0], log=is_wide(first)),
        place=(0.46, 0.54), legend_at="best",
    )  # fmt: skip
    line = curved(second, first, (above.x.log, above.y.log))
    above.line(*line, color="0.6", linewidth=1.0, zorder=1)
    ends = dataset["front_kind"].values[order] == "end"
    removed = dataset["removed_aim"].values
    removed = removed[np.isfinite(removed).all(axis=1)]
    for x, y, label, marker, size in (
        (second[~ends], first[~ends], "between", "o", 5),
        (second[ends], first[ends], "optimum of one aim", "s", 7),
    ):
        above.line(x, y, label, linestyle="", marker=marker, color="black", markersize=size)
    if len(removed):
        look = dict(linestyle="", marker="x", color="tab:red")
        above.line(removed[:, 1], removed[:, 0], "not on the front", **look)
    if dataset["status"].item() == Status.FRONT_INCOMPLETE:
        above.entry("incomplete, status tells why", linestyle="")
    return Picture([above, _values(dataset, order, second, names[1])], (6.4, 5.6), alone=True)


def _values(dataset: xr.Dataset, order: np.ndarray, along: np.ndarray, label: str) -> Panel:
    """The values of all variables, each over its smallest where their units differ."""
    values, units = dataset["front_value"].values[order], dataset["variable_units"].values
    texts = [str(text).replace("_", " ") for text in dataset["variable"].values]
    alike = len(set(units.tolist())) == 1
    shown = values if alike else values / values.min(axis=0)
    unit = "" if units[0] == "1" else f" [{units[0]}]"
    words = f"{texts[0] if len(texts) == 1 else 'value'}{unit}" if alike else "relative"
    panel = Panel(Axis(label), Axis(words, log=is_wide(shown)), place=(0.0, 0.36))
    for number, (text, color) in enumerate(zip(texts, shades(len(texts)), strict=True)):
        look = dict(linestyle=LINE_STYLES[number % len(LINE_STYLES)], color=color)
        text = text if len(texts) > 1 else ""
        panel.line(along, shown[:, number], text, marker="o", markersize=4, **look)
    return panel
