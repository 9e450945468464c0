"""Natural frequencies over nodal diameters, with what engine orders excite: the SAFE diagram."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from symhbm.plot.disks.campbell import ABOVE, FREQUENCY, GREY
from symhbm.plot.drawing import check_variables
from symhbm.plot.picture import FAMILY, Axis, Panel, Picture
from symhbm.plot.rendering import pictured

_ASIDE = 0.14
"""Distance of the bars of neighbouring modes, in nodal diameters."""


@pictured
def interference(dataset: xr.Dataset, *, ax: Axes | None = None) -> Picture:
    """Draw natural frequencies over nodal diameters, with the frequencies of engine orders.

    The SAFE or ZZENF diagram. Each mode has a bar over its nodal diameters, from its frequency at
    the lowest speed to that at the highest one. The folded lines are ``order * speed / 60`` at both
    speeds: engine order E meets the waves of ``E mod n_sectors``. A dot is a crossing, with its
    engine order; the list of them is in the dataset.

    Parameters
    ----------
    dataset
        A result of `symhbm.campbell` of a `symhbm.Sector`.
    ax
        Axes to draw into; by default a new figure.

    Raises
    ------
    TypeError, KeyError, ValueError
        For what is no such dataset, one of no sector, and for bad axes.

    Examples
    --------
    >>> import symhbm as sh
    >>> mass = sh.Model([[1.0, 0], [0, 0]], [[0.1, 0], [0, 0]], [[3e4, -2e4], [-2e4, 2e4]])
    >>> disk = sh.Sector(mass, left=[0], right=[1], n_sectors=24)
    >>> lines = sh.campbell(disk, [200, 900], orders=range(1, 13), count=1)
    >>> figure = sh.plot.interference(lines)
    >>> figure.savefig("interference.png")
    """
    check_variables(dataset, "frequency", "speed", "crossing_speed", "order")
    if "nodal_diameter" not in dataset.dims or "n_sectors" not in dataset.attrs:
        raise ValueError("dataset: expected a result of symhbm.campbell of a Sector, with waves")
    n_sectors, speeds = int(dataset.attrs["n_sectors"]), dataset.speed.values
    highest, n_modes = ABOVE * float(dataset.frequency.max()), dataset.sizes["mode"]
    dataset = dataset.sortby(np.abs(dataset.nodal_diameter))
    by_mode = dataset.frequency.transpose("mode", "nodal_diameter", "speed").values
    panel = Panel(
        Axis("nodal diameters", limits=(-0.5, n_sectors // 2 + 0.5), whole=True),
        Axis(FREQUENCY, limits=(0, highest)),
        legend=dict(title="engine orders at"),
    )

    def aside(waves: xr.DataArray, mode: Any) -> Any:
        """Places beside each other, so that bars of neighbouring modes stay apart."""
        return np.abs(waves.values) + _ASIDE * (mode - (n_modes - 1) / 2)

    colors = FAMILY(np.linspace(0.0, 1.0, n_modes))
    for mode, (of_mode, color) in enumerate(zip(by_mode, colors, strict=True)):
        low, high = of_mode.min(axis=1), of_mode.max(axis=1)
        at = aside(dataset.nodal_diameter, mode)
        bars = np.stack([np.stack([at, low], axis=-1), np.stack([at, high], axis=-1)], axis=1)
        panel.add("segments", bars, colors=[color], linewidths=3)
        for end in (low, high):
            panel.line(at, end, linestyle="", marker="_", color=color, markersize=7)
    for speed, style in zip((speeds[0], speeds[-1]), (":", "-"), strict=True):
        if speed == 0:
            continue
        orders = np.arange(int(np.ceil(60 * highest / speed)) + 1)
        folded = np.abs((orders + n_sectors // 2) % n_sectors - n_sectors // 2)
        look: Any = dict(linestyle=style, color=GREY, linewidth=0.9)
        panel.line(folded, orders * speed / 60, f"{speed:g} / min", **look)
    at = aside(dataset.crossing_nodal_diameter, dataset.crossing_mode.values)
    frequency = dataset.crossing_frequency.values
    panel.line(at, frequency, linestyle="", marker="o", color="k", markersize=4)
    for x, y, order in zip(at, frequency, dataset.crossing_order.values, strict=True):
        panel.text((x, y), f"{order}", offset=(4, 3), fontsize=8)
    return Picture([panel])
