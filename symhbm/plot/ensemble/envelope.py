"""Ensembles: where the responses of many samples lie."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from symhbm.continuation import Status
from symhbm.numerics import FloatArray, check
from symhbm.plot.curves import (
    check_curves,
    draw_line,
    drawn,
    response_panel,
    shown_amplitude,
    traced,
)
from symhbm.plot.drawing import Moving, Scale, check_anything, check_dims, one_solution, scale_of
from symhbm.plot.ensemble.spread import Spread, draw_density, spread_of
from symhbm.plot.lines import Line
from symhbm.plot.looks import Look, pictured
from symhbm.plot.picture import Panel, Picture
from symhbm.plot.places import Chosen, Shown
from symhbm.results.reading import curve_status

TUNED = "#d55e00"
_NAMED: Any = {
    "highest": dict(color="#0072b2", linewidth=0.9, linestyle="-"),
    "lowest": dict(color="#007a56", linewidth=0.9, linestyle=(0, (6, 1.5, 1.2, 1.5))),
}
"""Looks of the samples with the highest and the lowest peak."""
_DOTS: Any = dict(linestyle="", marker=".", markersize=2.5)
STYLES = ("bands", "density")


@pictured
def envelope(
    dataset: xr.Dataset,
    *,
    tuned: xr.Dataset | None = None,
    place: Shown = None,
    style: str = "bands",
    quantiles: ArrayLike = (0.05, 0.95),
    samples: int = 0,
    extremes: bool = True,
    scale: str = "decibel",
    unit: str = "m",
    **common: Unpack[Look],
) -> Picture:
    """Draw where the responses of an ensemble lie, with the median, as bands or as a density.

    On a grid (``at=``) these are the values at the grid; peaks lie between. Paths are read off a
    common grid of 1201 values as `response` draws them. What did not converge is left out, and the
    legend tells how much.

    Where samples have several responses at one value, as on curves that fold, bands begin at the
    smallest and end at the largest ones, the median of either is drawn, and the legend tells how
    many samples they are. A density counts all of them.

    Parameters
    ----------
    dataset
        A result of `symhbm.frf` or `symhbm.follow` with the dimension ``sample``.
    tuned
        One curve to compare with, of the same moving parameter.
    place
        What to show, as of `response`: by default the largest response of all.
    style
        ``"bands"`` from the smallest to the largest and between quantiles, or ``"density"``: the
        share of the samples that pass each of 300 by 200 cells.
    quantiles : (2,)
        Lower and upper quantile of the inner band.
    samples
        How many samples, from the first on, are drawn as thin lines.
    extremes
        Draw and name the samples with the highest and the lowest peak, the latter of the samples
        that converged throughout.
    scale, unit
        As of `response`, by default dB re 1 m.
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError, ValueError
        For a dataset that is no ensemble of curves, one without a converged point, and bad
        arguments.

    Examples
    --------
    >>> import numpy as np
    >>> import xarray as xr
    >>> import symhbm as sh
    >>> disk = sh.bladed_disk(
    ...     5, mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e5, friction_coefficient=0.5, normal_load=10,
    ... )
    >>> problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(2))
    >>> loads = xr.DataArray(np.linspace(8, 12, 15).reshape(3, 5), dims=("sample", "contact"))
    >>> grid = np.linspace(60, 95, 31)
    >>> ensemble = sh.frf(problem, (60, 95), at=grid, over={"normal_load": loads})
    >>> sh.plot.envelope(ensemble, style="density", place="blade 3").savefig("disks.svg")
    """
    parameter, where = check_curves(dataset, place)
    check.known("sample", [str(dim) for dim in dataset.dims], "dimension of the dataset")
    allowed = "sample", parameter.along, "dof", "solution"
    check_dims(dataset["amplitude"], allowed, "one ensemble")
    check_anything(dataset, "amplitude")
    check.one_of("style", style, STYLES)
    edges = check.array("quantiles", quantiles, "non-negative")
    if edges.shape != (2,) or not edges[0] < edges[1] <= 1:
        raise ValueError(
            f"quantiles={check.shown(quantiles)}: expected a lower and an upper one from 0 to 1"
        )
    samples = check.integer("samples", samples, 0, dataset.sizes["sample"])
    extremes = check.flag("extremes", extremes)
    shown = scale_of(scale, unit, dataset)
    reference = None if tuned is None else drawn(_tuned(tuned, parameter, place), shown)[:2]
    total, dataset = dataset.sizes["sample"], _begun(dataset)
    spread = spread_of(dataset, parameter, where)
    joined = all(amplitude.ndim == 1 for _, amplitude in spread.curves)
    panel = response_panel(dataset, parameter, where, shown)
    if style == "bands":
        _bands(panel, spread, edges, shown, parameter.along != "point")
    else:
        draw_density(panel, spread.curves, shown, joined=joined)
        panel.legend_at = "below"
    look: Any = dict(color="#56b4e9", linewidth=0.5, alpha=0.8) | ({} if joined else _DOTS)
    for number, (value, amplitude) in enumerate(spread.curves[:samples]):
        panel.line(value, shown.of(amplitude), "" if number else "single samples", **look)
    _medians(panel, spread, shown)
    named = _extreme_samples(dataset, spread, where) if extremes else {}
    for kind, number in named.items():
        name = dataset["sample"].values[number] if "sample" in dataset.coords else number
        _draw_sample(panel, dataset.isel(sample=number), parameter, where, shown, _NAMED[kind])
        panel.entry(f"sample {name}, {kind} peak", **_NAMED[kind])
    if reference is not None:
        panel.line(*reference, "tuned", color=TUNED, linestyle=(0, (5, 1.5)))
    left_out = _left_out(spread.high, parameter.along != "point")
    number = total - dataset.sizes["sample"]
    waiting = f"not computed yet:\n{number} of {total} samples" if number else ""
    for text in filter(None, (_of_several(spread), left_out, waiting)):
        panel.entry(text, linestyle="")
    return Picture([panel])


def _quantiles(rows: FloatArray, at: list[float]) -> FloatArray:
    """Quantiles (len(at), n) of rows (n_samples, n), NaN where no row has a value."""
    covered = np.isfinite(rows).any(axis=0)
    result = np.full((len(at), rows.shape[1]), np.nan)
    if covered.any():
        result[:, covered] = np.nanquantile(rows[:, covered], at, axis=0)
    return result


def _bands(panel: Panel, spread: Spread, edges: FloatArray, scale: Scale, on_grid: bool) -> None:
    """Fill from the smallest to the largest response, and between two quantiles."""
    lowest, low = scale.of(_quantiles(spread.low, [0.0, edges[0]]))
    high, highest = scale.of(_quantiles(spread.high, [edges[1], 1.0]))
    inner = xr.DataArray([low, high], {"quantile": edges}, ("quantile", "value"))
    text = f"smallest to largest of {len(spread.high)}" + on_grid * ", on the grid"
    draw_bands(panel, spread.value, (lowest, highest), inner, text)


def draw_bands(
    panel: Panel, value: FloatArray, ends: tuple[Any, Any], inner: xr.DataArray, text: str
) -> None:
    """Fill from the smallest to the largest response, and between pairs of quantiles.

    ``ends`` (n,) each, ``inner`` (n_quantiles, n) with ascending ``quantile``; what is left in the
    middle is a line.
    """
    panel.band(value, *ends, text, color="0.87", linewidth=0)
    shares, last = inner["quantile"].values.tolist(), inner.sizes["quantile"] - 1
    for k, low in enumerate(inner.values[: (last + 1) // 2]):
        text = f"{100 * shares[k]:g} to {100 * shares[last - k]:g} %"
        panel.band(
            value, low, inner.values[last - k], text, color=f"{0.68 - 0.1 * k:g}", linewidth=0
        )
    if last % 2 == 0:
        middle = shares[last // 2]
        text = "median" if middle == 0.5 else f"{100 * middle:g} %"
        panel.line(value, inner.values[last // 2], text, color="black")


def _medians(panel: Panel, spread: Spread, scale: Scale) -> None:
    """Draw the median; where samples have several responses, that of the largest and smallest."""
    several = bool(spread.several.any())
    upper = scale.of(_quantiles(spread.high, [0.5])[0])
    panel.line(spread.value, upper, "median" + " of the largest" * several, color="black")
    if several:
        lower = scale.of(_quantiles(spread.low, [0.5])[0])
        lower = np.where(lower < upper, lower, np.nan)
        look: Any = dict(color="black", linestyle=(0, (1.2, 1.2)))
        panel.line(spread.value, lower, "median of the smallest", **look)


def _extreme_samples(dataset: xr.Dataset, spread: Spread, where: Chosen) -> dict[str, int]:
    """Numbers of the samples with the highest and the lowest peak, if these are two."""
    tops = np.array([np.nanmax(a, initial=-np.inf) for _, a in spread.curves])
    peaks = dataset.get("peak_amplitude")
    if peaks is not None and {*peaks.dims} == {"sample", "peak"} and "peak_dof" in dataset:
        known = dataset["peak_dof"].isin([*where.dofs]) & np.isfinite(peaks)
        located = peaks.where(known, -np.inf).transpose("sample", "peak").values
        tops = np.maximum(tops, located.max(axis=1, initial=-np.inf))
    complete = np.isfinite(spread.high).all(axis=1)
    found = {"highest": int(tops.argmax())}
    if complete.any():
        found["lowest"] = int(np.where(complete, tops, np.inf).argmin())
    return found if len(tops) > 1 else {}


def _draw_sample(
    panel: Panel, curve: xr.Dataset, parameter: Moving, where: Chosen, scale: Scale, look: Any
) -> None:
    """Draw the whole curve of a sample, or all its solutions."""
    if curve.sizes.get("solution", 1) > 1:
        amplitude = shown_amplitude(curve, where).transpose(parameter.along, "solution")
        level = scale.of(amplitude.values)
        panel.line(curve[parameter.name].values, level, color=look["color"], **_DOTS)
        return
    line = traced(one_solution(curve), parameter, where).line
    draw_line(panel, line, scale, **look)


def _of_several(spread: Spread) -> str:
    """Text on samples that have several responses at one value."""
    several = spread.several
    if not several.any():
        return ""
    count = several.any(axis=1).sum()
    at = spread.value[several.any(axis=0)]
    return (
        f"several responses at one value:\n{count} of {len(several)} samples,\n"
        f"from {at[0]:.4g} to {at[-1]:.4g}"
    )


def _tuned(tuned: xr.Dataset, parameter: Moving, place: Any) -> Line:
    """The curve to compare with."""
    try:
        tuned_parameter, where = check_curves(tuned, place)
        check_dims(tuned["amplitude"], (tuned_parameter.along, "dof", "solution"), "one curve")
        check_anything(tuned, "amplitude")
        tuned = one_solution(tuned)
    except (KeyError, TypeError, ValueError) as error:
        raise type(error)(f"tuned: {error.args[0]}") from None
    if tuned_parameter.name != parameter.name:
        raise ValueError(
            f"tuned: expected a curve over {parameter.name}, got one over {tuned_parameter.name}"
        )
    return traced(tuned, tuned_parameter, where).line


def _begun(dataset: xr.Dataset) -> xr.Dataset:
    """The samples that were computed, by their names in the whole ensemble."""
    status = curve_status(dataset)
    if status is None:
        return dataset
    if "sample" not in dataset.coords:
        dataset = dataset.assign_coords(sample=np.arange(dataset.sizes["sample"]))
    return dataset.isel(sample=status.values != str(Status.NOT_STARTED))


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
