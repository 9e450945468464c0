"""A map of errors over engine order and normal load: colours, signed per cent and borders."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm

LEVELS = {0.1: (("white", 7.0), ("black", 4.6)), 0.01: (("black", 2.6), ("white", 1.1))}
"""Colours and widths of the borders of equal errors, one on the other: where two borders are one,
both are seen."""
COLOURS = 1e-4, 1.0
"""Errors of the lightest and the darkest colour."""
COLOUR_MAP = "cividis_r"
DARK = 0.04
"""Error from which the colour is so dark that text on it is white."""


def draw_map(ax: Axes, error: xr.DataArray, slips: xr.DataArray, norm: LogNorm) -> None:
    """Colours and signed per cent by cell, and the lines of equal error."""
    order = np.arange(error.sizes["engine_order"], dtype=float)
    load = np.log10(error.normal_load.values)
    size = np.clip(np.abs(error.values.T), *COLOURS)
    half = (load[1] - load[0]) / 2
    columns = np.append(order - 0.5, order[-1] + 0.5)
    rows = np.append(load - half, load[-1] + half)
    ax.pcolormesh(columns, rows, size, norm=norm, cmap=COLOUR_MAP, rasterized=True)
    for order_drawn, (level, lines) in enumerate(LEVELS.items()):
        _border(ax, size > level, columns, rows, lines, 3 + order_drawn)
    for j, i in np.ndindex(*size.shape):
        text = _per_cent(float(error.values[i, j])) if slips.values[i, j] else "S"
        colour = "white" if size[j, i] > DARK else "black"
        ax.text(
            float(order[i]),
            float(load[j]),
            text,
            ha="center",
            va="center",
            fontsize=8.5,
            color=colour,
            zorder=6,
        )
    ax.set_xticks(order, [str(int(n)) for n in error.engine_order.values])
    ax.set_yticks(load, [f"{value:.3g}" for value in error.normal_load.values])
    ax.tick_params(length=0)


def _border(
    ax: Axes,
    above: np.ndarray,
    columns: np.ndarray,
    rows: np.ndarray,
    lines: Sequence[tuple[str, float]],
    zorder: float,
) -> None:
    """Draw the sides that part cells above a level from those below it, without a gap."""
    sides = [
        [(columns[i + 1], rows[j]), (columns[i + 1], rows[j + 1])]
        for j, i in np.argwhere(above[:, 1:] != above[:, :-1])
    ]
    sides += [
        [(columns[i], rows[j + 1]), (columns[i + 1], rows[j + 1])]
        for j, i in np.argwhere(above[1:] != above[:-1])
    ]
    for color, width in lines:
        look: Any = dict(colors=color, linewidths=width, capstyle="projecting", zorder=zorder)
        ax.add_collection(LineCollection(sides, **look))


def _per_cent(error: float) -> str:
    """Signed, two digits; nothing below the hundredth part of a per cent."""
    size = 100 * abs(error)
    if size < 100 * COLOURS[0]:
        return "<0.01"
    sign = "+" if error > 0 else "\N{MINUS SIGN}"
    return f"{sign}{size:.0f}" if size >= 10 else f"{sign}{size:.2g}"
