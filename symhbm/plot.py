"""Figures from datasets."""

import json
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from scipy.interpolate import PchipInterpolator

from symhbm import check

STYLE: Any = {
    "figure.figsize": (7.2, 4.6),
    "figure.dpi": 110,
    "savefig.dpi": 200,
    "font.size": 10,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "0.88",
    "grid.linewidth": 0.6,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "mathtext.fontset": "dejavusans",
}
SYMBOLS = {
    "contact_stiffness": ("$k_d$", "N/m"),
    "friction_coefficient": (r"$\mu$", ""),
    "normal_load": ("$F_n$", "N"),
    "engine_order": ("EO", ""),
    "cubic_stiffness": (r"$\gamma$", "N/m³"),
    "force_amplitude": ("$f_0$", "N"),
    "mass": ("$m$", "kg"),
    "damping": ("$c$", "N s/m"),
    "stiffness": ("$k$", "N/m"),
}
LINE_STYLES = ("-", (0, (5, 1.5)), (0, (1.2, 1.2)), (0, (6, 1.5, 1.2, 1.5)))
MARKERS = {"smooth": "o", "corner": "^", "fold": "s"}
MOST_LEGEND_ENTRIES = 14
WIDE = 30
"""Ratio of values from which a scale is logarithmic."""


def response(
    dataset: xr.Dataset, *, dof: int | None = None, peaks: bool = True, ax: Axes | None = None
) -> Figure:
    """Draw amplitude in dB (re 1 m) over the moving parameter, one line per parameter set.

    Unstable responses are dotted lines, or hollow circles.

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
    KeyError
        If the dataset holds no curve.
    ValueError
        If ``dof`` is out of range.
    """
    for name in ("amplitude", "frequency"):
        check.known(name, [str(n) for n in dataset.variables], "variable of the dataset")
    followed = json.loads(dataset.attrs.get("followed", '{"name": "frequency"}'))
    name = followed["name"]
    along = "point" if "point" in dataset.dims else name
    if along not in dataset["amplitude"].dims:
        raise KeyError("the dataset holds one point; a response curve has many")
    if dof is not None:
        dof = check.integer("dof", dof, 0, dataset.sizes["dof"] - 1)
    swept = [str(d) for d in dataset["amplitude"].dims if d not in (along, "dof", "solution")]
    curves = list(_curves(dataset, swept))
    with plt.rc_context(STYLE):
        if ax is None:
            _, ax = plt.subplots(layout="constrained")
        colors = _shades(len(curves))
        for number, (curve, label) in enumerate(curves):
            style = LINE_STYLES[number % len(LINE_STYLES)]
            points = _points(curve, name, dof, followed)
            _line(ax, curve, points, label, colors[number], style)
            if peaks:
                _marks(ax, points, colors[number])
        _label_axes(ax, dataset, name, dof)
        if swept and len(curves) <= MOST_LEGEND_ENTRIES:
            ax.legend(
                loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, handlelength=2.8
            )
        elif len(swept) == 1 and swept[0] in dataset.coords:
            _colorbar(ax, dataset[swept[0]])
    figure = ax.get_figure()
    assert isinstance(figure, Figure)
    return figure


def _curves(dataset: xr.Dataset, swept: Sequence[str]) -> Iterator[tuple[xr.Dataset, str]]:
    for index in np.ndindex(*(dataset.sizes[d] for d in swept)):
        place = dict(zip(swept, index, strict=True))
        yield dataset.isel(place), ", ".join(_label(dataset, d, i) for d, i in place.items())


def _label(dataset: xr.Dataset, dim: str, index: int) -> str:
    if dim not in dataset.coords:
        return f"{dim} {index}"
    symbol, unit = SYMBOLS.get(dim, (dim.replace("_", " "), ""))
    value = dataset[dim].values[index]
    text = f"{value:g}" if isinstance(value, (int, float, np.number)) else str(value)
    return f"{symbol} = {text} {unit}".rstrip()


def _shades(number: int) -> np.ndarray:
    """Colours whose lightness falls steadily, so that they differ in greyscale too."""
    if number == 1:
        return np.array([[0.0, 0.0, 0.0, 1.0]])
    return plt.get_cmap("viridis")(np.linspace(0.88, 0.0, number))


def _decibel(amplitude: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return 20 * np.log10(amplitude)


class _Points(NamedTuple):
    """What to draw of one curve: its points [dB], which are unstable, and its peaks and folds."""

    value: np.ndarray
    level: np.ndarray
    unstable: np.ndarray
    marks: list[tuple[str, float, float]]


def _points(curve: xr.Dataset, name: str, dof: int | None, followed: dict) -> _Points:
    amplitude = curve["amplitude"]
    shown = amplitude.max("dof", skipna=False) if dof is None else amplitude.isel(dof=dof)
    value, level = curve[name].values, _decibel(shown.values)
    marks = []
    each = followed.get("peaks") == "each"
    # A dataset may have been reduced to some of its variables.
    needed = [f"peak_{key}" for key in ("kind", name, "amplitude", "dof")]
    if all(key in curve for key in needed) and each == (dof is not None):
        peaks = (curve[key].values for key in needed)
        marks = [
            (kind, float(at), float(_decibel(top)))
            for kind, at, top, peak_dof in zip(*peaks, strict=True)
            if kind and (dof is None or peak_dof == dof)
        ]
    if all(f"event_{key}" in curve for key in (name, "kind")) and "point" in curve.dims:
        for kind, at in zip(curve["event_kind"].values, curve[f"event_{name}"].values, strict=True):
            if kind == "fold":
                marks.append((kind, float(at), float(level[np.argmin(np.abs(value - at))])))
    stability = curve["stability"].values if "stability" in curve else np.ones(level.shape)
    return _Points(value, level, stability == 0, marks)


def _line(ax: Axes, curve: xr.Dataset, points: _Points, label: str, color, style) -> None:
    value, level, unstable = points.value, points.level, points.unstable
    if "solution" in curve["amplitude"].dims:
        ax.plot(value, np.where(unstable, np.nan, level), ".", color=color, markersize=3.5)
        hollow = np.where(unstable, level, np.nan)
        ax.plot(value, hollow, "o", color=color, markersize=2.5, markerfacecolor="white")
        ax.plot([], [], ".", color=color, label=label)
        return
    inside = np.isfinite(value)
    value, level, unstable = value[inside], level[inside], unstable[inside]
    if np.all(np.diff(value) > 0) or np.all(np.diff(value) < 0):
        # The line runs through its own peaks, however far apart the points are.
        tops = [(at, top) for _, at, top in points.marks if np.isfinite(top)]
        value = np.append(value, [at for at, _ in tops])
        level = np.append(level, [top for _, top in tops])
        unstable = np.append(unstable, np.zeros(len(tops), dtype=bool))
        _, first = np.unique(value, return_index=True)
        value, level, unstable = value[first], level[first], unstable[first]
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
    ax.plot(value, np.where(dotted, np.nan, level), color=color, linestyle=style, label=label)
    if dotted.any():
        ax.plot(value, np.where(dotted, level, np.nan), color=color, linestyle=":", linewidth=1.0)


def _marks(ax: Axes, points: _Points, color) -> None:
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


def _label_axes(ax: Axes, dataset: xr.Dataset, name: str, dof: int | None) -> None:
    symbol, unit = SYMBOLS.get(name, ("excitation frequency", "Hz"))
    about = str(dataset[name].attrs.get("long_name", "")) if name in SYMBOLS else ""
    text = f"{about} {symbol}".strip()
    ax.set_xlabel(f"{text} [{unit}]" if unit else text)
    which = "largest response" if dof is None else f"response of DOF {dof}"
    ax.set_ylabel(f"{which} [dB re 1 m]")
    values = dataset[name].values[np.isfinite(dataset[name].values)]
    if name in SYMBOLS and values.min() > 0 and values.max() / values.min() > WIDE:
        ax.set_xscale("log")
    ax.margins(x=0)


def _colorbar(ax: Axes, values: xr.DataArray) -> None:
    numbers = np.asarray(values.values, dtype=float)
    wide = numbers.min() > 0 and numbers.max() / numbers.min() > WIDE
    norm = (LogNorm if wide else Normalize)(numbers.min(), numbers.max())
    mappable = plt.cm.ScalarMappable(norm=norm, cmap="viridis_r")
    symbol, unit = SYMBOLS.get(str(values.name), (str(values.name), ""))
    ax.figure.colorbar(mappable, ax=ax, label=f"{symbol} [{unit}]" if unit else symbol)
