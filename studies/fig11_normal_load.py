"""Fig. 11: forced response of the tuned 13-blade disk under engine order 6, three normal loads.

Of the loads drawn in the source, the lightest gives the lowest peak. The load that damps most is
lighter still: the peak over the load, on the right, has its minimum there. Towards no load
the blades swing freely at 15.9 Hz, towards heavy loads the contacts hold and add their stiffness.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 11.
"""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from scipy.optimize import minimize_scalar

import symhbm as sh
from studies import fig08_engine_orders as fig08
from studies.claim import Claim, Finding
from studies.closed_form import EXACT_DIGITS, one_blade
from studies.companions import (
    closed_form_peaks,
    decibels,
    free_peak,
    full_stick,
    largest_peak,
    one_harmonic,
    stick_at_peak,
    stuck_peak,
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
CLOSE = 1e-5
"""Relative change of the best load at which it is found."""


def problem(harmonics: tuple[int, ...] = (1,)) -> sh.HarmonicBalance:
    """Return the disk of Fig. 8 under engine order 6, with 1e5 N/m."""
    return fig08.problem(harmonics).with_parameters(
        engine_order=ENGINE_ORDER, contact_stiffness=CONTACT_STIFFNESS
    )


def compute(progress: bool = True) -> xr.Dataset:
    """Follow the response at the loads of the source and at the best one; and peaks over loads."""
    options = dict(frequency_band=BAND, throw=True, progress=False)
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
    with sh.plot.panels(1, 2, sharey=True, size=(11.0, 4.8), width_ratios=(1.5, 1)) as (
        figure,
        (left, right),
    ):
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
        right.semilogx(load, level, color="0.6", zorder=1, label="computed with its slope")
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
        right.plot([], [], "o", color="0.5", markeredgecolor="black", label="responses on the left")
        right.legend(loc="upper center")
        right.set_xlabel("normal load $F_n$ [N]")
        right.set_title("peak over the normal load", fontsize=10)
        left.set_title("response; circles: peaks", fontsize=10)
        figure.suptitle("Tuned disk of 13 blades, EO 6, $k_d$ = 1e5 N/m, one harmonic")
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Peaks, the best load, and the load of full stick."""
    best = float(dataset.best_normal_load)
    top = largest_peak(dataset).peak_amplitude
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
        *full_stick(dataset),
    ]


def claims(dataset: xr.Dataset) -> list[Claim]:
    """What the source says of its Fig. 11, and of all contact parameters after it."""
    best = float(dataset.best_normal_load)
    top = largest_peak(dataset)
    drawn = top.sel(normal_load=NORMAL_LOADS)
    frequency, level = drawn.peak_frequency.values, drawn.peak_amplitude.values
    slip = 100 * (1 - stick_at_peak(dataset.sel(normal_load=NORMAL_LOADS)).values)
    softest = top.sel(normal_load=best)
    curve = dataset.isel(normal_load=0)
    limits = sorted(decibels(peak(curve)[0]) for peak in (stuck_peak, free_peak))
    width = float(dataset.damping.mean() / (2 * np.pi * dataset.mass.mean()))
    stick = float(dataset.full_stick_normal_load)
    return [
        Claim(
            "If F_n increases (10, 40, 100 N), the percentage of slip decreases",
            "Fig. 11",
            f"{', '.join(f'{s:.1f} %' for s in slip)} of the period at the peak",
            bool(np.all(np.diff(slip) < 0)),
            True,
        ),
        Claim(
            "Slip even disappears for F_n = 100 N",
            "Fig. 11",
            f"contacts slip for {slip[-1]:.1f} % of the period; full stick from {stick:.0f} N on",
            stick <= NORMAL_LOADS[-1],
            False,
        ),
        Claim(
            "If F_n increases, maximum amplitudes increase",
            "Fig. 11",
            ", ".join(f"{decibels(a):.1f} dB" for a in level),
            bool(np.all(np.diff(level) > 0)),
            True,
        ),
        Claim(
            "The resonant frequencies are insensitive to changes in F_n",
            "Fig. 11",
            f"{', '.join(f'{f:.1f} Hz' for f in frequency)}, {np.ptp(frequency) / width:.0f} "
            f"half-power widths of the stuck one; {float(softest.peak_frequency):.1f} Hz with "
            f"{best:.2f} N",
            float(np.ptp(frequency)) < width,
            False,
        ),
        Claim(
            "mu and F_n change amplitudes between the limits of the two linear cases (totally "
            "slipping and totally stuck)",
            "after Fig. 11",
            f"the lowest peak is {decibels(float(softest.peak_amplitude)):.1f} dB, below both "
            f"limits, {limits[0]:.1f} and {limits[1]:.1f} dB",
            limits[0] <= decibels(float(softest.peak_amplitude)),
            False,
        ),
    ]


def findings(dataset: xr.Dataset) -> list[Finding]:
    """How good one harmonic is, and how much lighter the best load is than those drawn."""
    best = float(dataset.best_normal_load)
    top = largest_peak(dataset).peak_amplitude
    lightest = float(min(NORMAL_LOADS))
    gain = decibels(float(top.sel(normal_load=lightest) / top.sel(normal_load=best)))
    return [
        *one_harmonic(dataset.sel(normal_load=NORMAL_LOADS), "normal_load"),
        Finding(
            "The load of the lowest peak is lighter than all loads of the source's Fig. 11",
            f"{best:.3f} N, {gain:.1f} dB below the peak at {lightest:g} N",
            best < lightest and gain > 0,
        ),
    ]


if __name__ == "__main__":
    run(NAME, compute, draw)
