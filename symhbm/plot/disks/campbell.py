"""Natural frequencies over the speed of rotation, with engine orders: the Campbell diagram."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from scipy.interpolate import PchipInterpolator

from symhbm.numerics import FloatArray
from symhbm.plot.drawing import check_variables
from symhbm.plot.picture import FAMILY, Axis, Panel, Picture
from symhbm.plot.rendering import pictured

GREY = "0.55"
SPEED, FREQUENCY = "speed of rotation [1/min]", "natural frequency [Hz]"
_POINTS = 300
"""Speeds of a drawn line."""
ABOVE = 1.06
"""Upper end of the frequencies shown over the highest natural one."""


@pictured
def campbell(dataset: xr.Dataset, *, ax: Axes | None = None) -> Picture:
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
    speed, highest = dataset.speed.values, ABOVE * float(dataset.frequency.max())
    panel = Panel(
        Axis(SPEED, limits=(min(0.0, speed[0]), speed[-1])), Axis(FREQUENCY, limits=(0, highest))
    )
    curves: Any = [("", FAMILY(0.2), dataset.frequency)]
    if "nodal_diameter" in dataset.dims:
        panel.legend = dict(bbox_to_anchor=(1.09, 1.0), title="nodal\ndiameters")
        waves = dataset.nodal_diameter.values
        colors = FAMILY(np.linspace(0.0, 1.0, len(waves)))
        of_each = (dataset.frequency.sel(nodal_diameter=n) for n in waves)
        curves = zip(map(str, waves), colors, of_each, strict=True)
    for label, color, frequency in curves:
        panel.line(*_smooth(frequency), color=color)
        if label:
            panel.entry(label, color=color)
    for order in dataset.order.values:
        end = min(speed[-1], 60 * highest / order)
        line: Any = dict(color=GREY, linewidth=0.9, linestyle=(0, (5, 2)))
        panel.line([0, end], [0, order * end / 60], **line)
        look: Any = dict(offset=(3, 0), va="center")
        if end < speed[-1]:
            look = dict(offset=(0, 3), va="bottom", ha="center", rotation=90)
        look |= dict(fontsize=8, color="0.35", annotation_clip=False)
        panel.text((end, order * end / 60), f"EO {order}", **look)
    crossings = dataset.crossing_speed.values, dataset.crossing_frequency.values
    panel.line(*crossings, linestyle="", marker="o", markersize=4.5, color="k")
    return Picture([panel])


def _smooth(frequency: xr.DataArray) -> tuple[FloatArray, FloatArray]:
    """Speeds (n,) and frequencies (n, n_modes) on a fine grid: squares of both, interpolated."""
    speed, table = frequency.speed.values, frequency.transpose("speed", "mode").values
    fine = np.union1d(np.linspace(speed[0], speed[-1], _POINTS), speed)
    return fine, np.sqrt(PchipInterpolator(speed**2, table**2)(fine**2))
