"""Fig. 3: forced response of one blade with a friction damper to the ground, twelve normal loads.

Light loads let the blade swing freely, heavy ones hold the contact and add its stiffness; between
them lies a load that damps most. The peaks are closed forms with one harmonic; the exact periodic
motions of the reference come from an integration from event to event.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 3.
"""

import json

import xarray as xr
from matplotlib.figure import Figure

import symhbm as sh
from studies.companions import (
    ACCURACY,
    closed_form_peaks,
    full_stick,
    one_harmonic_suffices,
    with_companions,
)
from studies.landmark import Landmark, Source
from studies.run import REFERENCE, run

NAME = "fig03_single_blade"
NORMAL_LOADS = [0.01, 0.5, 1, 1.5, 2, 3, 5, 10, 18, 50, 100, 500]  # N
BAND = (10, 30)  # Hz
NEAR = (15, 23)
"""Band [Hz] around the peaks, where they are computed with enough harmonics."""
CLAIMED_FULL_STICK = 100  # N, as the source says
ONE_HARMONIC = 0.022
"""Error of the peaks with one harmonic up to which the source's claim holds for one blade."""


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
    return sh.HarmonicBalance(blade, sh.PointForce(amplitude=1.0), harmonics)


def compute(progress: bool = True) -> xr.Dataset:
    """Follow the response at every load."""
    over = {"normal_load": NORMAL_LOADS}
    dataset = sh.frf(problem(), BAND, over=over, throw=True, progress=progress)
    return with_companions(dataset, problem(), NEAR, over)


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the family of curves."""
    figure = sh.plot.response(dataset)
    figure.axes[0].set_title("One blade, friction damper to the ground, one harmonic")
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Peaks, their error with one harmonic, and the load of full stick."""
    exact = json.loads(REFERENCE.read_text())["single_blade_peaks"]
    stick = float(dataset.full_stick_normal_load)
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
        max(
            one_harmonic_suffices(dataset, "normal_load", tolerance=ONE_HARMONIC),
            key=lambda landmark: abs(landmark.difference),
        ),
        *full_stick(dataset),
        Landmark(
            "normal load of full stick",
            stick,
            CLAIMED_FULL_STICK,
            "N",
            Source.CLAIM,
            0.01,
            f"Full stick from {CLAIMED_FULL_STICK} N on",
        ),
    ]


if __name__ == "__main__":
    run(NAME, compute, draw)
