"""The axes of the source's figures: its tick labels tell them, its lines are not known."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.lines import Line2D

import symhbm as sh

Ticks = tuple[float, float, float]
"""First and last tick, which end the axis, and the step between ticks."""


def set_ticks(axis: Axis, ticks: Ticks) -> None:
    """Give an axis the range and the ticks of the source."""
    first, last, step = ticks
    axis.set_ticks(np.arange(first, last + step / 2, step))
    axis.set_view_interval(first, last, ignore=True)


def set_axes(ax: Axes, frequency: Ticks, level: Ticks) -> None:
    """Give a response the ranges and ticks of the source, in Hz and dB."""
    set_ticks(ax.xaxis, frequency)
    set_ticks(ax.yaxis, level)
    ax.set(xlabel="frequency [Hz]", ylabel="amplitude [dB re 1 m]")


def draw_blades(ax: Axes, curve: xr.Dataset, colors: np.ndarray, **look: Any) -> list[Line2D]:
    """Draw every blade of one curve in its colour, and return the lines."""
    first = len(ax.lines)
    for blade in range(curve.sizes["dof"]):
        sh.plot.response(curve, place=blade, peaks=False, ax=ax)
    lines = [*ax.lines[first:]]
    for line, color in zip(lines, colors, strict=True):
        line.set(color=color, **look)
    return lines


def in_styles(lines: Sequence[Line2D], turns: Sequence[int] | None = None) -> None:
    """Give lines the styles of the library in turn, so that they differ in greys, too."""
    for line, turn in zip(lines, turns or range(len(lines)), strict=True):
        line.set_linestyle(sh.plot.LINE_STYLES[turn % len(sh.plot.LINE_STYLES)])
