"""Fig. 10: forced response of the tuned 13-blade disk under engine order 3, mu from 0.2 to 0.8.

The friction coefficient acts as the normal load does, through the limit mu F_n: more of it holds
the contacts longer, which moves the resonance up towards that of the stuck disk and, at this load,
raises the peak.

The source states 10 N, with which the peaks end 24 dB below the top of its axes and move by 7 Hz.
With 100 N they reach up to it, and their frequency hardly moves, as its text says. Which of the two
its figure was drawn with is not known; both are drawn here on its axes. How many values of mu it
has is not known either: four are our choice.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 10.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import symhbm as sh
from studies import fig08_engine_orders as fig08
from studies.claim import Claim, Finding
from studies.closed_form import one_blade
from studies.companions import (
    closed_form_peaks,
    decibels,
    full_stick,
    labelled,
    largest_peak,
    of_wave_amplitude,
    one_harmonic,
    stick_at_peak,
    with_companions,
)
from studies.landmark import Landmark
from studies.run import run
from studies.source_axes import set_axes

NAME = "fig10_friction_coefficient"
ENGINE_ORDER = 3
NORMAL_LOAD = 10  # N, as in the source
FITTING_LOAD = 100  # N, with which peaks reach up to the top of its axes
LOADS = {NORMAL_LOAD: "as the source states", FITTING_LOAD: "which suits its axes"}
CONTACT_STIFFNESS = 1e5  # N/m
FRICTION_COEFFICIENTS = [0.2, 0.4, 0.6, 0.8]
BAND = (20, 200)  # Hz
NEAR = (20, 100)
"""Band [Hz] around the peaks, where they are computed with enough harmonics."""
ZOOM = {NORMAL_LOAD: (NEAR, (-108, -82)), FITTING_LOAD: ((67, 70), (-82, -62))}
"""Bands [Hz] and levels [dB re 1 m] that show the peaks, by normal load."""
TICKS = (20, 200, 20), (-120, -60, 10)
"""Ticks of the source, in Hz and dB."""
FAILS = {NORMAL_LOAD: (0.2,), FITTING_LOAD: ()}
"""Friction coefficients at which one harmonic does not suffice, by normal load."""


def problem(harmonics: tuple[int, ...] = (1,)) -> sh.HarmonicBalance:
    """Return the disk of Fig. 8 under engine order 3, with 1e5 N/m and 10 N."""
    return fig08.problem(harmonics).with_parameters(
        engine_order=ENGINE_ORDER, normal_load=NORMAL_LOAD, contact_stiffness=CONTACT_STIFFNESS
    )


def compute(progress: bool = True) -> xr.Dataset:
    """Follow the response at every friction coefficient, at both loads."""
    over = {
        "normal_load": [NORMAL_LOAD, FITTING_LOAD],
        "friction_coefficient": FRICTION_COEFFICIENTS,
    }
    dataset = sh.frf(problem(), BAND, over=over, throw=True, progress=progress)
    return with_companions(dataset, problem(), NEAR, over)


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the peaks at both loads."""
    figure, axes = _draw_loads(dataset, peaks=True)
    for ax, (band, levels) in zip(axes, ZOOM.values(), strict=True):
        ax.set(xlim=band, ylim=levels)
    return figure


def draw_on_source_axes(dataset: xr.Dataset) -> Figure:
    """Draw both loads on the axes of the source."""
    figure, axes = _draw_loads(dataset, peaks=False)
    top = largest_peak(dataset)
    for ax, load in zip(axes, LOADS, strict=True):
        set_axes(ax, *TICKS)
        at = float(top.peak_frequency.sel(normal_load=load).max()) + 12
        low, high = (decibels(top.peak_amplitude.sel(normal_load=load)[end]) for end in (0, -1))
        arrow: Any = dict(arrowstyle="->", color="0.25")
        ax.annotate("", (at, high), (at, low), arrowprops=arrow)
        ax.annotate(r"$\mu$ increases", (at + 3, (low + high) / 2), va="center")
    return figure


def _draw_loads(dataset: xr.Dataset, peaks: bool) -> tuple[Figure, Sequence[Axes]]:
    """Draw the stated load, and beside it the one that fits the axes of the source."""
    with sh.plot.panels(1, 2, size=(11, 5)) as (figure, axes):
        for ax, (load, words) in zip(axes, LOADS.items(), strict=True):
            sh.plot.response(dataset.sel(normal_load=load), peaks=peaks, ax=ax)
            legend = ax.get_legend()
            if legend is not None and ax is not axes[-1]:
                legend.remove()
            ax.set_title(f"$F_n$ = {load} N, {words}")
        figure.suptitle("Fig. 10: tuned disk of 13 blades, EO 3, $k_d$ = 1e5 N/m, one harmonic")
    return figure, axes


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Peaks and the loads of full stick."""
    rows = []
    for load in dataset.normal_load.values:
        at_load, also = dataset.sel(normal_load=load), labelled("normal_load", load)
        rows += closed_form_peaks(at_load, "friction_coefficient", also=also)
    return rows + full_stick(dataset.sel(normal_load=NORMAL_LOAD), "friction_coefficient")


def claims(dataset: xr.Dataset) -> list[Claim]:
    """What the source says of its Fig. 10."""
    top = largest_peak(dataset)
    resonance, fitting = (
        top.peak_frequency.sel(normal_load=load).values for load in (NORMAL_LOAD, FITTING_LOAD)
    )
    dataset = dataset.sel(normal_load=NORMAL_LOAD)
    stick = stick_at_peak(dataset).values
    # Less than the half-power width of a stuck resonance would be no shift.
    width = float(dataset.damping.mean() / (2 * np.pi * dataset.mass.mean()))
    shift = float(np.ptp(resonance))
    low, high = dataset.friction_coefficient.values[[0, -1]]
    limit, lowest, _ = one_blade(dataset.isel(friction_coefficient=0)).optimum()
    best, peaks = limit / NORMAL_LOAD, top.peak_amplitude.sel(normal_load=NORMAL_LOAD).values
    return [
        Claim(
            "The frequency does not change as a function of mu",
            "Fig. 10",
            f"{resonance[0]:.1f} to {resonance[-1]:.1f} Hz over mu = {low:g} to {high:g} (with "
            f"{FITTING_LOAD} N {fitting[0]:.2f} to {fitting[-1]:.2f} Hz)",
            shift < width,
            False,
        ),
        Claim(
            "The larger mu is, the larger the percentage of stick",
            "Fig. 10",
            f"{', '.join(f'{100 * s:.0f} %' for s in stick)} of the period at the peak",
            bool(np.all(np.diff(stick) > 0)),
            True,
        ),
        Claim(
            "An optimal value of mu in terms of peak flattening may be found",
            "Fig. 10",
            f"at mu = {best:.3f}, with a peak of {decibels(lowest):.1f} dB; over the {low:g} to "
            f"{high:g} that are drawn it only rises, from {decibels(peaks[0]):.1f} to "
            f"{decibels(peaks[-1]):.1f} dB",
            0 < best < low and lowest < peaks[0] and bool((np.diff(peaks) > 0).all()),
            True,
        ),
    ]


def findings(dataset: xr.Dataset) -> list[Finding]:
    """How good one harmonic is, and which load the axes of the source suit."""
    rows = []
    for load, fails in FAILS.items():
        at_load, also = dataset.sel(normal_load=load), labelled("normal_load", load)
        rows += one_harmonic(at_load, "friction_coefficient", fails=fails, also=also)
    levels = 20 * np.log10(largest_peak(dataset).peak_amplitude)
    low, high = (
        {load: float(end.sel(normal_load=load)) for load in LOADS}
        for end in (levels.min("friction_coefficient"), levels.max("friction_coefficient"))
    )
    bottom, end, step = TICKS[1]
    at_end = dataset.amplitude.max("dof").where(dataset.frequency == BAND[1])
    lowest = decibels(float(at_end.min()))
    return [
        *rows,
        Finding(
            f"The axes of Fig. 10 suit {FITTING_LOAD} N and not the {NORMAL_LOAD} N of its text",
            "peaks from "
            + " and from ".join(
                f"{low[load]:.1f} to {high[load]:.1f} dB with {load} N" for load in LOADS
            )
            + f"; the axes end at {end} dB",
            high[NORMAL_LOAD] < end - 2 * step and end - step < high[FITTING_LOAD] < end,
        ),
        of_wave_amplitude(f"at {BAND[1]} Hz", lowest, bottom),
    ]


if __name__ == "__main__":
    run(NAME, compute, draw, draw_on_source_axes)
