"""Natural frequencies of disks over the speed (Campbell) and over nodal diameters (SAFE)."""

from typing import Any, Unpack

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

from symhbm.numerics import FloatArray
from symhbm.plot.drawing import check_variables
from symhbm.plot.looks import Look, pictured
from symhbm.plot.picture import FAMILY, Axis, Panel, Picture

GREY = "0.55"
SPEED, FREQUENCY = "speed of rotation [1/min]", "natural frequency [Hz]"
_POINTS = 300
"""Speeds of a drawn line."""
ABOVE = 1.06
"""Upper end of the frequencies shown over the highest natural one."""


@pictured
def campbell(dataset: xr.Dataset, **common: Unpack[Look]) -> Picture:
    """Draw natural frequencies over the speed, a line per mode, with the lines of engine orders.

    Dots are crossings. Lines of one nodal diameter have one colour.

    Parameters
    ----------
    dataset
        A result of `symhbm.campbell`.
    common
        As of all pictures.

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
    _check_result(dataset)
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


def _check_result(dataset: xr.Dataset) -> None:
    """Raise TypeError unless a dataset is a result of `symhbm.campbell`, KeyError for a part."""
    check_variables(dataset)
    if "crossing_speed" not in dataset:
        raise TypeError("dataset: expected a result of campbell")
    check_variables(dataset, "frequency", "speed", "order")


def _smooth(frequency: xr.DataArray) -> tuple[FloatArray, FloatArray]:
    """Speeds (n,) and frequencies (n, n_modes) on a fine grid: squares of both, interpolated."""
    speed, table = frequency.speed.values, frequency.transpose("speed", "mode").values
    fine = np.union1d(np.linspace(speed[0], speed[-1], _POINTS), speed)
    return fine, np.sqrt(PchipInterpolator(speed**2, table**2)(fine**2))


_ASIDE = 0.14
"""Distance of the bars of neighbouring modes, in nodal diameters."""


@pictured
def interference(dataset: xr.Dataset, **common: Unpack[Look]) -> Picture:
    """Draw natural frequencies over nodal diameters, with the frequencies of engine orders.

    The SAFE or ZZENF diagram. Each mode has a bar over its nodal diameters, from its frequency at
    the lowest speed to that at the highest one. The folded lines are ``order * speed / 60`` at both
    speeds: engine order E meets the waves of ``E mod n_sectors``. A dot is a crossing, with its
    engine order on the right, or on the left where the wave runs against the rotation; the list of
    them is in the dataset.

    Parameters
    ----------
    dataset
        A result of `symhbm.campbell` of a `symhbm.Sector`.
    common
        As of all pictures.

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
    _check_result(dataset)
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
        # Two orders that meet one mode, E and n_sectors - E, are read beside each other.
        against = 2 * (order % n_sectors) > n_sectors
        side: Any = dict(offset=(-4, 3), ha="right") if against else dict(offset=(4, 3))
        panel.text((x, y), f"{order}", **side, fontsize=8)
    return Picture([panel])
