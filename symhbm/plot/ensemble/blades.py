"""Values of disks blade by blade."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from symhbm.numerics import FloatArray, check
from symhbm.plot.drawing import OUTSIDE, canvas, figure_of, scaled

_WORST = "#d55e00"


def blades(values: xr.DataArray, *, ax: Axes | None = None) -> Figure:
    """Draw bars by blade; of an ensemble the range, the quartiles and the median of each.

    The sample with the largest absolute value of all is marked. Samples with a NaN are left out,
    and the legend tells how many.

    Parameters
    ----------
    values
        An array over ``dof`` or ``contact``, and ``sample`` where there are several: amplitudes,
        amplification factors, energies. Its ``long_name`` and ``units`` become the label.
    ax
        Axes to draw into; by default a new figure.

    Raises
    ------
    TypeError, ValueError
        For anything but such an array, and one without a finite value.

    Examples
    --------
    >>> import symhbm as sh
    >>> disk = sh.bladed_disk(
    ...     13, mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e6, friction_coefficient=0.5, normal_load=10,
    ... )
    >>> problem = sh.HarmonicBalance(disk, sh.EngineOrder(3))
    >>> draws = sh.mistuning.uniform(disk, 3, seed=1, contact_stiffness=0.2)
    >>> mistuned = sh.frf(problem, (200, 220), at=range(200, 221), over=draws)
    >>> figure = sh.plot.blades(mistuned.amplitude.max("frequency"))
    >>> figure.savefig("blades.png")
    """
    if not isinstance(values, xr.DataArray) or values.dtype.kind not in "iuf":
        raise TypeError(f"values={check.shown(values)}: expected a DataArray of numbers")
    dim = "contact" if "contact" in values.dims else "dof"
    if set(values.dims) not in ({dim}, {dim, "sample"}):
        raise ValueError(
            f"values: expected the dimension dof or contact, and sample at most, "
            f"got {tuple(map(str, values.dims))}"
        )
    several = "sample" in values.dims
    table = values.transpose(..., dim).values.astype(float).reshape(-1, values.sizes[dim])
    finite = np.isfinite(table)
    complete = np.array(finite.all(axis=1) if several else finite.any(axis=1))
    if not complete.any():
        raise ValueError("values: expected finite numbers, all samples hold NaN or infinity")
    units = str(values.attrs.get("units", "1"))
    units = "" if units == "1" else units
    factor = 1.0
    if units in ("m", "N", "J"):
        factor, units = scaled(float(np.abs(table[finite]).max()), units)
    x = np.arange(table.shape[1])
    with canvas(ax) as ax:
        if several:
            _boxes(ax, x, factor * table, complete, values)
        else:
            ax.bar(x, np.where(finite[0], factor * table[0], np.nan), width=0.7, color="0.35")
            for blank in x[~finite[0]]:
                ax.annotate("?", (blank, 0), ha="center", va="bottom")
        label = str(values.attrs.get("long_name", values.name or "value"))
        ax.set_ylabel(f"{label} [{units}]" if units else label)
        ax.set_xlabel("contact" if dim == "contact" else "blade")
        step = -(-len(x) // 26)
        labels = values[dim].values if dim in values.coords else x
        size = "medium" if len(x) <= 10 else "small"
        ax.set_xticks(x[::step], labels[::step], fontsize=size)
        ax.grid(axis="x", visible=False)
        if table[complete].min() < 0 < table[complete].max():
            ax.axhline(0, color="0.3", linewidth=0.8)
    return figure_of(ax)


def _boxes(
    ax: Axes, x: np.ndarray, table: FloatArray, complete: np.ndarray, values: xr.DataArray
) -> None:
    low, first, middle, third, high = np.quantile(table[complete], [0, 0.25, 0.5, 0.75, 1], axis=0)
    look: Any = dict(width=0.7, linewidth=0)
    text = f"smallest to largest of {complete.sum()}"
    ax.bar(x, high - low, bottom=low, color="0.87", label=text, **look)
    ax.bar(x, third - first, bottom=first, color="0.6", label="25 to 75 %", **look)
    look = dict(color="black", markersize=13, markeredgewidth=1.8)
    ax.plot(x, middle, linestyle="", marker="_", label="median", **look)
    worst = int(np.argmax(np.where(complete, np.nan_to_num(np.abs(table)).max(axis=1), -1)))
    name = values["sample"].values[worst] if "sample" in values.coords else worst
    label = f"sample {name}, the largest"
    ax.plot(x, table[worst], "o:", color=_WORST, markersize=3.5, linewidth=0.8, label=label)
    if not complete.all():
        ax.plot([], [], " ", label=f"left out, NaN: {(~complete).sum()} of {len(complete)}")
    ax.use_sticky_edges = False
    ax.margins(y=0.04)
    handles, labels = ax.get_legend_handles_labels()
    order = np.argsort([isinstance(handle, Line2D) for handle in handles], kind="stable")
    ax.legend([handles[i] for i in order], [labels[i] for i in order], **OUTSIDE)
