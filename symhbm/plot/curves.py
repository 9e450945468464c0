"""Response curves: amplitude over the parameter that moves."""

from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.interpolate import PchipInterpolator

from symhbm import check
from symhbm.plot.drawing import (
    Family,
    Moving,
    axis_label,
    canvas,
    check_variables,
    decibel,
    figure_of,
    is_wide,
    moving,
)

MARKERS = {"smooth": "o", "corner": "^", "fold": "s"}


def response(
    dataset: xr.Dataset, *, dof: int | None = None, peaks: bool = True, ax: Axes | None = None
) -> Figure:
    """Draw amplitude in dB (re 1 m) over the moving parameter, one line per parameter set.

    Unstable responses are dotted lines, or hollow circles. More than 14 curves have a colour bar
    in the place of a legend; those of a dimension ``sample`` are thin, without marks.

    Parameters
    ----------
    dataset
        A result of `symhbm.frf` or `symhbm.follow`.
    dof
        The degree of freedom to show; by default the largest response of all.
    peaks
        Mark the located peaks of what is shown: circles are smooth, triangles corners, vertical
        lines unbounded. Squares are folds.
    ax
        Axes to draw into; by default a new figure.

    Raises
    ------
    TypeError, KeyError
        If the dataset holds no curve.
    ValueError
        If ``dof`` is out of range.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.PointForce())
    >>> figure = sh.plot.response(sh.frf(problem, (10, 30), over={"normal_load": [1, 3]}))
    >>> figure.savefig("response.png")
    """
    about, dof = check_curves(dataset, dof)
    swept = [str(d) for d in dataset["amplitude"].dims if d not in (about.along, "dof", "solution")]
    n_samples = dataset.sizes["sample"] if "sample" in swept else 1
    family = Family(dataset, [dim for dim in swept if dim != "sample"])
    with canvas(ax) as ax:
        look: Any = {} if "sample" not in swept else dict(linewidth=0.6, alpha=0.45)
        for member in family:
            for sample in range(n_samples):
                place = member.place | ({"sample": sample} if "sample" in swept else {})
                curve = dataset.isel(place)
                points = read_points(curve, about, dof)
                several = "solution" in curve["amplitude"].dims
                _draw(ax, points, several, member.color, look | dict(linestyle=member.style))
                if peaks and "sample" not in swept:
                    _marks(ax, points, member.color)
        label_axes(ax, dataset, about.name, dof)
        family.explain(ax)
    return figure_of(ax)


def check_curves(dataset: xr.Dataset, dof: int | None) -> tuple[Moving, int | None]:
    """What moves in a dataset of curves, and the degree of freedom; raises as `response`."""
    check_variables(dataset, "amplitude", "frequency")
    about = moving(dataset)
    if about.along not in dataset["amplitude"].dims:
        raise KeyError("the dataset holds one point; a response curve has many")
    check.known("dof", [str(d) for d in dataset["amplitude"].dims], "dimension of the dataset")
    if dof is not None:
        dof = check.integer("dof", dof, 0, dataset.sizes["dof"] - 1)
    return about, dof


def shown_amplitude(dataset: xr.Dataset, dof: int | None) -> xr.DataArray:
    """Amplitude of one degree of freedom, or the largest of all; NaN where any is unknown."""
    amplitude = dataset["amplitude"]
    return amplitude.max("dof", skipna=False) if dof is None else amplitude.isel(dof=dof)


class Points(NamedTuple):
    """What to draw of one curve: its points [dB], which are unstable, and its peaks and folds."""

    value: np.ndarray
    level: np.ndarray
    unstable: np.ndarray
    marks: list[tuple[str, float, float]]

    @property
    def is_function(self) -> bool:
        """Whether the points run one way."""
        step = np.diff(self.value)
        return bool(np.all(step > 0) or np.all(step < 0))

    def through_peaks(self) -> "Points":
        """The points in ascending order with the peaks among them, however far apart they are."""
        tops = [(at, top) for _, at, top in self.marks if np.isfinite(top)]
        value = np.append(self.value, [at for at, _ in tops])
        level = np.append(self.level, [top for _, top in tops])
        unstable = np.append(self.unstable, np.zeros(len(tops), dtype=bool))
        _, first = np.unique(value, return_index=True)
        return Points(value[first], level[first], unstable[first], self.marks)


def read_points(curve: xr.Dataset, about: Moving, dof: int | None) -> Points:
    """Points of one curve without the padding at their end."""
    name = about.name
    value, level = curve[name].values, decibel(shown_amplitude(curve, dof).values)
    marks = []
    of_peak = [f"peak_{key}" for key in ("kind", name, "amplitude", "dof")]
    if all(key in curve and "peak" in curve[key].dims for key in of_peak):
        rows = zip(*(curve[key].values for key in of_peak), strict=True)
        marks = [
            (kind, float(at), float(decibel(top)))
            for kind, at, top, peak_dof in rows
            if kind and about.each == (dof is not None) and (dof is None or peak_dof == dof)
        ]
    if about.along == "point" and f"event_{name}" in curve and "event_kind" in curve:
        for kind, at in zip(curve["event_kind"].values, curve[f"event_{name}"].values, strict=True):
            if kind == "fold":
                marks.append((kind, float(at), float(level[np.nanargmin(np.abs(value - at))])))
    stability = curve["stability"].values if "stability" in curve else np.ones(level.shape)
    inside = np.isfinite(value)
    return Points(value[inside], level[inside], stability[inside] == 0, marks)


def _draw(ax: Axes, points: Points, several: bool, color: Any, look: dict[str, Any]) -> None:
    value, level, unstable = points.value, points.level, points.unstable
    if several:
        ax.plot(value, np.where(unstable, np.nan, level), ".", color=color, markersize=3.5)
        hollow = np.where(unstable, level, np.nan)
        ax.plot(value, hollow, "o", color=color, markersize=2.5, markerfacecolor="white")
        return
    if points.is_function:
        value, level, unstable, _ = points.through_peaks()
    place = np.arange(len(level), dtype=float)
    if len(level) > 2 and np.all(np.isfinite(level)):
        # Monotone between its points: nothing is drawn above a peak or below a trough.
        fine = np.union1d(np.linspace(0, len(level) - 1, 12 * len(level) + 1), place)
        if np.all(np.diff(value) > 0):
            finer = np.union1d(np.interp(fine, place, value), value)
            level, place = PchipInterpolator(value, level)(finer), np.interp(finer, value, place)
            value = finer
        else:
            value, level = (PchipInterpolator(place, along)(fine) for along in (value, level))
            place = fine
    dotted = unstable[np.floor(place).astype(int)] | unstable[np.ceil(place).astype(int)]
    ax.plot(value, np.where(dotted, np.nan, level), color=color, **look)
    if dotted.any():
        faint: Any = look | dict(linestyle=":", linewidth=1.0)
        ax.plot(value, np.where(dotted, level, np.nan), color=color, **faint)


def _marks(ax: Axes, points: Points, color: Any) -> None:
    for kind, at, level in points.marks:
        if kind in MARKERS:
            ax.plot(
                at,
                level,
                MARKERS[kind],
                color=color,
                markeredgecolor="black",
                markeredgewidth=0.6,
                markersize=4.5,
                zorder=3,
            )
        elif kind == "unbounded":
            ax.axvline(at, color=color, linestyle=":", linewidth=0.8)


def label_axes(ax: Axes, dataset: xr.Dataset, name: str, dof: int | None) -> None:
    """Labels of a response over the parameter ``name``; a wide one gets a logarithmic axis."""
    ax.set_xlabel(axis_label(name))
    which = "largest response" if dof is None else f"response of DOF {dof}"
    ax.set_ylabel(f"{which} [dB re 1 m]")
    values = dataset[name].values[np.isfinite(dataset[name].values)]
    if name != "frequency" and len(values) and is_wide(values):
        ax.set_xscale("log")
    ax.margins(x=0)
