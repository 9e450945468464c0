"""Fig. 8: forced response of the tuned 13-blade disk under engine orders 1, 3 and 6.

A travelling wave moves all blades alike, so one line shows them all; the full ring is solved, which
could tell if they did not. At engine order 1 the third harmonic of the friction force excites the
resonance with three nodal diameters, and one harmonic alone misses a tenth of the peak.

The travelling wave `f0 cos(omega t - 2 pi EO i / N)` is a reading: Eq. (12) as printed, `f0 cos(2
pi EO i / N) + f0 sin(2 pi EO i / N)`, has no time, and its amplitude is `sqrt(2) f0`. With forces
of these sizes in phase the blades differ by many dB, where the source says that they overlap.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 8.
"""

import json

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import symhbm as sh
from studies.claim import Claim, Finding, below
from studies.closed_form import StuckRing
from studies.companions import (
    ACCURACY,
    closed_form_peaks,
    decibels,
    full_stick,
    largest_peak,
    one_harmonic,
    with_companions,
)
from studies.landmark import Landmark, Source
from studies.run import REFERENCE, run

NAME = "fig08_engine_orders"
ENGINE_ORDERS = [1, 3, 6]
BAND = (50, 350)  # Hz
FAILS = (1,)
"""Engine orders at which one harmonic does not suffice."""
SAME_BLADES = 1e-9
"""Relative difference of blades that move alike: light damping costs digits."""


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
    """Follow the response of the full ring at every engine order, and under Eq. (12) in phase."""
    over = {"engine_order": ENGINE_ORDERS}
    options = dict(throw=True, progress=progress)
    dataset = sh.frf(problem(), BAND, over=over, sector=False, **options)  # type: ignore[arg-type]
    about = {"units": "dB", "long_name": "largest difference of blades under Eq. (12) in phase"}
    return with_companions(dataset, problem(), BAND, over).assign(
        in_phase_spread=("engine_order", [in_phase_spread(n) for n in ENGINE_ORDERS], about)
    )


def in_phase_spread(engine_order: int) -> float:
    """How far blades differ [dB] at the largest peak under Eq. (12) as printed, in phase."""
    disk = problem().model
    turn = 2 * np.pi * engine_order * np.arange(disk.n_dof) / disk.n_dof
    force = sh.HarmonicForce(cosine={1: np.cos(turn) + np.sin(turn)})
    in_phase = sh.HarmonicBalance(disk, force, (1,))
    found = largest_peak(sh.frf(in_phase, BAND, throw=True, progress=False))
    size = np.sqrt((found.peak_coefficient**2).sum(["harmonic", "component"]))
    return decibels(float(size.max() / size.min()))


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
        *full_stick(dataset, "engine_order"),
    ]


def claims(dataset: xr.Dataset) -> list[Claim]:
    """What the source says of its Fig. 8."""
    spread = float((dataset.amplitude.max("dof") / dataset.amplitude.min("dof") - 1).max())
    one = dataset.sel(engine_order=1)
    disk = {
        name: float(one[name].mean())
        for name in ("mass", "damping", "stiffness", "contact_stiffness")
    }
    second = StuckRing(n=dataset.sizes["dof"], force=1.0, **disk).natural_frequencies()[1]
    found = float(largest_peak(dataset).peak_frequency.sel(engine_order=1))
    return [
        Claim(
            "Responses of the different blades are overlapped when the system is tuned",
            "Fig. 8",
            f"blades of the full ring differ by {below(spread, SAME_BLADES)} of the response",
            spread < SAME_BLADES,
            True,
        ),
        Claim(
            "For EO = 1 the frequency is the second one under a force on one blade",
            "Fig. 8",
            f"{found:.2f} Hz, {second:.2f} Hz where all contacts stick",
            abs(found / second - 1) < 0.01,
            True,
        ),
    ]


def findings(dataset: xr.Dataset) -> list[Finding]:
    """How good one harmonic is, and what Eq. (12) read word by word would give."""
    spread = dataset.in_phase_spread
    levels = ", ".join(
        f"{float(value):.0f} dB under EO {int(value.engine_order)}" for value in spread
    )
    return [
        *one_harmonic(dataset, "engine_order", fails=FAILS),
        Finding(
            "Eq. (12) is read as a travelling wave: with forces in phase the blades would differ",
            f"at the largest peak by {levels}",
            bool((spread > 1).all()),
        ),
    ]


if __name__ == "__main__":
    run(NAME, compute, draw)
