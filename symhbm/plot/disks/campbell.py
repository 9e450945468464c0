"""Natural frequencies over the speed of rotation, with engine orders: the Campbell diagram."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy.interpolate import PchipInterpolator

from symhbm.numerics import FloatArray
from symhbm.plot.drawing import FAMILY, OUTSIDE, canvas, check_variables, figure_of

GREY = "0.55"
SPEED, FREQUENCY = "speed of rotation [1/min]", "natural frequency [Hz]"
_POINTS = 300
"""Speeds of a drawn line."""
_ABOVE = 1.06
"""Upper end of the frequencies shown over the highest natural one."""


def campbell(dataset: xr.Dataset, *, ax: Axes | None = None) -> Figure:
    """Draw natural frequencies over the speed, a line per mode, with the lines of engine orders.

    Dots are crossings. Lines of one nodal diameter have one colour.

    Parameters
    ----------
    dataset
        A result of `symhbm.campbell`.
    ax
        Axes to draw into; by default a new figure.

    Raises
    ------
    TypeError, KeyError
        For what is no such dataset, and for bad axes.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.Model([[1.0]], [[0.5]], [[1e4]])
    >>> rotor = sh.RotatingModel(blade, stiffness={0: [[1e4]], 600: [[2e4]]})
    >>> figure = sh.plot.campbell(sh.campbell(rotor, [0, 300, 600], orders=[2, 3], count=1))
    >>> figure.savefig("campbell.png")
    """
    check_variables(dataset, "frequency", "speed", "crossing_speed", "order")
    speed = dataset.speed.values
    with canvas(ax) as axes:
        handles = []
        if "nodal_diameter" in dataset.dims:
            waves = dataset.nodal_diameter.values
            for n, color in zip(waves, colors(len(waves)), strict=True):
                axes.plot(*_smooth(dataset.frequency.sel(nodal_diameter=n)), color=color)
                handles.append(Line2D([], [], color=color, label=f"{n}"))
        else:
            axes.plot(*_smooth(dataset.frequency), color=FAMILY(0.2))
        highest = _ABOVE * float(dataset.frequency.max())
        for order in dataset.order.values:
            end = min(speed[-1], 60 * highest / order)
            axes.plot([0, end], [0, order * end / 60], color=GREY, lw=0.9, ls=(0, (5, 2)))
            on_top = end < speed[-1]
            place: dict[str, Any] = dict(xytext=(0, 3) if on_top else (3, 0), rotation=90 * on_top)
            place |= dict(va="bottom", ha="center") if on_top else dict(va="center")
            text: dict[str, Any] = dict(fontsize=8, color="0.35", annotation_clip=False)
            text["textcoords"] = "offset points"
            axes.annotate(f"EO {order}", (end, order * end / 60), **place, **text)
        axes.plot(dataset.crossing_speed, dataset.crossing_frequency, "o", ms=4.5, color="k")
        axes.set(xlim=(min(0.0, speed[0]), speed[-1]), ylim=(0, highest))
        axes.set(xlabel=SPEED, ylabel=FREQUENCY)
        if handles:
            place = OUTSIDE | {"bbox_to_anchor": (1.09, 1.0)}
            axes.legend(handles=handles, title="nodal\ndiameters", **place)
        return figure_of(axes)


def _smooth(frequency: xr.DataArray) -> tuple[FloatArray, FloatArray]:
    """Speeds (n,) and frequencies (n, n_modes) on a fine grid: squares of both, interpolated."""
    speed, table = frequency.speed.values, frequency.transpose("speed", "mode").values
    fine = np.union1d(np.linspace(speed[0], speed[-1], _POINTS), speed)
    return fine, np.sqrt(PchipInterpolator(speed**2, table**2)(fine**2))


def colors(n: int) -> list:
    """Colours of so many nodal diameters, darker and darker."""
    return [FAMILY(share) for share in np.linspace(0.0, 1.0, n)]
