"""Fig. 8: forced response of the tuned 13-blade disk under engine orders 1, 3 and 6.

A travelling wave moves all blades alike, so their lines lie on each other; the full ring is solved,
which could tell if they did not. At engine order 1 the third harmonic of the friction force excites
the resonance with three nodal diameters, and one harmonic alone misses a tenth of the peak.

The travelling wave `f0 cos(omega t - 2 pi EO i / N)` is a reading: Eq. (12) as printed, `f0 cos(2
pi EO i / N) + f0 sin(2 pi EO i / N)`, has no time, and its amplitude is `sqrt(2) f0`. With forces
of these sizes in phase the blades differ by many dB, where the source says that they overlap. With
`f0` lines leave the axes of Figs. 8c and 10 at their lower end, with `sqrt(2) f0` they would not;
but they leave those of Fig. 12 with either, and those of Fig. 3, where there is no wave.

That (a) is engine order 1 is a reading, too. So say its title and the text, while the caption calls
it `mono point`; a force on one blade would reach beyond its axes.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 8.
"""

import json

import matplotlib.pyplot as plt
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
    of_wave_amplitude,
    one_harmonic,
    with_companions,
)
from studies.landmark import Landmark, Source
from studies.run import REFERENCE, run
from studies.source_axes import draw_blades, set_axes

NAME = "fig08_engine_orders"
ENGINE_ORDERS = [1, 3, 6]
BAND = (0.5, 350)  # Hz
NEAR = (50, 350)
"""Band [Hz] around the peaks, where they are computed with enough harmonics."""
TICKS = {
    1: ((0, 350, 50), (-140, -70, 10)),
    3: ((50, 350, 50), (-130, -70, 10)),
    6: ((50, 350, 50), (-130, -70, 10)),
}
"""Ticks of the source by engine order, in Hz and dB."""
FAILS = (1,)
"""Engine orders at which one harmonic does not suffice."""
DIAMETERS = [2, 3, 4, 5, 6]
"""The engine orders above 1, up to the most nodal diameters that 13 blades have."""
SAME_BLADES = 1e-9
"""Relative difference of blades that move alike: light damping costs digits."""


def problem(harmonics: tuple[int, ...] = (1,)) -> sh.HarmonicBalance:
    """Return the paper's disk: 13 blades, contacts of 1e6 N/m, mu = 0.5, F_n = 100 N."""
    structure = sh.bladed_disk(
        13,
        mass=1,
        stiffness=1e4,
        damping=0.5,
        contact_stiffness=1e6,
        friction_coefficient=0.5,
        normal_load=100,
    )
    return sh.HarmonicBalance(structure, sh.forces.EngineOrder(1, amplitude=1.0), harmonics)


def compute(progress: bool = True) -> xr.Dataset:
    """Follow the response of the full ring at every engine order, and under Eq. (12) in phase."""
    over = {"engine_order": ENGINE_ORDERS}
    options = dict(throw=True, progress=progress)
    dataset = sh.frf(problem().with_by_sector(False), BAND, over=over, **options)  # type: ignore[arg-type]
    about = {"units": "dB", "long_name": "largest difference of blades under Eq. (12) in phase"}
    waves = sh.frf(problem(), NEAR, over={"engine_order": DIAMETERS}, **options)  # type: ignore[arg-type]
    of_wave = {
        "units": "Hz",
        "long_name": "frequency of the largest peak under engine orders 2 to 6",
    }
    return with_companions(dataset, problem(), NEAR, over).assign(
        in_phase_spread=("engine_order", [in_phase_spread(n) for n in ENGINE_ORDERS], about),
        higher_peak_frequency=("diameters", largest_peak(waves).peak_frequency.values, of_wave),
        diameters=("diameters", DIAMETERS, {"units": "1", "long_name": "engine order above 1"}),
    )


def in_phase_spread(engine_order: int) -> float:
    """How far blades differ [dB] at the largest peak under Eq. (12) as printed, in phase."""
    structure = problem().model
    turn = 2 * np.pi * engine_order * np.arange(structure.n_dof) / structure.n_dof
    force = sh.forces.HarmonicForce(cosine={1: np.cos(turn) + np.sin(turn)})
    in_phase = sh.HarmonicBalance(structure, force, (1,))
    found = largest_peak(sh.frf(in_phase, NEAR, throw=True, progress=False))
    size = np.sqrt((found.peak_coefficient**2).sum(["harmonic", "component"]))
    return decibels(float(size.max() / size.min()))


def draw(dataset: xr.Dataset) -> Figure:
    """Draw all blades on the axes of the source, one picture per engine order."""
    n_blades = dataset.sizes["dof"]
    shades = plt.get_cmap("viridis")(np.linspace(0, 0.92, n_blades))
    widths = np.linspace(2.4, 0.6, n_blades)
    with sh.plot.panels(1, 3, size=(13.5, 4.6)) as (figure, axes):
        for ax, letter, (order, ticks) in zip(axes, "abc", TICKS.items(), strict=True):
            lines = draw_blades(ax, dataset.sel(engine_order=order), shades)
            for line, width in zip(lines, widths, strict=True):
                line.set_linewidth(width)
            set_axes(ax, *ticks)
            ax.set_title(f"({letter}) all {n_blades} blades, EO {order}")
        figure.suptitle(
            "Fig. 8: tuned disk of 13 blades, one harmonic, full ring; lines of all blades, the "
            "first the widest, lie on each other"
        )
    return figure


def disk(dataset: xr.Dataset) -> StuckRing:
    """The disk where no contact slips, with a force on one blade."""
    names = "mass", "damping", "stiffness", "contact_stiffness"
    values = {name: float(dataset[name].mean()) for name in names}
    return StuckRing(n=dataset.sizes["dof"], force=1.0, **values)


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
    natural = disk(dataset).natural_frequencies()
    second = natural[1]
    higher, stuck = dataset.higher_peak_frequency, natural[dataset.diameters.values]
    each = ", ".join(
        f"EO {order}: {at:.1f} ({own:.1f})"
        for order, at, own in zip(dataset.diameters.values, higher.values, stuck, strict=True)
    )
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
        Claim(
            "The same type of behaviour happens for higher values of EO",
            "Fig. 8",
            f"the frequency is that of as many nodal diameters, number EO + 1: {each} Hz, in "
            "brackets where all contacts stick",
            bool((abs(higher / stuck - 1) < 0.01).all()),
            True,
        ),
    ]


def findings(dataset: xr.Dataset) -> list[Finding]:
    """How good one harmonic is, and what Eq. (12) read word by word would give."""
    spread = dataset.in_phase_spread
    alone, end = decibels(disk(dataset).peak(0)[0]), TICKS[1][1][1]
    wave = decibels(float(largest_peak(dataset).peak_amplitude.sel(engine_order=1)))
    last, first = dataset.sel(engine_order=6), TICKS[6][0][0]
    lowest = decibels(np.interp(first, last.frequency, last.amplitude.max("dof")))
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
        Finding(
            "Fig. 8a is read as EO 1: the force on one blade that its caption names does not fit",
            f"it would reach {alone:.1f} dB at 15.9 Hz, EO 1 reaches {wave:.1f} dB, the axes end "
            f"at {end} dB",
            wave < end < alone,
        ),
        of_wave_amplitude(f"EO 6, part (c), at {first} Hz", lowest, TICKS[6][1][0]),
    ]


if __name__ == "__main__":
    run(NAME, compute, draw)
