"""A map of errors over engine order and normal load: colours, signed per cent and borders."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

LEVELS = {0.01: (0, (2, 1)), 0.1: "-"}
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
    ax.pcolormesh(columns, rows, size, norm=norm, cmap=COLOUR_MAP)
    for level, style in LEVELS.items():
        _border(ax, size > level, columns, rows, style)
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
        )
    ax.set_xticks(order, [str(int(n)) for n in error.engine_order.values])
    ax.set_yticks(load, [f"{value:.3g}" for value in error.normal_load.values])
    ax.tick_params(length=0)


def _border(ax: Axes, above: np.ndarray, columns: np.ndarray, rows: np.ndarray, style) -> None:
    """Draw the sides that part cells above a level from those below it."""
    sides = [
        ([columns[i + 1]] * 2, [rows[j], rows[j + 1]])
        for j, i in np.argwhere(above[:, 1:] != above[:, :-1])
    ]
    sides += [
        ([columns[i], columns[i + 1]], [rows[j + 1]] * 2)
        for j, i in np.argwhere(above[1:] != above[:-1])
    ]
    for color, width, pattern in (("white", 4.0, "-"), ("black", 2.0, style)):
        for x, y in sides:
            ax.plot(x, y, color=color, linewidth=width, linestyle=pattern, zorder=3)


def _per_cent(error: float) -> str:
    """Signed, two digits; nothing below the hundredth part of a per cent."""
    size = 100 * abs(error)
    if size < 100 * COLOURS[0]:
        return "<0.01"
    sign = "+" if error > 0 else "\N{MINUS SIGN}"
    return f"{sign}{size:.0f}" if size >= 10 else f"{sign}{size:.2g}"
