"""Peak over damper mass: fronts of one blade, of the disk of the paper, and of a disk by elements.

A damper under the platforms is pressed by the rotation, so that its mass is its load over the
radius and the square of the speed. A heavier one damps better, up to a best mass: a front tells
what each gram is worth. Its ends are the best mass, and the smallest one allowed.

On one blade, and with one harmonic on the tuned disk, all of the front is a closed form. The disk
of 24 sectors by finite elements is that of `studies.open_sector_contacts`, with planar friction at
both ends of the dampers.
"""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import open_sector_contacts as sector
from studies.closed_form import OneBlade
from studies.landmark import Landmark, Source
from studies.open_sector import COARSE
from studies.run import run

NAME = "pareto_damper_mass"
RADIUS, SPEED = 0.3, 2 * np.pi * 10  # m, rad/s
ORDER, N_BLADES = 3, 13
RING_STIFFNESS, FRICTION = 1e6, 0.5  # N/m, 1
BLADE_LOADS, RING_LOADS = (0.5, 20.0), (0.3, 20.0)  # N
RING_BAND = (5.0, 350.0)
SECTOR_MASSES = (1e-3, 2e-2)  # kg
N_POINTS, N_SECTOR = 9, 5
"""Points of the fronts; each of the disk by elements takes some seconds."""
BESIDE = (0.9, 1.1)
"""Masses of the disk by elements over the best one, whose peaks are computed, too."""
EXACT = 1e-9
TICKS = (0.2, 0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0)
ORDER_OF_LOWEST = "of the peaks at 0.9, 1 and 1.1 of the best mass of the disk by elements"


def mass_of(load: Any) -> Any:
    """Mass [kg] of a damper that presses with a load [N]."""
    return load / (RADIUS * SPEED**2)


def ring() -> sh.HarmonicBalance:
    """The disk of the paper, one harmonic."""
    disk = sh.bladed_disk(
        N_BLADES,
        mass=1,
        stiffness=1e4,
        damping=0.5,
        contact_stiffness=RING_STIFFNESS,
        friction_coefficient=FRICTION,
        normal_load=10,
    )
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(ORDER, amplitude=1.0))


def front(
    problem: sh.HarmonicBalance, parameter: str, bounds: Any, band: Any, of_mass: Any, n: int
) -> xr.Dataset:
    """The front of peak and mass; ``of_mass`` is the mass of a value of the parameter."""
    return sh.pareto_front(
        problem,
        parameter,
        bounds,
        band,
        aims={
            "largest response [m]": lambda peaks, parameters: peaks["largest"],
            "mass of a damper [kg]": lambda peaks, parameters: of_mass(parameters[parameter][0]),
        },
        n_points=n,
        throw=True,
        progress=False,
    )


def compute(
    progress: bool = True, n_points: int = N_POINTS, n_sector: int = N_SECTOR, grid: Any = COARSE
) -> xr.Dataset:
    """Compute the three fronts; without points of the last, ``n_sector`` 0, the first two."""
    blade = front(fig03.problem(), "normal_load", BLADE_LOADS, fig03.BAND, mass_of, n_points)
    disk = front(ring(), "normal_load", RING_LOADS, RING_BAND, mass_of, n_points)
    found = {"ring": disk}
    beside = np.full(3, np.nan)
    if n_sector:
        condensed = sector.damper(grid)
        bounds = tuple(sector.pressing(mass) for mass in SECTOR_MASSES)
        found["sector"] = front(
            condensed.problem,
            "centrifugal_load",
            bounds,
            condensed.band,
            lambda load: load / sector.pressing(1.0),
            n_sector,
        )
        peak, mass = found["sector"].front_aim.values[0]
        others = [
            sh.frf(
                sector.with_mass(condensed.problem, mass * share), condensed.band, progress=False
            )
            for share in BESIDE
        ]
        low, high = (float(one.peak_amplitude.max()) for one in others)
        beside = np.array([low, peak, high])
    added: dict[str, tuple] = {}
    for name, one in found.items():
        row = f"{name}_front"
        added[f"{name}_peak"] = (row, one.front_aim.values[:, 0], "m", "largest response")
        added[f"{name}_mass"] = (row, one.front_aim.values[:, 1], "kg", "mass of a damper")
        added[f"{name}_certificate"] = ((), one.certificate.item(), "1", "what was checked")
    added["sector_beside"] = ("beside", beside, "m", ORDER_OF_LOWEST)
    return blade.assign(
        {
            name: (dims, values, {"units": units, "long_name": long_name})
            for name, (dims, values, units, long_name) in added.items()
        }
    )


def closed(name: str, load: float) -> OneBlade:
    """The blade, or one of the disk, under a load [N]."""
    ratio = 1.0 if name == "blade" else 2 * np.sin(np.pi * ORDER / N_BLADES)
    stiffness = 1e4 if name == "blade" else RING_STIFFNESS
    return OneBlade(1.0, 0.5, 1e4, stiffness, FRICTION * load, 1.0, ratio)


def fronts(dataset: xr.Dataset) -> dict[str, np.ndarray]:
    """Peak and mass (n, 2) of each front."""
    result = {"blade": dataset.front_aim.values}
    for name in ("ring", "sector"):
        if f"{name}_peak" in dataset:
            both = dataset[f"{name}_peak"].values, dataset[f"{name}_mass"].values
            result[name] = np.column_stack(both)
    return result


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the fronts, two of them on their closed forms."""
    titles = {
        "blade": "one blade, damper to the ground",
        "ring": f"disk of the paper, engine order {ORDER}",
        "sector": "24 sectors by finite elements",
    }
    found = fronts(dataset)
    size = 4.4 * len(found), 4.2
    with sh.plot.panels(1, len(found), size=size, squeeze=False) as (figure, axes):
        for ax, (name, points) in zip(axes[0], found.items(), strict=True):
            _draw_front(ax, name, points)
            least, best = 1e3 * points[-1, 1], 1e3 * points[0, 1]
            ends = f"{least:.3g} g the least, {best:.3g} g the best"
            ax.set_title(f"{titles[name]}\n{ends}", fontsize=10)
        axes[0, 0].set_ylabel("largest response [dB re 1 m]")
        figure.suptitle("What a gram of damper is worth: no other mass is better in both")
    return figure


def _draw_front(ax: Axes, name: str, points: np.ndarray) -> None:
    peaks, grams = 20 * np.log10(points[:, 0]), 1e3 * points[:, 1]
    if name != "sector":
        masses = np.geomspace(points[-1, 1], 3 * points[0, 1], 200)
        loads = masses / mass_of(1.0)
        level = [20 * np.log10(closed(name, load).peak()[0]) for load in loads]
        ax.plot(1e3 * masses, level, color="0.7", linewidth=2.4, label="closed form")
    else:
        ax.plot(grams, peaks, color="0.7", linewidth=1.0)
    ax.plot(grams[1:-1], peaks[1:-1], "ko", markersize=5, label="on the front")
    ax.plot(grams[[0, -1]], peaks[[0, -1]], "s", color="tab:red", markersize=7, label="its ends")
    ax.set(xscale="log", xlabel="mass of a damper [g]")
    low, high = ax.get_xlim()
    ticks = [tick for tick in TICKS if low <= tick <= high]
    ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.minorticks_off()
    ax.legend(loc="upper right")


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Ends and all points of two fronts by their closed forms; the best mass of the third."""
    marks = []
    for name, points in fronts(dataset).items():
        if name == "sector":
            lowest = float(np.argmin(dataset.sector_beside.values))
            mark = f"number of the lowest {ORDER_OF_LOWEST}"
            marks.append(Landmark(mark, lowest, 1.0, "", Source.EXACT, 0.0))
            continue
        limit, amplitude, _ = closed(name, 1.0).optimum()
        title = "one blade" if name == "blade" else "disk of the paper"
        expected = mass_of(limit / FRICTION)
        ends = ((points[0, 1], expected, "kg", "best mass"), (points[0, 0], amplitude, "m", "peak"))
        for value, exact, unit, what in ends:
            text = f"{title}: {what} at the end of the front"
            closed_form = Source.CLOSED_FORM
            marks.append(Landmark(text, float(value), exact, unit, closed_form, 100 * EXACT))
        on_curve = [closed(name, mass / mass_of(1.0)).peak()[0] for mass in points[:, 1]]
        largest = float(np.abs(points[:, 0] / on_curve - 1).max())
        text = f"{title}: largest difference of a point from the curve"
        marks.append(Landmark(text, largest, 0.0, "", Source.CLOSED_FORM, EXACT))
    return marks


if __name__ == "__main__":
    run(NAME, compute, draw)
