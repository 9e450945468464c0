"""Pictures of peaks over the normal load, and of the best loads over the engine order."""

from dataclasses import replace
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import symhbm as sh
from studies.closed_form import OneBlade, one_blade
from symhbm.numerics.loops.interpolation import amplitude_between

PUBLISHED_LOAD = 10.0
"""Normal load [N] of the source's tuned disk in Fig. 12."""
SPACING = 2.2
"""Least distance of the labels of curves [dB]."""
_FINE = 8
"""Parts of a stretch between two loads at which a peak is known."""


def blade(dataset: xr.Dataset, order: int) -> OneBlade:
    """Return the blade that the disk is under an engine order, one harmonic, load of the source."""
    one = dataset.isel(engine_order=0)
    return one_blade(one, normal_load=PUBLISHED_LOAD, engine_order=order)


def draw(dataset: xr.Dataset) -> Figure:
    """Draw peaks over loads, and the best load and its peak over the engine order."""
    with sh.plot.panels(0, size=(11.0, 6.4)) as (figure, _):
        axes: Any = figure.subplot_mosaic("LT;LB", width_ratios=(1.35, 1))
        _draw_curves(dataset, axes["L"])
        _draw_loads(dataset, axes["T"])
        _draw_peaks(dataset, axes["B"])
        figure.suptitle("Tuned disk of 13 blades, $k_d$ = 1e6 N/m: the load of the lowest peak")
    return figure


def decibels(amplitude: Any) -> np.ndarray:
    """Return amplitudes [m] in dB re 1 m."""
    return 20 * np.log10(amplitude)


def peaks_between(
    load: np.ndarray, amplitude: np.ndarray, slope: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return loads [N] and levels [dB] of the peak over the load, cubic between those it is known.

    ``slope`` is the derivative of the peak by the load [m/N].
    """
    place, share = np.divmod(np.arange(_FINE * (len(load) - 1) + 1) / _FINE, 1)
    i = np.minimum(place.astype(int), len(load) - 2)
    share = share + (place - i)
    width = np.log(load[i + 1] / load[i])
    first, last = (width * load[j] * slope[j] for j in (i, i + 1))
    found = amplitude_between(amplitude[i], amplitude[i + 1], (first, last), share)
    return load[i] * np.exp(width * share), decibels(found)


def _draw_curves(dataset: xr.Dataset, ax: Axes) -> None:
    mu = float(dataset.friction_coefficient.mean())
    loads = np.geomspace(0.4, 60, 200)
    orders = dataset.engine_order.values
    shades = plt.get_cmap("viridis")(np.linspace(0, 0.88, len(orders)))
    label = np.inf
    for order, color in zip(orders, shades, strict=True):
        tuned = blade(dataset, order)
        closed = [replace(tuned, slip_limit=mu * load).peak()[0] for load in loads]
        ax.semilogx(loads, decibels(closed), "--", color=color, linewidth=1)
        row = dataset.sel(engine_order=order).isel(highest_harmonic=-1)
        best, lowest = float(row.optimal_normal_load), float(row.optimal_amplitude)
        ratio = np.append(row.scan_ratio, 1.0)
        level = np.append(row.scan_peak_amplitude, lowest)
        at = np.argsort(ratio)
        # Nothing tells where between two loads another peak takes the lead.
        ax.plot(ratio[at] * best, decibels(level[at]), ".", color=color, markersize=6)
        ax.plot(best, decibels(lowest), "o", color=color, markeredgecolor="black", markersize=7)
        alone = dataset.sel(engine_order=order).isel(highest_harmonic=0)
        ax.plot(
            alone.optimal_normal_load,
            decibels(alone.optimal_amplitude),
            "o",
            color="white",
            markeredgecolor=color,
            markersize=6,
        )
        # Room between labels of curves that end close together.
        label = min(float(decibels(closed[-1])), label - SPACING)
        ends: Any = dict(va="center", color=color, fontsize=10, textcoords="offset points")
        ax.annotate(f"EO {order}", (loads[-1], label), (5, 0), annotation_clip=False, **ends)
    ax.axvline(PUBLISHED_LOAD, color="0.4", linewidth=0.9, linestyle=(0, (1, 2)))
    ax.set_xlim(0.4, 60)
    ax.set_ylim(-126, -65)
    ax.annotate(
        f"source: {PUBLISHED_LOAD:g} N",
        (PUBLISHED_LOAD, -125),
        (4, 0),
        textcoords="offset points",
        rotation=90,
        va="bottom",
        fontsize=9,
    )
    highest = int(dataset.highest_harmonic[-1])
    dots = dict(color="0.4", markersize=6)
    ax.plot([], [], "o", markeredgecolor="black", label=f"harmonics up to {highest}", **dots)  # type: ignore
    look = dict(markerfacecolor="white", linewidth=1) | dots
    ax.plot([], [], "--o", label="one harmonic, closed form", **look)  # type: ignore
    ax.legend(loc="upper right")
    ax.set_xlabel("normal load $F_n$ [N]")
    ax.set_ylabel("largest peak [dB re 1 m]")
    ax.set_title("peak over the normal load; circles: minimised", fontsize=10)


def _styles(dataset: xr.Dataset) -> list[tuple[str, xr.Dataset, dict[str, Any]]]:
    highest = dataset.highest_harmonic.values
    looks: tuple[dict[str, Any], ...] = (
        dict(color="0.45", marker="o", markerfacecolor="white", linestyle=""),
        dict(color="tab:blue", marker="D", markersize=5, markeredgecolor="black", linestyle=""),
    )
    names = ["one harmonic" if one == 1 else f"harmonics up to {one}" for one in highest]
    rows = [dataset.sel(highest_harmonic=one) for one in highest]
    return list(zip(names, rows, looks, strict=False))


def _draw_loads(dataset: xr.Dataset, ax: Axes) -> None:
    for name, row, look in _styles(dataset):
        ax.plot(row.engine_order, row.optimal_normal_load, label=name, **look)
        if row.highest_harmonic == dataset.highest_harmonic[-1]:
            for order, load in zip(row.engine_order, row.optimal_normal_load, strict=True):
                ax.annotate(
                    f"{float(load):.2f}",
                    (float(order), float(load)),
                    (2, -13),
                    textcoords="offset points",
                    ha="right",
                    fontsize=9,
                )
    ax.set_ylim(0, None)
    ax.margins(x=0.09)
    ax.set_xticks(dataset.engine_order.values)
    ax.set_xlabel("engine order")
    ax.set_ylabel("best normal load [N]")
    ax.legend(loc="upper right")


def _draw_peaks(dataset: xr.Dataset, ax: Axes) -> None:
    for name, row, look in _styles(dataset):
        ax.plot(row.engine_order, decibels(row.optimal_amplitude), label=f"best, {name}", **look)
    last = dataset.isel(highest_harmonic=-1)
    usual = decibels(last.published_load_amplitude)
    label = f"{PUBLISHED_LOAD:g} N, harmonics up to {int(last.highest_harmonic)}"
    ax.plot(last.engine_order, usual, "s", color="tab:red", label=label)
    ax.set_xticks(dataset.engine_order.values)
    ax.set_xlabel("engine order")
    ax.set_ylabel("largest peak [dB re 1 m]")
    ax.legend(loc="upper right")
