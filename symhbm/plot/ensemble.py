"""Ensembles: the band of responses of many samples, and values blade by blade."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from symhbm.model import Place
from symhbm.numerics import FloatArray, check
from symhbm.plot.curves import check_curves, drawn, label_axes, picture_of, shown_amplitude
from symhbm.plot.drawing import (
    OUTSIDE,
    Moving,
    canvas,
    check_anything,
    check_dims,
    figure_of,
    is_wide,
    one_solution,
    scale_of,
    scaled,
)
from symhbm.plot.lines import Line

N_VALUES = 1201
"""Values of the common grid of paths: more than a figure has pixels."""
TUNED = "#d55e00"


def envelope(
    dataset: xr.Dataset,
    *,
    tuned: xr.Dataset | None = None,
    dof: Place | None = None,
    quantiles: ArrayLike = (0.05, 0.95),
    samples: int = 0,
    scale: str = "decibel",
    unit: str = "m",
    ax: Axes | None = None,
) -> Figure:
    """Draw where the responses of an ensemble lie: extremes, quantiles and median.

    On a grid (``at=``) they are those of the values at the grid; peaks lie between. Paths are read
    off a common grid of 1201 values as `response` draws them. What did not converge is left out,
    and the legend tells how much.

    Parameters
    ----------
    dataset
        A result of `symhbm.frf` or `symhbm.follow` with the dimension ``sample``.
    tuned
        One curve to compare with, of the same moving parameter.
    dof
        The degree of freedom to show, by number or by name as ``"tip:y"``; by default the largest
        response of all.
    quantiles : (2,)
        Lower and upper quantile of the inner band.
    samples
        How many samples, from the first on, are drawn as thin lines.
    scale, unit
        As of `response`, by default dB re 1 m.
    ax
        Axes to draw into; by default a new figure.

    Raises
    ------
    TypeError, KeyError, ValueError
        For a dataset that is no ensemble of curves, one that folds, one without a converged point,
        and bad arguments.

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
    >>> sh.plot.envelope(mistuned).savefig("envelope.png")
    """
    parameter, dof = check_curves(dataset, dof)
    check.known("sample", [str(dim) for dim in dataset.dims], "dimension of the dataset")
    dataset = one_solution(dataset)
    check_dims(dataset["amplitude"], ("sample", parameter.along, "dof"), "one ensemble")
    check_anything(dataset, "amplitude")
    edges = check.array("quantiles", quantiles, "non-negative")
    if edges.shape != (2,) or not edges[0] < edges[1] <= 1:
        raise ValueError(
            f"quantiles={check.shown(quantiles)}: expected a lower and an upper one from 0 to 1"
        )
    samples = check.integer("samples", samples, 0, dataset.sizes["sample"])
    shown = scale_of(scale, unit, dataset)
    reference = None if tuned is None else drawn(_tuned(tuned, parameter, dof), shown)[:2]
    value, amplitude = _on_common_grid(dataset, parameter, dof)
    covered = np.isfinite(amplitude).any(axis=0)
    rows = np.full((5, len(value)), np.nan)
    if covered.any():
        at = [0.0, edges[0], 0.5, edges[1], 1.0]
        rows[:, covered] = np.nanquantile(amplitude[:, covered], at, axis=0)
    lowest, low, middle, high, highest = shown.of(rows)
    with canvas(ax) as ax:
        text = f"smallest to largest of {len(amplitude)}"
        ax.fill_between(value, lowest, highest, color="0.87", linewidth=0, label=text)
        text = f"{100 * edges[0]:g} to {100 * edges[1]:g} %"
        ax.fill_between(value, low, high, color="0.68", linewidth=0, label=text)
        for number in range(samples):
            label = "single samples" if number == 0 else None
            level = shown.of(amplitude[number])
            ax.plot(value, level, color="#0072b2", linewidth=0.5, alpha=0.7, label=label)
        ax.plot(value, middle, color="black", label="median")
        if reference is not None:
            ax.plot(*reference, color=TUNED, linestyle=(0, (5, 1.5)), label="tuned")
        left_out = _left_out(amplitude, parameter.along != "point")
        if left_out:
            ax.plot([], [], " ", label=left_out)
        label_axes(ax, dataset, parameter.name, dof, shown)
        ax.legend(**OUTSIDE)
    return figure_of(ax)


def _on_common_grid(
    dataset: xr.Dataset, parameter: Moving, dof: int | None
) -> tuple[FloatArray, FloatArray]:
    """Values (n,) and amplitudes (n_samples, n) [m]; NaN where a sample has none."""
    if parameter.along != "point":
        amplitude = shown_amplitude(dataset, dof).transpose("sample", parameter.along)
        return dataset[parameter.name].values, amplitude.values
    every = dataset[parameter.name].values
    low, high = np.nanmin(every), np.nanmax(every)
    wide = parameter.name != "frequency" and is_wide(every[np.isfinite(every)])
    value = (np.geomspace if wide else np.linspace)(low, high, N_VALUES)
    lines = [_function(dataset.isel(sample=i), parameter, dof) for i in range(len(every))]
    return value, np.array([line.read(value) for line in lines])


def _function(curve: xr.Dataset, parameter: Moving, dof: int | None) -> Line:
    """The line of a curve that does not fold."""
    line = picture_of(curve, parameter, dof).line
    if not line.is_function:
        raise ValueError(
            "dataset: expected curves that do not fold, which have one amplitude at each value; "
            "compute the ensemble on a grid, with at="
        )
    return line


def _tuned(tuned: xr.Dataset, parameter: Moving, dof: int | None) -> Line:
    """The curve to compare with."""
    try:
        tuned_parameter, dof = check_curves(tuned, dof)
        check_dims(tuned["amplitude"], (tuned_parameter.along, "dof", "solution"), "one curve")
        check_anything(tuned, "amplitude")
        tuned = one_solution(tuned)
    except (KeyError, TypeError, ValueError) as error:
        raise type(error)(f"tuned: {error.args[0]}") from None
    if tuned_parameter.name != parameter.name:
        raise ValueError(
            f"tuned: expected a curve over {parameter.name}, got one over {tuned_parameter.name}"
        )
    return picture_of(tuned, tuned_parameter, dof).line


def _left_out(amplitude: FloatArray, on_grid: bool) -> str:
    missing = np.isnan(amplitude)
    whole = missing.all(axis=1)
    some = missing.any(axis=1) & ~whole
    parts = [f"{whole.sum()} of {len(amplitude)} samples"] if whole.any() else []
    if some.any():
        count = f"{missing[some].sum()} points"
        count = count if on_grid else f"{100 * missing[some].mean():.2g} % of the band"
        parts.append(f"{count} in {some.sum()} sample{'s' * bool(some.sum() > 1)}")
    return "left out, not converged:\n" + ",\n".join(parts) if parts else ""


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
        ax.set_xticks(x[::step], labels[::step])
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
    ax.plot(x, table[worst], "o:", color=TUNED, markersize=3.5, linewidth=0.8, label=label)
    if not complete.all():
        ax.plot([], [], " ", label=f"left out, NaN: {(~complete).sum()} of {len(complete)}")
    ax.use_sticky_edges = False
    ax.margins(y=0.04)
    handles, labels = ax.get_legend_handles_labels()
    order = np.argsort([isinstance(handle, Line2D) for handle in handles], kind="stable")
    ax.legend([handles[i] for i in order], [labels[i] for i in order], **OUTSIDE)
