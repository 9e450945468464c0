"""A disk of 24 sectors by finite elements, damped under its platforms, or tied by its shrouds.

The sector is that of `studies.open_sector` with twisted blades; its matrices, 1,200 degrees of
freedom, are those at one speed. Engine order 18 drives waves of 6 nodal diameters that run against
the rotation. What is linear is condensed exactly to the contacts and the tip.

A damper under the platforms of neighbouring blades is a wedge that the rotation presses against
both, with `m r Omega^2 / (4 cos(angle))` at each of its two ends, where friction is planar, along
radius and axis. Its own inertia is left out. A light damper slides and hardly takes energy, a heavy
one sticks and is a spring; in between a mass is best.

Shrouds are rigid arms from the tip of each blade to the face of the next, at 45 degrees to
the circumference. Their load varies with the motion, up to lift-off. Under a small preload they
open where the disk resonates, and the peak is high and far below the frequency with shrouds that
stick; under a large one they stick, which raises the frequency by two thirds. In between they slip;
around 100 N both motions exist at the same frequencies.

Reference: J. H. Griffin, Friction damping of resonant stresses in gas turbine engine airfoils, J.
Eng. Power 102 (1980), 329-333.
"""

from importlib.metadata import version
from itertools import cycle
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import minimize_scalar

import symhbm as sh
from studies.landmark import Landmark, Source
from studies.open_sector import COARSE, RADII, THICKNESS, open_sector
from studies.open_sector_modes import TWIST
from studies.run import run
from studies.smooth import with_states
from symhbm.numerics import FloatArray

NAME = "open_sector_contacts"
ORDER = 18
WAVE = 6
"""Nodal diameters that it drives, of the other sense."""
DAMPING = 1e-7
"""Damping matrix over the stiffness matrix [s]: a ratio of 0.6 per mille at 2 kHz."""
FORCE = 10.0
"""Tangential force on the tip of each blade [N]."""
FRICTION, CONTACT_STIFFNESS = 0.3, 2e7  # 1, N/m
PLATFORM = 0.22
"""Radius of the platforms [m]."""
ANGLE = np.radians(40)
"""Between the normals of a damper and the radius."""
DAMPER_BAND, SHROUD_BAND = (1850.0, 2050.0), (2600.0, 3400.0)
DAMPER_SPEED, SHROUD_SPEED = 6470.0, 9800.0  # 1/min: the matrices are those there
MASSES = np.geomspace(1e-3, 0.3, 9)  # kg
SEARCHED = (3e-3, 3e-2)  # kg
PRELOADS = (30.0, 45.0, 80.0, 160.0, 1000.0)  # N
DAMPER_HARMONICS, SHROUD_HARMONICS = (1, 3), (0, 1, 2, 3)
RECOVERED = 1e-9
"""Residual of all equations at the best mass."""
STUCK = 1e-4
"""Of a frequency, what damping and other modes move a peak off the natural one."""


class Condensed(NamedTuple):
    """A ``problem`` of the condensed ``disk`` in a ``band``, and the number of the tip in it.

    ``watched`` are the names of the tip and of other places.
    """

    problem: sh.HarmonicBalance
    disk: sh.Sector
    band: tuple[float, float]
    tip: int
    watched: tuple[str, ...]


def damper(grid: tuple[int, int, int, int] = COARSE, also: tuple[float, ...] = ()) -> Condensed:
    """The disk with dampers of 1 kg; the blade is watched at some radii [m], too."""
    at = np.arcsin(RADII[1] * np.tan(np.pi / 72) / PLATFORM)

    def platforms(sector: Any, way: str) -> list[tuple]:
        ends = (0.0, THICKNESS)
        pairs = [[sector.near(PLATFORM, side * at, z) for side in (1, -1)] for z in ends]
        return [(f"{one}:{way}", sh.next_sector(f"{other}:{way}")) for one, other in pairs]

    def contacts(sector: Any) -> sh.Friction:
        return sh.Friction(
            tangential=platforms(sector, "x"),
            across=platforms(sector, "z"),
            contact_stiffness=CONTACT_STIFFNESS,
            friction_coefficient=FRICTION,
            normal_load=0.0,
            centrifugal_load=pressing(1.0),
            engine_order=ORDER,
        )

    given = {"damper": contacts}, DAMPER_BAND, DAMPER_HARMONICS
    return _condensed(grid, DAMPER_SPEED, *given, also)


def pressing(mass: float) -> float:
    """Load of each contact [kg m] over Omega^2 by a damper of a mass [kg]."""
    return mass * PLATFORM / (4 * np.cos(ANGLE))


def shroud(grid: tuple[int, int, int, int] = COARSE) -> Condensed:
    """The disk with shrouds under the smallest preload."""

    def contacts(sector: Any) -> sh.Friction:
        at = np.arcsin(RADII[1] * np.tan(np.pi / 72) / RADII[2])
        one, other = (sector.near(RADII[2], side * at, THICKNESS / 2) for side in (1, -1))
        slope = np.sqrt(0.5)

        def facing(y: float, z: float) -> dict:
            ends = {f"{one}:y": y, f"{one}:z": z}
            return ends | {sh.next_sector(f"{other}:{way}"): -w for way, w in (("y", y), ("z", z))}

        return sh.Friction(
            tangential=facing(-slope, slope),
            normal=facing(slope, slope),
            contact_stiffness=CONTACT_STIFFNESS,
            normal_stiffness=CONTACT_STIFFNESS,
            friction_coefficient=FRICTION,
            normal_load=PRELOADS[0],
        )

    return _condensed(grid, SHROUD_SPEED, {"shroud": contacts}, SHROUD_BAND, SHROUD_HARMONICS)


def _condensed(
    grid: tuple[int, int, int, int],
    speed: float,
    contacts: dict,
    band: tuple,
    harmonics: tuple,
    also: tuple[float, ...] = (),
) -> Condensed:
    sector = open_sector(grid, twist=TWIST).damped(DAMPING).at(speed)
    disk = sector.disk.with_contacts(**{name: make(sector) for name, make in contacts.items()})
    tip = place_at(sector, RADII[2])
    force = sh.forces.EngineOrder(ORDER, pattern={tip: FORCE})
    watched = [tip, *(place_at(sector, radius) for radius in also)]
    small = sh.condense(disk, force, band, harmonics, places=watched, progress=False)
    at = int(np.flatnonzero(small.dofs == disk.number_of(tip))[0])
    return Condensed(sh.HarmonicBalance(small, force, harmonics), disk, band, at, tuple(watched))


def place_at(sector: Any, radius: float) -> str:
    """The place in the middle of the blade at a radius [m], across it."""
    return f"{sector.near(radius, 0.0, THICKNESS / 2)}:y"


def with_mass(problem: sh.HarmonicBalance, mass: float) -> sh.HarmonicBalance:
    """The problem with dampers of a mass [kg]."""
    return problem.with_parameters(centrifugal_load=pressing(mass))


def highest(response: xr.Dataset) -> tuple[float, float]:
    """Highest located peak [m] of the tip and of what contacts touch, and its frequency [Hz]."""
    at = int(np.nanargmax(response.peak_amplitude.values))
    return float(response.peak_amplitude[at]), float(response.peak_frequency[at])


def compute(progress: bool = True) -> xr.Dataset:
    """Responses and peaks over the mass of dampers and the preload of shrouds, the best mass."""
    options: dict[str, Any] = dict(progress=False, throw=True)
    damped, shrouded = damper(), shroud()
    by_mass = [sh.frf(with_mass(damped.problem, m), DAMPER_BAND, **options) for m in MASSES]

    def level(logarithm: float) -> float:
        problem = with_mass(damped.problem, float(np.exp(logarithm)))
        return float(np.log(highest(sh.frf(problem, DAMPER_BAND, **options))[0]))

    ends = tuple(np.log(SEARCHED))
    lowest: Any = minimize_scalar(level, bounds=ends, method="bounded", options={"xatol": 2e-2})
    best_mass = float(np.exp(lowest.x))
    best_problem = with_mass(damped.problem, best_mass)
    best = sh.frf(best_problem, DAMPER_BAND, **options)
    amplitude, frequency = highest(best)
    point = sh.solve(best_problem, frequency, throw=True)
    by_preload = [
        sh.frf(shrouded.problem.with_parameters(normal_load=p), SHROUD_BAND, **options)
        for p in PRELOADS
    ]
    scalars = {
        "best_mass": (best_mass, "kg", "mass of the lowest peak"),
        "best_amplitude": (amplitude, "m", "lowest peak"),
        "best_frequency": (frequency, "Hz", "its frequency"),
        "recovered_residual": (
            float(sh.datasets.recover(best_problem, point).residual_norm),
            "1",
            "residual of all equations there",
        ),
        "stuck_damper_frequency": (_stuck(damped), "Hz", "natural frequency, dampers stuck"),
        "stuck_shroud_frequency": (_stuck(shrouded), "Hz", "natural frequency, shrouds stuck"),
    }
    variables: dict[str, Any] = {
        name: ((), value, {"units": units, "long_name": long_name})
        for name, (value, units, long_name) in scalars.items()
    }
    variables |= _curves("damper", "mass", [*by_mass, best], damped.tip)
    variables |= _curves("shroud", "preload", by_preload, shrouded.tip)
    coordinates = {
        "mass": ("mass", [*MASSES, best_mass], {"units": "kg", "long_name": "of a damper"}),
        "preload": ("preload", [*PRELOADS], {"units": "N", "long_name": "of a shroud"}),
    }
    attributes = {
        "title": "A disk of 24 sectors with dampers and with shrouds",
        "references": "J. H. Griffin, J. Eng. Power 102 (1980), 329-333",
        "symhbm_schema": 1,
        "symhbm_version": version("symhbm"),
    }
    return xr.Dataset(variables, coordinates, attributes)


def _stuck(condensed: Condensed) -> float:
    """The natural frequency [Hz] in the band with stuck contacts."""
    modes = sh.natural_modes(condensed.disk, WAVE, count=3, stuck=True)
    [inside] = [f for f in modes.frequency.values if condensed.band[0] < f < condensed.band[1]]
    return float(inside)


def _curves(name: str, over: str, responses: list[xr.Dataset], tip: int) -> dict[str, tuple]:
    """Responses as they are drawn, one below the other, with NaN beyond the end of each."""
    columns = []
    for one in responses:
        frequency, amplitude, state = with_states(one, tip, np.minimum)
        columns.append((frequency, amplitude, state.max(axis=-1)))
    longest = max(len(frequency) for frequency, *_ in columns)
    values: FloatArray = np.full((3, len(responses), longest), np.nan)
    for row in range(len(responses)):
        for k, column in enumerate(columns[row]):
            values[k, row, : len(column)] = column
    described = (
        ("frequency", "Hz", "excitation frequency"),
        ("amplitude", "m", "largest displacement of the tip along the circumference"),
        ("state", "1", "0 sticks, 1 slips, 2 opens"),
    )
    result: dict[str, Any] = {
        f"{name}_{what}": ((over, f"{name}_point"), each, {"units": units, "long_name": words})
        for (what, units, words), each in zip(described, values, strict=True)
    }
    about = {"units": "Hz", "long_name": "frequency of the highest peak"}
    result[f"{name}_peak_frequency"] = over, [highest(one)[1] for one in responses], about
    about = {"units": "m", "long_name": "highest peak of the tip and what contacts touch"}
    result[f"{name}_peak_amplitude"] = over, [highest(one)[0] for one in responses], about
    return result


def draw(dataset: xr.Dataset) -> Figure:
    """Draw peaks over the mass of dampers, and responses with dampers and with shrouds."""
    with sh.plot.panels(1, 3, size=(15.0, 4.8)) as (figure, (peaks, dampers, shrouds)):
        _draw_peaks(peaks, dataset)
        _draw_responses(dampers, dataset, "damper", "mass", MASSES[::2], 1e3, "g")
        _draw_responses(shrouds, dataset, "shroud", "preload", np.array(PRELOADS), 1, "N")
        dampers.set_title("dampers")
        shrouds.set_title("shrouds at 45 degrees, wide where they open")
        shrouds.set_ylabel("")
        figure.suptitle(f"24 sectors by finite elements, engine order {ORDER}, {FORCE:g} N a blade")
    return figure


def _draw_peaks(ax: Axes, dataset: xr.Dataset) -> None:
    of_masses = dataset.isel(mass=slice(0, len(MASSES)))
    level = 1e3 * of_masses.damper_peak_amplitude
    ax.loglog(1e3 * MASSES, level, "o", color="tab:blue", label="computed")
    best = 1e3 * float(dataset.best_mass), 1e3 * float(dataset.best_amplitude)
    label = f"lowest: {best[1]:.3f} mm with {best[0]:.1f} g"
    ax.plot(*best, "*", color="tab:red", markersize=13, label=label)
    ax.set(xlabel="mass of a damper [g]", ylabel="highest peak [mm]")
    ticks = 0.1, 0.2, 0.5
    ax.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.set_yticks([], minor=True)
    ax.set_title("dampers under the platforms")
    ax.legend(loc="upper center")


def _draw_responses(
    ax: Axes, dataset: xr.Dataset, name: str, over: str, shown: FloatArray, scale: float, unit: str
) -> None:
    shades = plt.get_cmap("viridis")(np.linspace(0, 0.88, len(shown)))
    for value, color, style in zip(shown, shades, cycle(sh.plot.LINE_STYLES), strict=False):
        row = dataset.sel({over: value})
        frequency, level = row[f"{name}_frequency"], 1e3 * row[f"{name}_amplitude"]
        label = f"{round(scale * value, 1):g} {unit}"
        ax.semilogy(frequency, level, color=color, linestyle=style, label=label)
        wide = np.where(row[f"{name}_state"] == 2, level, np.nan)
        ax.semilogy(frequency, wide, color=color, linewidth=5, alpha=0.3)
    ax.set(xlabel="excitation frequency [Hz]", ylabel="largest displacement of the tip [mm]")
    ax.legend(loc="upper left", title=over, handlelength=3.2)


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """All equations at the best mass, and frequencies with contacts that stick."""
    residual = float(dataset.recovered_residual)
    name = "residual of all equations at the lowest peak"
    rows = [Landmark(name, residual, 0.0, "", Source.EXACT, RECOVERED)]
    for kind, over, row in (("damper", "mass", -2), ("shroud", "preload", -1)):
        found = dataset[f"{kind}_peak_frequency"].isel({over: row})
        expected = dataset[f"stuck_{kind}_frequency"]
        name = f"frequency of the peak with stuck {kind}s"
        rows.append(Landmark(name, float(found), float(expected), "Hz", Source.EXACT, STUCK))
    return rows


if __name__ == "__main__":
    run(NAME, compute, draw)
