"""Fig. 6: forced response of the tuned 13-blade disk to a force on one blade.

A force on one blade excites every nodal diameter from 0 to 6, so seven resonances show. At the
source's load of 100 N the contacts slip where the response is large and cut the resonances down; at
the heavy load everything sticks, the disk is linear, and a direct solution of its equations gives
the same seven peaks. Blades i and 13 - i move alike, so the contact opposite to the force, between
blades 6 and 7, never moves.

The source calls its figure the linear response and states 100 N, with which the disk is not linear:
both are drawn, all 13 blades on the axes of the source.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 6.
"""

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import symhbm as sh
from studies import fig08_engine_orders as fig08
from studies.claim import Claim, Finding
from studies.closed_form import EXACT_DIGITS, StuckRing
from studies.companions import ACCURACY, full_stick_load, nodal_diameters, of_one_harmonic
from studies.landmark import Landmark, Source, number
from studies.run import run
from studies.source_axes import draw_blades, in_styles, set_axes

NAME = "fig06_point_force"
NORMAL_LOAD = 100  # N, as in the source
STUCK_LOAD = 1e5  # N, where nothing slips
BAND = (0.5, 350)  # Hz
TICKS = (0, 350, 50), (-200, -50, 50)
"""Ticks of the source, in Hz and dB."""
OPPOSITE = 6
"""Contact between the two blades opposite to the force."""
N_VALLEY = 12
"""Points from one end to the other of a stretch with an antiresonance."""
ROUND_OFF = 1e-12


def problem(harmonics: tuple[int, ...] = (1,)) -> sh.HarmonicBalance:
    """Return the disk of Fig. 8 with 1 N on blade 0."""
    disk = fig08.problem().model.with_parameters(normal_load=NORMAL_LOAD)
    return sh.HarmonicBalance(disk, sh.forces.PointForce(place=0, amplitude=1.0), harmonics)


def ring(problem: sh.HarmonicBalance) -> StuckRing:
    """Return the ring of a problem with stuck contacts, as numbers."""
    values = {name: float(np.mean(value)) for name, value in problem.parameters.items()}
    return StuckRing(
        n=problem.model.n_dof,
        mass=values["mass"],
        damping=values["damping"],
        stiffness=values["stiffness"],
        contact_stiffness=values["contact_stiffness"],
        force=values["force_amplitude"],
    )


def compute(progress: bool = True) -> xr.Dataset:
    """Follow the response at both loads, with the peaks and antiresonances of every blade."""
    over = {"normal_load": [NORMAL_LOAD, STUCK_LOAD]}
    path = sh.frf(problem(), BAND, over=over, peaks="each", throw=True, progress=progress)
    grid = through_valleys(path)
    dataset = sh.frf(problem(), BAND, grid, over, peaks="each", throw=True, progress=False)
    enough = sh.frf(problem(), BAND, accuracy=ACCURACY, throw=True, progress=False)
    about = f"at the peaks of the largest response at {NORMAL_LOAD:g} N, error {ACCURACY:g}"
    added = {
        "accurate_peak_amplitude": (enough.peak_amplitude, "m", f"displacement {about}"),
        "accurate_peak_frequency": (enough.peak_frequency, "Hz", f"frequency {about}"),
    }
    return dataset.assign(
        {
            name: ("accurate_peak", values.values, {"units": units, "long_name": long_name})
            for name, (values, units, long_name) in added.items()
        }
    )


def through_valleys(paths: xr.Dataset) -> np.ndarray:
    """Frequencies [Hz] of paths, and more where a blade falls and rises again between two points.

    There is its antiresonance, which paths are not made dense enough for: it is too faint.
    """
    grid = []
    for load in paths.normal_load.values:
        path = paths.sel(normal_load=load).dropna("point", subset=["frequency"])
        frequency = path.frequency.values
        falls = path.amplitude_slope.values[:-1] < 0
        rises = path.amplitude_slope_before.values[1:] > 0
        grid.append(frequency)
        for i in np.flatnonzero((falls & rises).any(axis=1)):
            grid.append(np.linspace(frequency[i], frequency[i + 1], N_VALLEY))
    return np.unique(np.concatenate(grid))


def resonances(curve: xr.Dataset) -> xr.Dataset:
    """Return the largest peak of all blades at each resonance, in the order of frequency.

    Peaks of the blades belong to the natural frequency of the stuck ring that is nearest.
    """
    natural = ring(sh.datasets.rebuild(curve)).natural_frequencies()
    found = curve.dropna("peak", subset=["peak_amplitude"])
    nearest = np.abs(found.peak_frequency.values[:, None] - natural).argmin(axis=1)
    amplitude = found.peak_amplitude.values
    chosen = [
        members[amplitude[members].argmax()]
        for members in (np.flatnonzero(nearest == n) for n in range(len(natural)))
        if len(members)
    ]
    return found.isel(peak=chosen)


def draw(dataset: xr.Dataset) -> Figure:
    """Draw all blades on the axes of the source: where nothing slips, and at the stated load."""
    n_blades = dataset.sizes["dof"]
    away = [min(blade, n_blades - blade) for blade in range(n_blades)]
    shades = plt.get_cmap("viridis")(np.linspace(0.0, 0.92, n_blades // 2 + 1))
    loads = {STUCK_LOAD: "nothing slips: linear", NORMAL_LOAD: "contacts slip"}
    with sh.plot.panels(2, 1, sharex=True, size=(9.0, 8.4)) as (figure, axes):
        for ax, (load, words) in zip(axes, loads.items(), strict=True):
            curve = dataset.sel(normal_load=load)
            in_styles(draw_blades(ax, curve, shades[away], linewidth=1.0), away)
            tops = resonances(curve)
            pairs = zip(tops.peak_frequency.values, tops.peak_amplitude.values, strict=True)
            for n, (at, top) in enumerate(pairs):
                place = at, 20 * np.log10(top)
                ax.annotate(f"{n}", place, (0, 2), textcoords="offset points", ha="center")
            set_axes(ax, *TICKS)
            ax.set_title(f"$F_n$ = {number(load)} N, {words}")
        axes[0].set_xlabel("")
        names = [f"blades {i}, {n_blades - i}" if i else "blade 0" for i in range(len(shades))]
        lines = axes[0].lines[: len(shades)]
        figure.legend(lines, names, loc="outside lower center", ncols=4, handlelength=3.2)
        figure.suptitle("Fig. 6: 1 N on blade 0 of 13, one harmonic; numbers: nodal diameters")
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Resonances of the stuck ring against the direct linear solution, and what must not move."""
    slipping, stuck = (dataset.sel(normal_load=load) for load in (NORMAL_LOAD, STUCK_LOAD))
    direct, tops = ring(sh.datasets.rebuild(stuck)), resonances(stuck)
    rows = []
    for n in range(tops.sizes["peak"]):
        amplitude, frequency = direct.peak(n)
        found = float(tops.peak_amplitude[n]), float(tops.peak_frequency[n])
        name = f"{nodal_diameters(n)}, F_n = {number(STUCK_LOAD)} N"
        source = Source.EXACT
        rows += [
            Landmark(f"peak, {name}", found[0], amplitude, "m", source, EXACT_DIGITS),
            # The top of a parabola: frequencies have half the digits of amplitudes.
            Landmark(f"resonance, {name}", found[1], frequency, "Hz", source, 1e-6),
        ]
    moved = slipping.coefficient.sel(dof=OPPOSITE) - slipping.coefficient.sel(dof=OPPOSITE + 1)
    still = float(
        (np.abs(moved).max(["harmonic", "component"]) / slipping.amplitude.max("dof")).max()
    )
    rows.append(
        Landmark(
            "motion of the contact opposite to the force, relative to the response",
            still,
            0.0,
            "",
            Source.CLOSED_FORM,
            ROUND_OFF,
        )
    )
    # Contacts move most a little beside the peaks of the blades.
    rows.append(
        Landmark(
            "normal load of full stick at the peaks",
            float(full_stick_load(tops).max()),
            direct.full_stick_load(float(dataset.friction_coefficient.mean())),
            "N",
            Source.EXACT,
            1e-5,
        )
    )
    return rows


def claims(dataset: xr.Dataset) -> list[Claim]:
    """What the source says of its Fig. 6."""
    stuck, slipping = (
        resonances(dataset.sel(normal_load=load)).sizes["peak"]
        for load in (STUCK_LOAD, NORMAL_LOAD)
    )
    n_blades = dataset.sizes["dof"]
    return [
        Claim(
            "Seven modes of resonance, (N + 1) / 2, are excited by a force on one blade",
            "Fig. 6",
            f"{stuck} resonances where nothing slips, {slipping} with {NORMAL_LOAD:g} N",
            stuck == slipping == (n_blades + 1) // 2,
            True,
        )
    ]


def findings(dataset: xr.Dataset) -> list[Finding]:
    """How good one harmonic is at the load of the source, and what slips at it."""
    slipping = dataset.sel(normal_load=NORMAL_LOAD)
    free = resonances(slipping)
    enough = dataset.accurate_peak_amplitude.values
    rows = []
    for n in range(free.sizes["peak"]):
        near = np.abs(dataset.accurate_peak_frequency.values - float(free.peak_frequency[n]))
        ratio = float(free.peak_amplitude[n]) / float(enough[near.argmin()])
        rows.append(of_one_harmonic(ratio, nodal_diameters(n), fails=False))
    slips = int((slipping.contact_state == 1).any(slipping.amplitude.dims[0]).sum())
    n_contacts = dataset.sizes["contact"]
    rows.append(
        Finding(
            f"At the {NORMAL_LOAD:g} N that the source states, the response is not linear",
            f"{slips} of {n_contacts} contacts slip at some frequency",
            slips == n_contacts - 1,
        )
    )
    return rows


if __name__ == "__main__":
    run(NAME, compute, draw)
