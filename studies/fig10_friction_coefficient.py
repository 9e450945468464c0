"""Fig. 10: forced response of the tuned 13-blade disk under engine order 3, mu from 0.2 to 0.8.

The friction coefficient acts as the normal load does, through the limit mu F_n: more of it holds
the contacts longer, which moves the resonance up towards that of the stuck disk and, at this load,
raises the peak.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 10.
"""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import symhbm as sh
from studies import fig08_engine_orders as fig08
from studies.claim import Claim, Finding
from studies.closed_form import one_blade
from studies.companions import (
    closed_form_peaks,
    full_stick,
    largest_peak,
    one_harmonic,
    stick_at_peak,
    with_companions,
)
from studies.landmark import Landmark
from studies.run import run

NAME = "fig10_friction_coefficient"
ENGINE_ORDER = 3
NORMAL_LOAD = 10  # N
CONTACT_STIFFNESS = 1e5  # N/m
FRICTION_COEFFICIENTS = [0.2, 0.4, 0.6, 0.8]
BAND = (10, 100)  # Hz
FAILS = (0.2,)
"""Friction coefficients at which one harmonic does not suffice."""


def problem(harmonics: tuple[int, ...] = (1,)) -> sh.HarmonicBalance:
    """Return the disk of Fig. 8 under engine order 3, with 1e5 N/m and 10 N."""
    return fig08.problem(harmonics).with_parameters(
        engine_order=ENGINE_ORDER, normal_load=NORMAL_LOAD, contact_stiffness=CONTACT_STIFFNESS
    )


def compute(progress: bool = True) -> xr.Dataset:
    """Follow the response at every friction coefficient."""
    over = {"friction_coefficient": FRICTION_COEFFICIENTS}
    dataset = sh.frf(problem(), BAND, over=over, throw=True, progress=progress)
    return with_companions(dataset, problem(), BAND, over)


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the four curves."""
    figure = sh.plot.response(dataset)
    figure.axes[0].set_title(
        "Tuned disk of 13 blades, EO 3, $k_d$ = 1e5 N/m, $F_n$ = 10 N, one harmonic"
    )
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Peaks and the loads of full stick."""
    return [
        *closed_form_peaks(dataset, "friction_coefficient"),
        *full_stick(dataset, "friction_coefficient"),
    ]


def claims(dataset: xr.Dataset) -> list[Claim]:
    """What the source says of its Fig. 10."""
    resonance = largest_peak(dataset).peak_frequency.values
    stick = stick_at_peak(dataset).values
    # Less than the half-power width of a stuck resonance would be no shift.
    width = float(dataset.damping.mean() / (2 * np.pi * dataset.mass.mean()))
    shift = float(np.ptp(resonance))
    low, high = dataset.friction_coefficient.values[[0, -1]]
    limit = one_blade(dataset.isel(friction_coefficient=0)).optimum()[0]
    best = limit / NORMAL_LOAD
    return [
        Claim(
            "The frequency does not change as a function of mu",
            "Fig. 10",
            f"{resonance[0]:.1f} to {resonance[-1]:.1f} Hz over mu = {low:g} to {high:g}",
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
            f"at mu = {best:.3f}, outside the range {low:g} to {high:g}, where the peak only rises",
            low <= best <= high,
            False,
        ),
    ]


def findings(dataset: xr.Dataset) -> list[Finding]:
    """How good one harmonic is."""
    return one_harmonic(dataset, "friction_coefficient", fails=FAILS)


if __name__ == "__main__":
    run(NAME, compute, draw)
