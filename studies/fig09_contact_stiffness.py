"""Fig. 9: forced response of the tuned 13-blade disk under engine order 2, three stiffnesses.

A stiffer contact moves the resonance up, though not as far as that of the stuck disk: it slips the
sooner, as the same load holds less and less displacement. Under engine order 0 neighbours move
alike and the contacts do nothing, whatever their parameters.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 9.
"""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import symhbm as sh
from studies import fig08_engine_orders as fig08
from studies.claim import Claim, Finding, below
from studies.closed_form import one_blade
from studies.companions import (
    closed_form_peaks,
    decibels,
    full_stick,
    largest_peak,
    one_harmonic,
    stick_at_peak,
    stuck_peak,
    with_companions,
)
from studies.landmark import Landmark, Source, number
from studies.run import run

NAME = "fig09_contact_stiffness"
ENGINE_ORDER = 2
NORMAL_LOAD = 10  # N
CONTACT_STIFFNESSES = [1e4, 1e5, 1e6]  # N/m
BAND = (10, 200)  # Hz
FAILS = (1e4, 1e5, 1e6)
"""Contact stiffnesses at which one harmonic does not suffice."""
UNCOUPLED = {
    "contact_stiffness": [1e4, 1e6],
    "friction_coefficient": [0.0, 0.5],
    "normal_load": [0.0, 10.0],
}
"""Parameters that make no difference under engine order 0."""
ROUND_OFF = 1e-10
"""Relative difference of equal responses of a resonance with a quality factor of 200."""


def problem(harmonics: tuple[int, ...] = (1,)) -> sh.HarmonicBalance:
    """Return the disk of Fig. 8 under engine order 2, with 10 N."""
    return fig08.problem(harmonics).with_parameters(
        engine_order=ENGINE_ORDER, normal_load=NORMAL_LOAD
    )


def uncoupled_spread() -> float:
    """Largest relative difference of responses under engine order 0, over their parameters."""
    grid = np.linspace(*BAND, 20)
    found = sh.frf(
        problem().with_parameters(engine_order=0), BAND, grid, UNCOUPLED, progress=False, throw=True
    )
    settings = tuple(UNCOUPLED)
    spread = found.amplitude.max(settings) - found.amplitude.min(settings)
    return float((spread / found.amplitude.max(settings)).max(skipna=False))


def compute(progress: bool = True) -> xr.Dataset:
    """Follow the response at every contact stiffness."""
    over = {"contact_stiffness": CONTACT_STIFFNESSES}
    dataset = sh.frf(problem(), BAND, over=over, throw=True, progress=progress)
    about = {"units": "1", "long_name": "spread of responses under engine order 0, relative"}
    return with_companions(dataset, problem(), BAND, over).assign(
        uncoupled_spread=((), uncoupled_spread(), about)
    )


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the three curves."""
    figure = sh.plot.response(dataset)
    legend = figure.axes[0].get_legend()
    assert legend is not None
    for text, stiffness in zip(legend.get_texts(), dataset.contact_stiffness.values, strict=True):
        text.set_text(f"$k_d$ = {number(stiffness)} N/m")
    figure.axes[0].set_title("Tuned disk of 13 blades, EO 2, $F_n$ = 10 N, one harmonic")
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Peaks, their error with one harmonic, the loads of full stick, and engine order 0."""
    return [
        *closed_form_peaks(dataset, "contact_stiffness"),
        *full_stick(dataset, "contact_stiffness"),
        Landmark(
            "spread of the responses under EO 0 over k_d, mu and F_n",
            float(dataset.uncoupled_spread),
            0.0,
            "",
            Source.EXACT,
            ROUND_OFF,
        ),
    ]


def claims(dataset: xr.Dataset) -> list[Claim]:
    """What the source says of its Fig. 9."""
    top, slip = largest_peak(dataset), 100 * (1 - stick_at_peak(dataset))
    frequency, level = top.peak_frequency.values, [decibels(a) for a in top.peak_amplitude.values]
    curves = [dataset.isel(contact_stiffness=i) for i in range(len(frequency))]
    widths = [one_blade(curve).half_power_width() for curve in curves]
    softest = curves[0]
    held = decibels(stuck_peak(softest)[0])
    return [
        Claim(
            "For EO = 0 the contact stiffness has no influence on the resonance at 15.9 Hz",
            "section on the contact stiffness",
            "over k_d, mu and F_n responses differ by "
            f"{below(float(dataset.uncoupled_spread), ROUND_OFF)}",
            float(dataset.uncoupled_spread) < ROUND_OFF,
            True,
        ),
        Claim(
            "An increase of the contact stiffness causes resonance at higher frequencies",
            "Fig. 9",
            ", ".join(f"{f:.1f} Hz" for f in frequency),
            bool(np.all(np.diff(frequency) > 0)),
            True,
        ),
        Claim(
            "An increase of the contact stiffness flattens the peaks",
            "Fig. 9",
            f"{', '.join(f'{a:.1f} dB' for a in level)}; half-power widths "
            f"{', '.join(f'{100 * w:.0f} %' for w in widths)} of the resonance",
            bool(np.all(np.diff(level) < 0) and np.all(np.diff(widths) > 0)),
            True,
        ),
        Claim(
            "For k_d = 1e4 N/m the peaks are quite sharp, a stuck contact behaviour",
            "Fig. 9",
            f"at the peak contacts slip for {slip[0]:.0f} % of the period ({slip[1]:.0f} and "
            f"{slip[2]:.0f} % with stiffer ones), {held - level[0]:.0f} dB below the stuck peak; "
            f"full stick from {float(softest.full_stick_normal_load):.0f} N on",
            float(slip[0]) < 1.0,
            False,
        ),
    ]


def findings(dataset: xr.Dataset) -> list[Finding]:
    """How good one harmonic is, and how far the resonance stays behind the stuck one."""
    found = largest_peak(dataset).peak_frequency.values
    held = [stuck_peak(dataset.isel(contact_stiffness=i))[1] for i in range(len(found))]
    ratio = found / held
    return [
        *one_harmonic(dataset, "contact_stiffness", fails=FAILS),
        Finding(
            "The stiffer the contact, the farther the resonance stays below that of the stuck disk",
            f"{', '.join(f'{r:.3f}' for r in ratio)} of it",
            bool(np.all(np.diff(ratio) < 0)),
        ),
    ]


if __name__ == "__main__":
    run(NAME, compute, draw)
