"""An underplatform damper between a blade and a wall: the peak over its mass, and the best mass.

The damper is a body of its own, free to move along the radius and along the circumference. At
constant speed `m r Omega^2` presses it against the platform of the blade and against a wall, two
contacts whose normals make an angle with the radius. Nothing else holds it: how the load shares
between both, and whether it lifts off on one side, follows from its equilibrium. The steady force
on the blade is balanced, as by the damper on its other side.

Without friction each contact carries `N0 = m r Omega^2 / (2 cos(angle))`. A light body that slides
takes `N0 / (1 + mu tan(angle))` while friction pulls it outwards, and `N0 / (1 - mu tan(angle))`
while it pulls it inwards. So a light damper acts on the blade like one slider with the limit
`mu N0 s / (cos(angle) (1 - mu^2 tan(angle)^2))`, where the platform moves `s` times as much as the
blade; its peaks and its best mass are closed forms with one harmonic. Load and inertia both grow
with the mass, but a lighter damper lets the blade move more: where its inertia exceeds its load it
lifts off from the blade, and not from the wall. Once it flies for longer it bounces, on springs
that hardly lose energy; that takes many harmonics, and is left out. What is
shown is the largest displacement, with that in the mean, which is small.

Reference: J. H. Griffin, Friction damping of resonant stresses in gas turbine engine airfoils, J.
Eng. Power 102 (1980), 329-333, for the slider.
"""

from importlib.metadata import version
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import minimize_scalar

import symhbm as sh
from studies.closed_form import OneBlade
from studies.landmark import Landmark, Source
from studies.run import run
from studies.smooth import with_states
from symhbm.numerics import FloatArray

NAME = "underplatform_damper"
BLADE_MASS, BLADE_DAMPING, BLADE_STIFFNESS, FORCE = 0.35, 0.44, 2.2e6, 10.0  # kg, N s/m, N/m, N
PLATFORM = 0.5
"""Displacement of the platform over that of the blade."""
ANGLE = np.radians(40)
"""Angle between the normals of the contacts and the radius."""
LOSS = 300.0
"""Viscous damping of the damper over its mass [1/s], less than a percent of critical."""
RADIUS, SPEED = 0.3, 2 * np.pi * 40  # m, rad/s
CONTACT_STIFFNESS, FRICTION = 1e7, 0.3  # N/m, in both directions
MASSES = np.geomspace(1.4e-3, 1.6e-2, 9)  # kg
SEARCHED = (3.5e-3, 9e-3)  # kg
SHOWN = (0, 2, 6, 8)
"""Numbers of the masses whose responses are drawn."""
BAND = (390.0, 520.0)
HIGHEST = 5
ROUND_OFF = 1e-9
REPEATED = 20
"""Estimates of the best mass, each of which knows the mass from the one before."""
SLIDING = 0.02
"""Of a light damper that slides, what its inertia and the elastic part of its motion change."""
LIGHT = 0.1
"""Of the optimum and of lift-off, what the motion of the damper of its own and harmonics change."""
TRUNCATION = 0.05
"""Of the lowest peak: the damper rings at some twenty times the frequency, which few tell."""
OF_BLADE = 0
SIDES = "blade", "wall"
"""What contacts are with, besides the damper."""
STATES = "0 sticks, 1 slips, 2 opens"


def load(mass: float) -> float:
    """Normal load [N] of each contact without friction."""
    return mass * RADIUS * SPEED**2 / (2 * np.cos(ANGLE))


def problem(mass: float, highest: int = HIGHEST, friction: float = FRICTION) -> sh.HarmonicBalance:
    """Return the balance of the blade, and of the damper along the radius and circumference."""
    cosine, sine = np.cos(ANGLE), np.sin(ANGLE)
    contacts = sh.Friction(
        tangential=[{0: -PLATFORM * cosine, 1: sine, 2: cosine}, {1: sine, 2: -cosine}],
        normal=[{0: PLATFORM * sine, 1: cosine, 2: -sine}, {1: cosine, 2: sine}],
        contact_stiffness=CONTACT_STIFFNESS,
        normal_stiffness=CONTACT_STIFFNESS,
        friction_coefficient=friction,
        normal_load=0.0,
        preload="coupled",
    )
    matrices = (
        np.diag([BLADE_MASS, mass, mass]),
        np.diag([BLADE_DAMPING, LOSS * mass, LOSS * mass]),
        np.diag([BLADE_STIFFNESS, 0, 0]),
    )
    structure = sh.Model(*matrices, contacts={"damper": contacts})
    steady = [PLATFORM * sine * load(mass), mass * RADIUS * SPEED**2, 0.0]
    force = sh.forces.PointForce(0, amplitude=FORCE) + sh.forces.StaticLoad(steady)
    return sh.HarmonicBalance(structure, force, range(highest + 1))


def slider(mass: float) -> OneBlade:
    """Return the blade with the slider that a light damper is, one harmonic.

    The damper moves half as far as the platform along the circumference, and along the radius as
    the slopes make it.
    """
    share = (PLATFORM / (2 * np.cos(ANGLE))) ** 2
    return OneBlade(
        mass=BLADE_MASS + share * mass,
        damping=BLADE_DAMPING + share * LOSS * mass,
        stiffness=BLADE_STIFFNESS,
        # Both stiffnesses alike make a contact a spring in every direction; two are in series.
        contact_stiffness=PLATFORM**2 * CONTACT_STIFFNESS / 2,
        slip_limit=limit(mass),
        force=FORCE,
        ratio=1.0,
    )


def limit(mass: float) -> float:
    """Limit [N] of that slider, from the load while friction pulls outwards and inwards."""
    steepness = FRICTION * np.tan(ANGLE)
    return FRICTION * load(mass) * PLATFORM / (np.cos(ANGLE) * (1 - steepness**2))


def best() -> tuple[float, float]:
    """Best mass [kg] of a light damper and its peak [m], one harmonic."""
    mass = amplitude = 0.0
    for _ in range(REPEATED):
        least, amplitude, _ = slider(mass).optimum()
        mass = least / limit(1.0)
    return mass, amplitude


def lifting(frequency: float) -> float:
    """Displacement of the blade [m] from which a damper that slides lifts off from it.

    It follows both slopes, and its acceleration takes all load from one of them where the blade
    turns back.
    """
    cosine, sine = np.cos(ANGLE), np.sin(ANGLE)
    outwards, sideways = cosine + FRICTION * sine, sine - FRICTION * cosine
    acceleration = (2 * np.pi * frequency) ** 2 * PLATFORM / 2
    taken = acceleration * (1 / sideways + np.tan(ANGLE) / outwards)
    return float(RADIUS * SPEED**2 / outwards / taken)


def response(mass: float, highest: int = HIGHEST, progress: bool = False) -> xr.Dataset:
    """Return the response over the band under one mass."""
    return sh.frf(problem(mass, highest), BAND, progress=progress, throw=True)


def peak(found: xr.Dataset) -> tuple[float, float]:
    """Highest peak of the blade [m] and its frequency [Hz]."""
    of_blade = found.peak_amplitude.where(found.peak_dof == 0)
    at = int(np.nanargmax(of_blade.values))
    return float(of_blade[at]), float(found.peak_frequency[at])


def compute(progress: bool = True) -> xr.Dataset:
    """Peaks and what contacts do there by mass, some responses, and the best mass."""
    rows, curves = [], []
    for mass in MASSES:
        found = response(mass)
        amplitude, frequency = peak(found)
        at = sh.solve(problem(mass), frequency, throw=True)
        lifts = (found.event_kind == "onset of opening") & (found.event_contact == OF_BLADE)
        onset = found.event_frequency.values[lifts.values]
        unrubbed = sh.solve(problem(mass, 1, friction=0.0), BAND[0], throw=True)
        rows.append(
            dict(
                peak_amplitude=amplitude,
                peak_frequency=frequency,
                contact_state=at.contact_state.values.ravel(),
                open_fraction=at.open_fraction.values.ravel(),
                mean_normal_force=at.mean_normal_force.values.ravel(),
                unrubbed_normal_force=unrubbed.mean_normal_force.values.ravel(),
                slider_amplitude=slider(mass).peak()[0],
                lift_amplitude=_at(found, onset[0]) if len(onset) else np.nan,
            )
        )
        *columns, states = with_states(found, 0, np.maximum)
        curves.append(np.array([*columns, *states.T]))

    def level(logarithm: float) -> float:
        return float(np.log(peak(response(float(np.exp(logarithm))))[0]))

    ends = tuple(np.log(SEARCHED))
    lowest: Any = minimize_scalar(level, bounds=ends, method="bounded", options={"xatol": 2e-2})
    best_mass = float(np.exp(lowest.x))
    amplitude, frequency = peak(response(best_mass))
    exact = sh.periodic_motion(problem(best_mass), frequency, throw=True).amplitude[0]
    return _dataset(rows, curves, best_mass, amplitude, float(exact))


def _at(found: xr.Dataset, frequency: float) -> float:
    """Displacement of the blade [m] at the point of an event."""
    return float(found.amplitude[int(np.argmin(np.abs(found.frequency.values - frequency))), 0])


def _dataset(
    rows: list[dict], curves: list[FloatArray], best_mass: float, lowest: float, exact: float
) -> xr.Dataset:
    described = {
        "peak_amplitude": ("m", "highest peak of the blade"),
        "peak_frequency": ("Hz", "frequency of the highest peak"),
        "contact_state": ("1", f"{STATES}, at the peak"),
        "open_fraction": ("1", "share of the period that the contact is open, at the peak"),
        "mean_normal_force": ("N", "normal force in the mean over the period, at the peak"),
        "unrubbed_normal_force": ("N", "normal force in the mean without friction"),
        "lift_amplitude": ("m", "displacement of the blade where the damper begins to lift off"),
        "slider_amplitude": ("m", "peak with a slider in place of the damper, one harmonic"),
    }
    variables = {}
    for name, (units, long_name) in described.items():
        values = np.array([row[name] for row in rows])
        dims = ("damper_mass", "side")[: values.ndim]
        variables[name] = dims, values, {"units": units, "long_name": long_name}
    padded = np.full((len(MASSES), 4, max(curve.shape[1] for curve in curves)), np.nan)
    for row, curve in zip(padded, curves, strict=True):
        row[:, : curve.shape[1]] = curve
    over = "damper_mass", "point"
    for name, dims, values, units, long_name in (
        ("frequency", over, padded[:, 0], "Hz", "excitation frequency"),
        ("amplitude", over, padded[:, 1], "m", "largest displacement of the blade"),
        ("state", (*over, "side"), padded[:, 2:].transpose(0, 2, 1), "1", STATES),
    ):
        variables[name] = dims, values, {"units": units, "long_name": long_name}
    for name, value, units, long_name in (
        ("best_mass", best_mass, "kg", "mass of the lowest peak"),
        ("best_amplitude", lowest, "m", "lowest peak"),
        ("exact_amplitude", exact, "m", "exact motion at its frequency"),
    ):
        variables[name] = (), value, {"units": units, "long_name": long_name}
    mass = {"units": "kg", "long_name": "mass of the damper"}
    sides = {"units": "1", "long_name": "what the contact is with"}
    coordinates = {
        "damper_mass": ("damper_mass", MASSES, mass),
        "side": ("side", list(SIDES), sides),
    }
    attributes = {
        "title": "An underplatform damper between a blade and a wall",
        "references": "J. H. Griffin, J. Eng. Power 102 (1980), 329-333",
        "symhbm_schema": 1,
        "symhbm_version": version("symhbm"),
    }
    return xr.Dataset(variables, coordinates, attributes)


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the peak over the mass with what contacts do there, and responses."""
    with sh.plot.panels(0, size=(11.5, 6.0)) as (figure, _):
        axes = figure.subplot_mosaic("PR;SR", width_ratios=(1.25, 1), height_ratios=(3, 2))
        _draw_peaks(axes["P"], dataset)
        _draw_states(axes["S"], dataset)
        axes["P"].sharex(axes["S"])
        _draw_responses(axes["R"], dataset)
        figure.suptitle(
            f"An underplatform damper at {60 * SPEED / (2 * np.pi):g} revolutions per minute"
        )
    return figure


def _draw_peaks(ax: Axes, dataset: xr.Dataset) -> None:
    grams = 1e3 * dataset.damper_mass.values
    fine = np.geomspace(MASSES[0], MASSES[-1], 200)
    closed = [1e3 * slider(mass).peak()[0] for mass in fine]
    ax.loglog(1e3 * fine, closed, "--", color="0.5", label="slider, one harmonic, closed form")
    ax.loglog(grams, 1e3 * dataset.peak_amplitude, "o", color="tab:blue", label="damper")
    best_of = 1e3 * float(dataset.best_mass), 1e3 * float(dataset.best_amplitude)
    label = f"lowest: {best_of[1]:.4f} mm with {best_of[0]:.1f} g"
    ax.plot(*best_of, "*", color="tab:red", markersize=13, label=label)
    free = FORCE / (BLADE_DAMPING * np.sqrt(BLADE_STIFFNESS / BLADE_MASS))
    ax.axhline(1e3 * free, color="0.6", linewidth=0.9, linestyle=(0, (1, 2)))
    beside = dict(textcoords="offset points", va="top")
    ax.annotate("no damper", (grams[0], 1e3 * free), (0, -3), **beside)  # type: ignore
    ax.set_ylabel("highest peak of the blade [mm]")
    ax.tick_params(labelbottom=False, which="both")
    ax.legend(loc="upper right", bbox_to_anchor=(1, 0.92))


def _draw_states(ax: Axes, dataset: xr.Dataset) -> None:
    """What both contacts do over the band, the one with the wall to the right."""
    looks = ("stick", "0.75"), ("slip", "tab:blue"), ("lift off", "tab:orange")
    for mass, row in zip(1e3 * MASSES, dataset.state.values, strict=True):
        frequency = dataset.frequency.sel(damper_mass=mass / 1e3).values
        for side, states in enumerate(row.T):
            at = mass * (1 + 0.05 * (side - 0.5))
            for i in np.flatnonzero(np.isfinite(frequency[1:])):
                color = looks[int(max(states[i : i + 2]))][1]
                ax.plot([at, at], frequency[i : i + 2], color=color, linewidth=4)
    for label, color in looks[:2]:
        ax.plot([], [], color=color, linewidth=4, label=label)
    peaks, lifts = dataset.peak_frequency, dataset.open_fraction.values[:, OF_BLADE] > 0
    ax.plot(1e3 * MASSES[~lifts], peaks[~lifts], "ko", markersize=4, label="peak")
    look = dict(color=looks[2][1], markeredgecolor="black", markersize=7)
    label = "peak, lifts off from the blade"
    ax.plot(1e3 * MASSES[lifts], peaks[lifts], "D", label=label, **look)  # type: ignore
    ax.set_xscale("log")
    ticks = 1.5, 2, 3, 5, 10, 15
    ax.set_xticks(ticks, [str(tick) for tick in ticks])
    ax.minorticks_off()
    ax.set_ylim(BAND)
    ax.set(xlabel="mass of the damper [g]", ylabel="excitation\nfrequency [Hz]")
    title = "what contacts do: left with the blade, right with the wall"
    ax.set_title(title, fontsize=10)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.3), ncols=4)


def _draw_responses(ax: Axes, dataset: xr.Dataset) -> None:
    shades = plt.get_cmap("viridis")(np.linspace(0, 0.88, len(SHOWN)))
    styles = sh.plot.LINE_STYLES[: len(SHOWN)]
    for mass, color, style in zip(MASSES[list(SHOWN)], shades, styles, strict=True):
        row = dataset.sel(damper_mass=mass)
        look: Any = dict(color=color, linestyle=style, label=f"{1e3 * mass:.1f} g")
        ax.semilogy(row.frequency, 1e3 * row.amplitude, **look)
    ax.set(xlabel="excitation frequency [Hz]", ylabel="largest displacement of the blade [mm]")
    ax.set_xlim(BAND)
    ax.legend(loc="upper right", title="damper", handlelength=3.2)


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Contact loads by equilibrium, peaks of sliders, the best mass, and who lifts off."""
    expected = np.array([load(mass) for mass in MASSES])[:, None]
    error = np.abs(dataset.unrubbed_normal_force.values / expected - 1).max()
    rows = [
        Landmark(
            "normal load without friction, largest difference over all masses",
            float(error),
            0.0,
            "",
            Source.CLOSED_FORM,
            ROUND_OFF,
        )
    ]
    closed = ~(dataset.contact_state == 2).any("side").values
    lightest = int(np.flatnonzero(closed)[0])
    steepness = FRICTION * np.tan(ANGLE)
    mean = load(MASSES[lightest]) / (1 - steepness**2)
    for side in dataset.side.values:
        found = float(dataset.mean_normal_force.sel(side=side)[lightest])
        name = f"mean normal force on the {side}, lightest damper that does not lift off"
        rows.append(Landmark(name, found, mean, "N", Source.CLOSED_FORM, SLIDING))
    name = "peak, lightest damper that does not lift off"
    found, sliding = (
        float(dataset[one][lightest]) for one in ("peak_amplitude", "slider_amplitude")
    )
    rows.append(Landmark(name, found, sliding, "m", Source.CLOSED_FORM, SLIDING))
    mass, amplitude = best()
    for name, found, value, unit in (
        ("best mass", float(dataset.best_mass), mass, "kg"),
        ("lowest peak", float(dataset.best_amplitude), amplitude, "m"),
    ):
        rows.append(Landmark(name, found, value, unit, Source.CLOSED_FORM, LIGHT))
    exact = float(dataset.exact_amplitude)
    name = "lowest peak, against the exact motion at its frequency"
    rows.append(Landmark(name, float(dataset.best_amplitude), exact, "m", Source.EXACT, TRUNCATION))
    name = "displacement at which the lightest damper begins to lift off from the blade"
    found, value = float(dataset.lift_amplitude[0]), lifting(float(dataset.peak_frequency[0]))
    rows.append(Landmark(name, found, value, "m", Source.CLOSED_FORM, LIGHT))
    opens = dataset.contact_state.values[0] == 2
    name = "sides from which the lightest damper lifts off"
    return [*rows, Landmark(name, float(opens.sum()), 1.0, "", Source.EXACT, 0.0)]


if __name__ == "__main__":
    run(NAME, compute, draw)
