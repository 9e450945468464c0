"""Values of disks blade by blade."""

from typing import Any, Unpack

import numpy as np
import xarray as xr

from symhbm.numerics import FloatArray, check
from symhbm.plot.drawing import check_variables, nothing_to_draw, scaled
from symhbm.plot.looks import Look, pictured
from symhbm.plot.picture import Axis, Panel, Picture
from symhbm.results.reading import COMPLETE, curve_status, set_dimensions

_WORST = "#d55e00"


@pictured
def blades(values: xr.DataArray | xr.Dataset, **common: Unpack[Look]) -> Picture:
    """Draw bars by blade; of an ensemble the range, the quartiles and the median of each.

    The sample with the largest absolute value of all is marked. Samples with a NaN are left out,
    and the legend tells how many.

    Parameters
    ----------
    values
        An array over ``dof`` or ``contact``, and ``sample`` where there are several: amplitudes,
        amplification factors, energies. Its ``long_name`` and ``units`` become the label. Or a
        result of `symhbm.frf` or `symhbm.follow`, of which it is the largest displacement of all
        points, without curves that are not complete.
    common
        As of all pictures.

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
    >>> problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(3))
    >>> draws = sh.mistuning.uniform(disk, 3, seed=1, contact_stiffness=0.2)
    >>> mistuned = sh.frf(problem, (200, 220), at=range(200, 221), over=draws)
    >>> figure = sh.plot.blades(mistuned)
    >>> figure.savefig("blades.png")
    """
    if isinstance(values, xr.Dataset):
        values = _largest(values)
    if not isinstance(values, xr.DataArray) or values.dtype.kind not in "iuf":
        raise TypeError(
            f"values={check.shown(values)}: expected a result, or a DataArray of numbers"
        )
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
    x, label = np.arange(table.shape[1]), str(values.attrs.get("long_name", values.name or "value"))
    step = -(-len(x) // 26)
    labels = values[dim].values if dim in values.coords else x
    across = Axis("contact" if dim == "contact" else "blade", grid=False)
    across.ticks = x[::step], labels[::step].tolist()
    across.tick_size = "medium" if len(x) <= 10 else "small"
    panel = Panel(across, Axis(f"{label} [{units}]" if units else label))
    if several:
        _boxes(panel, x, factor * table, complete, values)
    else:
        shown = np.where(finite[0], factor * table[0], np.nan)
        panel.add("bars", x, 0, shown, width=0.7, color="0.35")
        for blank in x[~finite[0]]:
            panel.text((blank, 0), "?", offset=(0, 0), ha="center", va="bottom")
    if table[complete].min() < 0 < table[complete].max():
        panel.add("level", 0, color="0.3", linewidth=0.8)
    return Picture([panel])


def _largest(dataset: xr.Dataset) -> xr.DataArray:
    """Largest displacement of each blade over all points [m], NaN where a curve is incomplete."""
    status = curve_status(dataset)
    check_variables(dataset, "amplitude", *["status"] * (status is None))
    amplitude = dataset["amplitude"]
    kept = {*set_dimensions(dataset), "dof"}
    largest = amplitude.max([dim for dim in amplitude.dims if dim not in kept])
    if status is not None:
        largest = largest.where(status.isin([*map(str, COMPLETE)]))
    if not largest.notnull().any():
        raise nothing_to_draw(dataset)
    return largest.assign_attrs(long_name="largest displacement of all points", units="m")


def _boxes(
    panel: Panel, x: np.ndarray, table: FloatArray, complete: np.ndarray, values: xr.DataArray
) -> None:
    low, first, middle, third, high = np.quantile(table[complete], [0, 0.25, 0.5, 0.75, 1], axis=0)
    look: Any = dict(width=0.7, linewidth=0)
    text = f"smallest to largest of {complete.sum()}"
    panel.add("bars", x, low, high, label=text, color="0.87", **look)
    panel.add("bars", x, first, third, label="25 to 75 %", color="0.6", **look)
    look = dict(color="black", markersize=13, markeredgewidth=1.8, linestyle="", marker="_")
    panel.line(x, middle, "median", **look)
    worst = int(np.argmax(np.where(complete, np.nan_to_num(np.abs(table)).max(axis=1), -1)))
    name = values["sample"].values[worst] if "sample" in values.coords else worst
    look = dict(color=_WORST, linestyle=":", marker="o", markersize=3.5, linewidth=0.8)
    panel.line(x, table[worst], f"sample {name}, the largest", **look)
    if not complete.all():
        panel.entry(f"left out, NaN: {(~complete).sum()} of {len(complete)}", linestyle="")
    panel.y.room, panel.y.sticky = 0.04, False
