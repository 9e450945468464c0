"""Figures from datasets."""

from collections.abc import Iterator, Sequence
from typing import Any

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
    "force_amplitude": ("$f_0$", "N"),
    "mass": ("$m$", "kg"),
    "damping": ("$c$", "N s/m"),
    "stiffness": ("$k$", "N/m"),
}
LINE_STYLES = ("-", (0, (5, 1.5)), (0, (1.2, 1.2)), (0, (6, 1.5, 1.2, 1.5)))
PEAK_MARKERS = {"smooth": "o", "corner": "^"}
MOST_LEGEND_ENTRIES = 14


def frequency_response(
    dataset: xr.Dataset, *, dof: int | None = None, peaks: bool = True, ax: Axes | None = None
) -> Figure:
    """Draw amplitude in dB (re 1 m) over frequency, one line per parameter set.

    Parameters
    ----------
    dataset
        A result of `symhbm.frf`.
    dof
        The degree of freedom to show; by default the largest response of all.
    peaks
        Mark the located peaks: circles are smooth, triangles corners, dotted lines unbounded.
    ax
        Axes to draw into; by default a new figure.

    Raises
    ------
    KeyError
        If the dataset holds no frequency response.
    ValueError
        If ``dof`` is out of range.
    """
    for name in ("amplitude", "frequency"):
        check.known(name, [str(n) for n in dataset.variables], "variable of the dataset")
    along = "point" if "point" in dataset.dims else "frequency"
    if along not in dataset["amplitude"].dims:
        raise KeyError("the dataset holds one point; a frequency response has many")
    if dof is not None:
        dof = check.integer("dof", dof, 0, dataset.sizes["dof"] - 1)
    swept = [str(d) for d in dataset["amplitude"].dims if d not in (along, "dof")]
    curves = list(_curves(dataset, swept))
    with plt.rc_context(STYLE):
        if ax is None:
            _, ax = plt.subplots(layout="constrained")
        colors = _shades(len(curves))
        for number, (curve, label) in enumerate(curves):
            style = LINE_STYLES[number % len(LINE_STYLES)]
            _line(ax, curve, dof, label, colors[number], style)
            if peaks:
                _peaks(ax, curve, dof, colors[number])
        ax.set_xlabel("excitation frequency [Hz]")
        which = "largest response" if dof is None else f"response of DOF {dof}"
        ax.set_ylabel(f"{which} [dB re 1 m]")
        ax.margins(x=0)
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


def _line(ax: Axes, curve: xr.Dataset, dof: int | None, label: str, color, style) -> None:
    amplitude = curve["amplitude"]
    values = amplitude.max("dof", skipna=False) if dof is None else amplitude.isel(dof=dof)
    frequency, level = curve["frequency"].values, _decibel(values.values)
    inside = np.isfinite(frequency)
    frequency, level = frequency[inside], level[inside]
    if dof is None and "peak_frequency" in curve:
        # The line runs through its own peaks, however far apart the points are.
        bounded = np.isfinite(curve["peak_amplitude"].values)
        frequency = np.append(frequency, curve["peak_frequency"].values[bounded])
        level = np.append(level, _decibel(curve["peak_amplitude"].values[bounded]))
    _, first = np.unique(frequency, return_index=True)
    frequency, level = frequency[first], level[first]
    if len(level) > 2 and np.all(np.isfinite(level)):
        # Monotone between its points: nothing is drawn above a peak or below a trough.
        fine = np.linspace(0, len(level) - 1, 12 * len(level) + 1)
        fine = np.union1d(np.interp(fine, np.arange(len(level)), frequency), frequency)
        frequency, level = fine, PchipInterpolator(frequency, level)(fine)
    ax.plot(frequency, level, color=color, linestyle=style, label=label)


def _peaks(ax: Axes, curve: xr.Dataset, dof: int | None, color) -> None:
    if dof is not None or "peak_frequency" not in curve:
        return
    for frequency, amplitude, kind in zip(
        curve["peak_frequency"].values,
        curve["peak_amplitude"].values,
        curve["peak_kind"].values,
        strict=True,
    ):
        if kind in PEAK_MARKERS:
            ax.plot(
                frequency,
                _decibel(amplitude),
                PEAK_MARKERS[kind],
                color=color,
                markeredgecolor="black",
                markeredgewidth=0.6,
                markersize=4.5,
                zorder=3,
            )
        elif kind == "unbounded":
            ax.axvline(frequency, color=color, linestyle=":", linewidth=0.8)


def _colorbar(ax: Axes, values: xr.DataArray) -> None:
    numbers = np.asarray(values.values, dtype=float)
    wide = numbers.min() > 0 and numbers.max() / numbers.min() > 30
    norm = (LogNorm if wide else Normalize)(numbers.min(), numbers.max())
    mappable = plt.cm.ScalarMappable(norm=norm, cmap="viridis_r")
    symbol, unit = SYMBOLS.get(str(values.name), (str(values.name), ""))
    ax.figure.colorbar(mappable, ax=ax, label=f"{symbol} [{unit}]" if unit else symbol)
