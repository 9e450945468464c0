"""Fig. 3: forced response of one blade with a friction damper to the ground, twelve normal loads.

Light loads let the blade swing freely, heavy ones hold the contact and add its stiffness; between
them lies a load that damps most. The peaks are closed forms with one harmonic; the exact periodic
motions of the reference come from an integration from event to event.

The source gives no reference for its decibels; 1 m is a reading. With it the peaks of all figures
lie within their axes, but at their lower ends lines leave those of Figs. 3, 8c, 10 and 12. Here
these end at -80 dB, below which all lines fall before 30 Hz. Whether those of the source do is not
known.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 3.
"""

import json
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import symhbm as sh
from studies.claim import Claim, Finding
from studies.companions import (
    ACCURACY,
    VISIBLE,
    closed_form_peaks,
    decibels,
    full_stick,
    largest_peak,
    one_harmonic_ratio,
    suffices,
    with_companions,
)
from studies.landmark import Landmark, Source
from studies.run import REFERENCE, run
from studies.source_axes import set_axes

NAME = "fig03_single_blade"
NORMAL_LOADS = [0.01, 0.5, 1, 1.5, 2, 3, 5, 10, 18, 50, 100, 500]  # N
BAND = (10, 30)  # Hz
NEAR = (15, 23)
"""Band [Hz] around the peaks, where they are computed with enough harmonics."""
CLAIMED_FULL_STICK = 100  # N, as the source says
FLATTEST = 3  # N, up to which the source says that peaks flatten
TICKS = (10, 30, 2), (-80, -20, 10)
"""Ticks of the source, in Hz and dB."""


def problem(harmonics: tuple[int, ...] = (1,)) -> sh.HarmonicBalance:
    """Return the paper's blade: 1 kg on 1e4 N/m, 0.5 N s/m, contact of 1e4 N/m, mu = 0.5."""
    blade = sh.single_blade(
        mass=1,
        stiffness=1e4,
        damping=0.5,
        contact_stiffness=1e4,
        friction_coefficient=0.5,
        normal_load=100,
    )
    return sh.HarmonicBalance(blade, sh.forces.PointForce(amplitude=1.0), harmonics)


def compute(progress: bool = True) -> xr.Dataset:
    """Follow the response at every load."""
    over = {"normal_load": NORMAL_LOADS}
    dataset = sh.frf(problem(), BAND, over=over, throw=True, progress=progress)
    return with_companions(dataset, problem(), NEAR, over)


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the family of curves."""
    figure = sh.plot.response(dataset)
    name_peaks(figure.axes[0], dataset)
    figure.axes[0].set_title("One blade, friction damper to the ground, one harmonic")
    return figure


def name_peaks(ax: Axes, dataset: xr.Dataset) -> None:
    """Write each load beside its peak, on the side where no other line is."""
    top = largest_peak(dataset)
    for load in dataset.normal_load.values:
        peak = top.sel(normal_load=load)
        at = float(peak.peak_frequency), decibels(float(peak.peak_amplitude))
        aside: Any = dict(xytext=(6, 0), ha="left", va="center")
        if load < FLATTEST:
            aside = dict(xytext=(-6, 0), ha="right", va="center")
        elif load <= 5:
            aside = dict(xytext=(-2, 4), ha="right", va="bottom")
        elif load < 50:
            aside = dict(xytext=(0, -5), ha="center", va="top")
        ax.annotate(f"{load:g} N", at, textcoords="offset points", fontsize=7.5, **aside)


def draw_on_source_axes(dataset: xr.Dataset) -> Figure:
    """Draw the family on the axes of the source, without marks."""
    with sh.plot.panels(size=(7.2, 5.0)) as (figure, ax):
        sh.plot.response(dataset, peaks=False, ax=ax)
        set_axes(ax, *TICKS)
        name_peaks(ax, dataset)
        ax.set_title("Fig. 3: one blade, twelve normal loads $F_n$, one harmonic")
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Peaks with one harmonic and with enough, and the load of full stick."""
    exact = json.loads(REFERENCE.read_text())["single_blade_peaks"]
    return [
        *closed_form_peaks(dataset, "normal_load", resonances=False),
        *[
            Landmark(
                f"peak with enough harmonics, F_n = {peak['Fn']:g} N",
                float(dataset.accurate_peak_amplitude.sel(normal_load=peak["Fn"])),
                peak["exact_peak_x"],
                "m",
                Source.EXACT,
                ACCURACY,
            )
            for peak in exact
        ],
        *full_stick(dataset),
    ]


def claims(dataset: xr.Dataset) -> list[Claim]:
    """What the source says of its Fig. 3."""
    top = largest_peak(dataset)
    mass, k, k_d = (
        float(dataset[name].mean()) for name in ("mass", "stiffness", "contact_stiffness")
    )
    free, held = (float(np.sqrt(stiffness / mass)) / (2 * np.pi) for stiffness in (k, k + k_d))
    lightest, heaviest = (float(top.peak_frequency[end]) for end in (0, -1))
    stick = float(dataset.full_stick_normal_load)
    at_claimed, stuck = (
        decibels(float(top.peak_amplitude.sel(normal_load=load))) for load in (100, 500)
    )
    flattening = top.peak_amplitude.sel(normal_load=slice(None, FLATTEST)).values
    ratio = one_harmonic_ratio(dataset)
    worst = ratio[int(np.abs(np.log(ratio.values)).argmax())]
    load = float(worst.normal_load)
    return [
        Claim(
            "For F_n = 0.01 N the contact slips and the system has a quasi-linear behaviour, with "
            "the stiffness k",
            "Fig. 3",
            f"resonance at {lightest:.4f} Hz, {free:.4f} Hz with k alone",
            abs(lightest / free - 1) < 1e-4,
            True,
        ),
        Claim(
            f"For F_n > {CLAIMED_FULL_STICK} N the contact is completely stuck",
            "Fig. 3",
            f"full stick from {stick:.1f} N on; at {CLAIMED_FULL_STICK} N the peak is "
            f"{at_claimed:.1f} dB, where nothing slips {stuck:.1f} dB",
            stick <= CLAIMED_FULL_STICK,
            False,
        ),
        Claim(
            "Where it is stuck, the stiffness is k + k_d",
            "Fig. 3",
            f"resonance at {heaviest:.3f} Hz with 500 N, {held:.3f} Hz with k + k_d",
            abs(heaviest / held - 1) < 1e-4,
            True,
        ),
        Claim(
            f"Peaks flatten as the load grows from 0.01 to {FLATTEST} N",
            "Fig. 3",
            f"from {decibels(flattening[0]):.1f} to {decibels(flattening[-1]):.1f} dB, each lower "
            "than the one before",
            bool(np.all(np.diff(flattening) < 0)),
            True,
        ),
        Claim(
            "In this case, one degree of freedom, only one harmonic is sufficient to obtain good "
            "results in terms of amplitude",
            "section on Figs. 3 and 4",
            f"peaks of the twelve loads are off by {100 * (float(worst) - 1):+.2g} % at most (with "
            f"{load:g} N), which is less than {VISIBLE:g} dB",
            suffices(float(worst)),
            True,
        ),
    ]


def findings(dataset: xr.Dataset) -> list[Finding]:
    """Where lines leave the axes of the source."""
    last = dataset.amplitude.max("dof").where(dataset.frequency == BAND[1]).max("point")
    low, high = (decibels(float(end)) for end in (last.min(), last.max()))
    end = TICKS[1][0]
    return [
        Finding(
            "With the parameters of the text, in dB re 1 m, the lines of Fig. 3 leave its axes",
            f"at {BAND[1]} Hz they are at {low:.1f} to {high:.1f} dB, the axes end at {end} dB",
            high < end,
        )
    ]


if __name__ == "__main__":
    run(NAME, compute, draw, draw_on_source_axes)
