"""Fig. 6: forced response of the tuned 13-blade disk to a force on one blade.

A force on one blade excites every nodal diameter from 0 to 6, so seven resonances show. At the
source's load of 100 N the contacts slip where the response is large and cut the resonances down; at
the heavy load everything sticks, the disk is linear, and a direct solution of its equations gives
the same seven peaks. Blades i and 13 - i move alike, so the contact opposite to the force, between
blades 6 and 7, never moves.

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

NAME = "fig06_point_force"
NORMAL_LOAD = 100  # N, as in the source
STUCK_LOAD = 1e5  # N, where nothing slips
BAND = (10, 350)  # Hz
BLADES = (0, 1, 3, 6)
"""Blades that are drawn: the one with the force, its neighbour, and the one opposite."""
OPPOSITE = 6
"""Contact between the two blades opposite to the force."""
ROUND_OFF = 1e-12


def problem(harmonics: tuple[int, ...] = (1,)) -> sh.HarmonicBalance:
    """Return the disk of Fig. 8 with 1 N on blade 0."""
    disk = fig08.problem().model.with_parameters(normal_load=NORMAL_LOAD)
    return sh.HarmonicBalance(disk, sh.PointForce(dof=0, amplitude=1.0), harmonics)


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
    """Follow the response at both loads, with the peaks of every blade."""
    over = {"normal_load": [NORMAL_LOAD, STUCK_LOAD]}
    dataset = sh.frf(problem(), BAND, over=over, peaks="each", throw=True, progress=progress)
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


def resonances(curve: xr.Dataset) -> xr.Dataset:
    """Return the largest peak of all blades at each resonance, in the order of frequency.

    Peaks of the blades belong to the natural frequency of the stuck ring that is nearest.
    """
    natural = ring(sh.rebuild(curve)).natural_frequencies()
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
    """Draw some blades at the source's load over the blade with the force where nothing slips."""
    slipping = dataset.sel(normal_load=NORMAL_LOAD)
    stuck = dataset.sel(normal_load=STUCK_LOAD)
    colors = plt.get_cmap("viridis")(np.linspace(0.0, 0.85, len(BLADES)))
    with plt.rc_context(sh.plot.STYLE):
        figure, ax = plt.subplots(figsize=(9.0, 5.2), layout="constrained")
        sh.plot.response(stuck, dof=0, peaks=False, ax=ax)
        label = f"blade 0, $F_n$ = {number(STUCK_LOAD)} N: all stick"
        ax.lines[-1].set(color="0.72", linewidth=1.0, label=label)
        for place, (blade, color) in enumerate(zip(BLADES, colors, strict=True)):
            sh.plot.response(slipping, dof=blade, peaks=False, ax=ax)
            ax.lines[-1].set(
                color=color,
                linestyle=sh.plot.LINE_STYLES[place],
                label=f"blade {blade}, $F_n$ = {NORMAL_LOAD:g} N",
            )
        tops = resonances(stuck)
        for n, (at, top) in enumerate(
            zip(tops.peak_frequency.values, tops.peak_amplitude.values, strict=True)
        ):
            level = 20 * np.log10(top)
            ax.annotate(f"{n}", (at, level), (0, 3), textcoords="offset points", ha="center")
        ax.set_xlim(0, BAND[1])
        ax.set_ylim(bottom=-165)
        ax.set_ylabel("response of a blade [dB re 1 m]")
        handles, labels = ax.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3, handlelength=2.8)
        ax.set_title("Force on blade 0 of 13: resonances by nodal diameters, one harmonic")
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Resonances of the stuck ring against the direct linear solution, and what must not move."""
    slipping, stuck = (dataset.sel(normal_load=load) for load in (NORMAL_LOAD, STUCK_LOAD))
    direct, tops = ring(sh.rebuild(stuck)), resonances(stuck)
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
