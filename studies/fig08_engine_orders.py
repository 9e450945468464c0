"""Fig. 8: forced response of the tuned 13-blade disk under engine orders 1, 3 and 6.

A travelling wave moves all blades alike, so one line shows them all. At engine order 1 the third
harmonic of the friction force excites the resonance with three nodal diameters, and one harmonic
alone misses a tenth of the peak.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 8.
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

NAME = "fig08_engine_orders"
ENGINE_ORDERS = [1, 3, 6]
BAND = (50, 350)  # Hz
FAILS = (1,)
"""Engine orders at which one harmonic does not suffice."""


def problem(harmonics: tuple[int, ...] = (1,)) -> sh.HarmonicBalance:
    """Return the paper's disk: 13 blades, contacts of 1e6 N/m, mu = 0.5, F_n = 100 N."""
    disk = sh.bladed_disk(
        13,
        mass=1,
        stiffness=1e4,
        damping=0.5,
        contact_stiffness=1e6,
        friction_coefficient=0.5,
        normal_load=100,
    )
    return sh.HarmonicBalance(disk, sh.EngineOrder(1, amplitude=1.0), harmonics)


def compute(progress: bool = True) -> xr.Dataset:
    """Follow the response of the full ring at every engine order."""
    over = {"engine_order": ENGINE_ORDERS}
    dataset = sh.frf(problem(), BAND, over=over, throw=True, progress=progress)
    return with_companions(dataset, problem(), BAND, over)


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the three curves."""
    figure = sh.plot.response(dataset)
    figure.axes[0].set_title("Tuned disk of 13 blades, one harmonic, full ring")
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Peaks with one harmonic and with enough, and the loads of full stick."""
    exact = json.loads(REFERENCE.read_text())["ring_EO_1_3_6_Fn100"]
    return [
        *closed_form_peaks(dataset, "engine_order"),
        *[
            Landmark(
                f"peak with enough harmonics, EO = {peak['EO']}",
                float(dataset.accurate_peak_amplitude.sel(engine_order=peak["EO"])),
                peak["exact_peak_x"],
                "m",
                Source.EXACT,
                ACCURACY,
            )
            for peak in exact
        ],
        *one_harmonic_suffices(dataset, "engine_order", fails=FAILS),
        *full_stick(dataset, "engine_order"),
    ]


if __name__ == "__main__":
    run(NAME, compute, draw)
