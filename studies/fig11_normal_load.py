"""Fig. 11: forced response of the tuned 13-blade disk under engine order 6, three normal loads.

Of the loads drawn in the source, the lightest gives the lowest peak. The load that damps most is
lighter still: the peak over the load, on the right, has its minimum there. Towards no load
the blades swing freely at 15.9 Hz, towards heavy loads the contacts hold and add their stiffness.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 11.
"""

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from scipy.optimize import minimize_scalar

import symhbm as sh
from studies import fig08_engine_orders as fig08
from studies.closed_form import EXACT_DIGITS, one_blade
from studies.companions import (
    closed_form_peaks,
    full_stick,
    largest_peak,
    one_harmonic_suffices,
    with_companions,
)
from studies.landmark import Landmark, Source
from studies.load_curves import peaks_between
from studies.run import run

NAME = "fig11_normal_load"
ENGINE_ORDER = 6
CONTACT_STIFFNESS = 1e5  # N/m
NORMAL_LOADS = [10, 40, 100]  # N
BAND = (10, 120)  # Hz
LOADS = (0.3, 3000)
"""Normal loads [N] of the curve of peaks, from nearly free to stuck."""
OPTIMAL = "A normal load of 10 N is optimal"
CLOSE = 1e-5
"""Relative change of the best load at which it is found."""


def problem(harmonics: tuple[int, ...] = (1,)) -> sh.HarmonicBalance:
    """Return the disk of Fig. 8 under engine order 6, with 1e5 N/m."""
    return fig08.problem(harmonics).with_parameters(
        engine_order=ENGINE_ORDER, contact_stiffness=CONTACT_STIFFNESS
    )


def compute(progress: bool = True) -> xr.Dataset:
    """Follow the response at the loads of the source and at the best one; and peaks over loads."""
    options = dict(frequency=BAND, throw=True, progress=False)
    scan = sh.peak_curve(problem(), "normal_load", LOADS, **options)  # type: ignore[arg-type]
    best = float(scan.minimum_normal_load[scan.minimum_amplitude.values.argmin()])
    over = {"normal_load": np.append(best, NORMAL_LOADS)}
    dataset = sh.frf(problem(), BAND, over=over, throw=True, progress=progress)
    added = {
        "best_normal_load": ((), best, "N", "normal load of the lowest peak"),
        "scan_normal_load": ("scan", scan.normal_load, "N", "normal load of the contact"),
        "scan_peak_amplitude": ("scan", scan.peak_amplitude, "m", "displacement at the peak"),
        "scan_peak_slope": ("scan", scan.peak_amplitude_slope, "m N-1", "derivative by the load"),
    }
    return with_companions(dataset, problem(), BAND, over).assign(
        {
            name: (dims, np.asarray(values), {"units": units, "long_name": long_name})
            for name, (dims, values, units, long_name) in added.items()
        }
    )


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the curves, and the peak over the load."""
    top = largest_peak(dataset)
    loads = dataset.normal_load.values
    with plt.rc_context(sh.plot.STYLE):
        figure, (left, right) = plt.subplots(
            1, 2, sharey=True, figsize=(11.0, 4.8), layout="constrained", width_ratios=(1.5, 1)
        )
        sh.plot.response(dataset, ax=left)
        legend = left.get_legend()
        assert legend is not None
        handles = legend.legend_handles
        best = float(dataset.best_normal_load)
        labels = [
            f"$F_n$ = {load:.3g} N" + (" (lowest peak)" if load == best else "") for load in loads
        ]
        left.legend(handles, labels, loc="upper left", handlelength=2.8)
        names = "scan_normal_load", "scan_peak_amplitude", "scan_peak_slope"
        load, level = peaks_between(*(dataset[name].values for name in names))
        right.semilogx(load, level, color="0.6", zorder=1)
        for at, handle, peak in zip(loads, handles, top.peak_amplitude.values, strict=True):
            marker = dict(color=handle.get_color(), markeredgecolor="black", markersize=6)  # type: ignore
            right.plot(at, 20 * np.log10(peak), "o", **marker)
            right.annotate(
                f"{at:.3g} N", (at, 20 * np.log10(peak)), (7, -9), textcoords="offset points"
            )
        stick = float(dataset.full_stick_normal_load)
        right.axvline(stick, color="0.4", linewidth=0.9, linestyle=(0, (1, 2)))
        right.annotate(
            f"no slip from {stick:.0f} N on",
            (stick, float(level.min())),
            (4, 0),
            textcoords="offset points",
            rotation=90,
            fontsize=9,
        )
        right.set_xlabel("normal load $F_n$ [N]")
        right.set_title("peak over the normal load", fontsize=10)
        left.set_title("response; circles: peaks", fontsize=10)
        figure.suptitle("Tuned disk of 13 blades, EO 6, $k_d$ = 1e5 N/m, one harmonic")
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Peaks, their error with one harmonic, the best load, and the load of full stick."""
    best = float(dataset.best_normal_load)
    top = largest_peak(dataset).peak_amplitude
    drawn = top.sel(normal_load=NORMAL_LOADS)
    lowest = float(drawn.idxmin())
    curve = dataset.isel(normal_load=0)

    def level(logarithm: float) -> float:
        return float(np.log(one_blade(curve, normal_load=np.exp(logarithm)).peak()[0]))

    ends = np.log(dataset.scan_normal_load.values[[0, -1]])
    closed: Any = minimize_scalar(level, bounds=ends, method="bounded", options=dict(xatol=CLOSE))
    found = float(top.sel(normal_load=best))
    return [
        *closed_form_peaks(dataset, "normal_load"),
        # The bottom of a parabola: the load has half the digits of the peak.
        Landmark(
            "load of the lowest peak", best, float(np.exp(closed.x)), "N", Source.CLOSED_FORM, 1e-3
        ),
        Landmark(
            "the lowest peak",
            found,
            float(np.exp(closed.fun)),
            "m",
            Source.CLOSED_FORM,
            EXACT_DIGITS,
        ),
        Landmark(
            "load of the lowest peak, beside the best of those drawn in the source",
            best,
            lowest,
            "N",
            Source.CLAIM,
            0.01,
            OPTIMAL,
        ),
        Landmark(
            f"lowest peak, beside that at {lowest:g} N",
            found,
            float(drawn.min()),
            "m",
            Source.CLAIM,
            0.01,
            OPTIMAL,
        ),
        *one_harmonic_suffices(dataset.sel(normal_load=NORMAL_LOADS), "normal_load"),
        *full_stick(dataset),
    ]


if __name__ == "__main__":
    run(NAME, compute, draw)
