"""Natural frequencies over nodal diameters, with what engine orders excite: the SAFE diagram."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from symhbm.plot.disks.campbell import FREQUENCY, GREY, colors
from symhbm.plot.drawing import OUTSIDE, canvas, check_variables, figure_of

_ASIDE = 0.14
"""Distance of the bars of neighbouring modes, in nodal diameters."""
_ABOVE = 1.06
"""Upper end of the frequencies shown over the highest natural one."""


def interference(dataset: xr.Dataset, *, ax: Axes | None = None) -> Figure:
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
    table = dataset.frequency.transpose("speed", "mode", "nodal_diameter")
    waves, highest = dataset.nodal_diameter.values, _ABOVE * float(dataset.frequency.max())
    along = np.argsort(np.abs(waves), kind="stable")
    with canvas(ax) as axes:
        n_modes = dataset.sizes["mode"]
        by_mode = table.transpose("mode", "nodal_diameter", "speed").values[:, along]
        for mode, (of_mode, color) in enumerate(zip(by_mode, colors(n_modes), strict=True)):
            low, high = of_mode.min(axis=1), of_mode.max(axis=1)
            # Beside each other, so that bars of neighbouring modes stay apart.
            at = np.abs(waves)[along] + _ASIDE * (mode - (n_modes - 1) / 2)
            axes.vlines(at, low, high, color=color, lw=3)
            for end in (low, high):
                axes.plot(at, end, "_", color=color, ms=7)
        for speed, style in zip((speeds[0], speeds[-1]), (":", "-"), strict=True):
            if speed == 0:
                continue
            last = int(np.ceil(60 * highest / speed))
            orders = np.arange(last + 1)
            folded = np.abs((orders + n_sectors // 2) % n_sectors - n_sectors // 2)
            line = f"{speed:g} / min"
            axes.plot(folded, orders * speed / 60, style, color=GREY, lw=0.9, label=line)
        at = np.abs(dataset.crossing_nodal_diameter.values)
        at = at + _ASIDE * (dataset.crossing_mode.values - (n_modes - 1) / 2)
        axes.plot(at, dataset.crossing_frequency, "o", color="k", ms=4)
        for x, y, order in zip(
            at, dataset.crossing_frequency.values, dataset.crossing_order.values, strict=True
        ):
            axes.annotate(f"{order}", (x, y), (4, 3), textcoords="offset points", fontsize=8)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set(xlim=(-0.5, n_sectors // 2 + 0.5), ylim=(0, highest))
        axes.set(xlabel="nodal diameters", ylabel=FREQUENCY)
        axes.legend(title="engine orders at", **OUTSIDE)
        return figure_of(axes)
