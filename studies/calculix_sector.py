"""A bladed sector of CalculiX: from its files to the damped, shrouded and mistuned disk.

gmsh meshes a sector of quadratic bricks with a platform and a shroud, `studies.calculix_mesh`.
CalculiX writes its matrices at rest and at a speed, the modes of the disk by nodal diameter, and
the pressures of the shroud from a static analysis with contact, `studies.calculix_decks`.
`read_structure` makes one structure of them, whose frequencies stand beside those of CalculiX.

Friction acts in the shroud, under the loads that the static analysis tells, and under the
platforms, where a wedge is pressed against both neighbours by ``m r Omega^2 / (4 cos(angle))`` at
each of its ends. A face of the shroud has four contacts, each for the nodes that are nearest to it.
The heavier wedge stiffens, the lighter one slides; in between a mass is best. Blades of the disk
with wedges, whose stiffness deviates, then share the energy of the wave no longer alike.

The sector of `data/calculix/hex20` is read where it lies. ``python -m studies.calculix_sector``
meshes one of 20,000 degrees of freedom and runs CalculiX.
"""

import re
import warnings
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import symhbm as sh
from studies import calculix_decks
from studies.calculix_mesh import RADII, sector_mesh
from studies.landmark import Landmark, Source
from studies.run import DATA, run
from symhbm.numerics import FloatArray

NAME = "calculix_sector"
SMALL = DATA / "calculix" / "hex20"
"""Files of 462 degrees of freedom."""
FINE = dict(disk=9, neck=2, platform=2, blade=14, shroud=3, width=4, side=4, height=5)
"""Elements of some 20,000 degrees of freedom."""
SECTORS = {"small": 12, "fine": 24}
SPEED = calculix_decks.OPERATING
ORDER = 5
SHARE = 4e-7
"""Damping matrix over the stiffness matrix [s]."""
FORCE = 20.0
"""Along the circumference, at the tip of each blade [N]."""
FRICTION = 0.3
STIFFNESS = 2e12
"""Of contacts over their area [N/m^3], and of a wedge as if it touched on `TOUCHING` [m^2]."""
TOUCHING = 1e-5
ANGLE = np.radians(40)
MASSES = np.array([1e-3, 4e-3, 1.6e-2, 6.4e-2, 0.256])
"""Of wedges [kg]."""
SPEEDS = 0.0, 4000.0, 8000.0
SHARES = 1.0, 1e-2
HARMONICS = (0, 1, 3)
MODES, INTERFACE_MODES = 6, 12
N_SAMPLES, SCATTER, SEED = 2, 0.02, 1
PRINTED, REDUCED = 1e-6, 0.1
"""Of frequencies, the digits that are printed; of a peak, the few modes of the reduced disk."""


class Case(NamedTuple):
    """A ``disk`` at rest and at speeds, its ``pressure`` by node, and frequencies of CalculiX."""

    disk: sh.Sector
    pressure: dict[int, float]
    modes: dict[int, FloatArray]

    @property
    def tip(self) -> str:
        """The place that is driven and watched."""
        return f"{int(self.disk.structure.places.mesh.sets['TIP'][0])}:y"


def case(folder: Path = SMALL, n_sectors: int = SECTORS["small"]) -> Case:
    """The disk of the files of a folder."""
    jobs = [folder / f"{job}.inp" for job in ("matrices", "spinning_matrices", "modes")]
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "(?s).*supports")  # the bore, as it should be
        structure = sh.read_structure(jobs, damping=sh.RayleighDamping(0.0, SHARE))
        disk = sh.Sector(structure, "left", "right", n_sectors, rotation="z")
    found = re.findall(
        r"^ +(\d+) +\d+ +\S+ +\S+ +(\S+E\S+) +\S+$", (folder / "modes.dat").read_text(), re.M
    )
    modes: dict[int, list[float]] = {}
    for diameter, frequency in found:
        modes.setdefault(int(diameter), []).append(float(frequency))
    each = {diameter: np.array(values[::2]) for diameter, values in modes.items()}
    return Case(disk, pressures(folder / "contact_static.frd"), each)


def pressures(path: Path) -> dict[int, float]:
    """Pressure of contacts [Pa] by node, of the last increment of a file ``.frd``."""
    blocks = re.findall(r"^ -4  CONTACT .*\n(?: -5.*\n)*((?: -1.*\n)+)", path.read_text(), re.M)
    lines = blocks[-1].splitlines()
    return {int(line[3:13]): float(line[49:61]) for line in lines}


def shroud(known: Case) -> sh.Friction:
    """Four contacts of the shroud, with the loads of the static analysis."""
    pairs = sh.contact_pairs(known.disk.structure, "S_SHROUD_ARM", "S_SHROUD_STUB", tolerance=2e-4)
    load = pairs.area * [known.pressure[node] for node in pairs.nodes[:, 0].tolist()]
    where = pairs.coordinates - pairs.coordinates.mean(axis=0)
    plane = np.einsum("nj,nij->ni", where, pairs.axes)[:, :2]
    quarter = 2 * (plane[:, 0] > 0) + (plane[:, 1] > 0)
    chosen = [np.flatnonzero(quarter == k)[np.argmax(_far(plane[quarter == k]))] for k in range(4)]
    nearest = np.linalg.norm(where[:, None] - where[chosen], axis=2).argmin(axis=1)
    area, load = (np.bincount(nearest, each, minlength=4) for each in (pairs.area, load))
    return sh.Friction(
        tangential=[pairs.tangential[k] for k in chosen],
        across=[pairs.across[k] for k in chosen],
        normal=[pairs.normal[k] for k in chosen],
        contact_stiffness=STIFFNESS * area,
        normal_stiffness=STIFFNESS * area,
        friction_coefficient=FRICTION,
        normal_load=load,
    )


def _far(plane: FloatArray) -> FloatArray:
    return np.abs(plane).prod(axis=1)


def wedge(known: Case) -> sh.Friction:
    """The two contacts of a wedge of 1 kg under the platforms of neighbours."""
    places = known.disk.structure.places
    mesh, ends = places.mesh, []
    for name in ("PLATFORM_RIGHT", "PLATFORM_LEFT"):
        nodes = mesh.sets[name]
        x, y, z = mesh.points(nodes).T
        far = np.abs(np.arctan2(y, x)) > np.abs(np.arctan2(y, x)).max() - 1e-6
        ends.append([int(nodes[far][np.argmin(z[far])]), int(nodes[far][np.argmax(z[far])])])
    at = zip(*ends, strict=True)
    pairs = [
        [(f"{one}:{way}", sh.next_sector(f"{other}:{way}")) for way in "xz"] for one, other in at
    ]
    return sh.Friction(
        tangential=[pair[0] for pair in pairs],
        across=[pair[1] for pair in pairs],
        contact_stiffness=STIFFNESS * TOUCHING,
        friction_coefficient=FRICTION,
        normal_load=pressing(1.0),
    )


def pressing(mass: float) -> float:
    """Load [N] of each contact of a wedge of a mass [kg]."""
    return mass * RADII[2] * (2 * np.pi * SPEED / 60) ** 2 / (4 * np.cos(ANGLE))


def condensed(
    known: Case, contacts: dict[str, Any], band: tuple[float, float]
) -> sh.HarmonicBalance:
    """The disk at `SPEED` with some contacts, condensed exactly to them and the tip."""
    disk = known.disk.at(SPEED).with_contacts(**contacts)
    force = sh.forces.EngineOrder(ORDER, pattern={known.tip: FORCE})
    small = sh.condense(disk, force, band, HARMONICS, places=[known.tip], progress=False)
    return sh.HarmonicBalance(small, force, HARMONICS)


def around(known: Case, contacts: dict[str, Any]) -> tuple[float, float]:
    """A band [Hz] from below the lowest mode with open contacts to above that with stuck ones."""
    disk = known.disk.at(SPEED).with_contacts(**contacts)
    ends = [
        sh.natural_modes(disk, ORDER, count=1, stuck=stuck).frequency.item()
        for stuck in (False, True)
    ]
    return 0.97 * ends[0], 1.03 * ends[1]


def mistuned(known: Case, band: tuple[float, float], load: float) -> tuple[float, FloatArray]:
    """Peak [m] of the tuned disk with wedges, reduced, and peaks of mistuned ones over it."""
    disk = known.disk.at(SPEED).with_contacts(wedge=wedge(known))
    radius = np.hypot(*known.disk.structure.places.coordinates.T[:2])
    blade = np.flatnonzero(radius > RADII[3] + 1e-6)
    reduced = sh.craig_bampton(
        disk, MODES, band, interface_modes=INTERFACE_MODES, places=[known.tip], blade=blade
    )
    force = sh.forces.EngineOrder(ORDER, pattern={known.tip: FORCE})
    problem = sh.HarmonicBalance(sh.mistuned_ring(reduced), force)
    ring = problem.with_parameters(normal_load=load)
    options: dict[str, Any] = dict(progress=False, throw=True)
    draws = sh.mistuning.truncated_normal(ring, N_SAMPLES, seed=SEED, stiffness_deviation=SCATTER)
    tuned = sh.frf(ring, band, **options)
    factors = sh.statistics.amplification(sh.frf(ring, band, over=draws, **options), tuned)
    return float(tuned.peak_amplitude.max()), factors.largest_amplification_of_peaks.values


def compute(progress: bool = True, known: Case | None = None) -> xr.Dataset:
    """Frequencies beside those of CalculiX, critical speeds, responses, and mistuned disks."""
    known = case() if known is None else known
    options: dict[str, Any] = dict(progress=False, throw=True)
    wedges, shrouds = {"wedge": wedge(known)}, {"shroud": shroud(known)}
    lines = sh.campbell(known.disk, SPEEDS, orders=[ORDER], nodal_diameter=ORDER, count=2)
    at_rest = known.disk.at(0)
    found = [
        sh.natural_modes(at_rest, nodal_diameter=n, count=len(own)).frequency.values
        for n, own in known.modes.items()
    ]
    band = around(known, wedges)
    problem = condensed(known, wedges, band)
    loads = [pressing(mass) for mass in MASSES]
    by_mass = [sh.frf(problem.with_parameters(normal_load=n), band, **options) for n in loads]
    start = problem.with_parameters(normal_load=loads[1])
    ends = loads[0], loads[-1]
    design = sh.minimise_peak(start, "normal_load", ends, band, progress=False)
    best = float(design.design_value[0])
    tied = around(known, shrouds)
    shrouded = condensed(known, shrouds, tied)
    whole = np.array(shrouded.parameters["normal_load"])
    by_share = [
        sh.frf(shrouded.with_parameters(normal_load=share * whole), tied, **options)
        for share in SHARES
    ]
    tuned, factors = mistuned(known, band, best)
    described: dict[str, tuple] = {
        "own_frequency": (("wave", "mode"), [*known.modes.values()], "Hz", "by CalculiX"),
        "frequency": (("wave", "mode"), found, "Hz", "natural frequency at rest"),
        "line": (("speed", "mode"), lines.frequency.values[:, 0], "Hz", "over the speed"),
        "static_load": ("contact", whole, "N", "of contacts of the shroud, by CalculiX"),
        "best_mass": ((), best / pressing(1.0), "kg", "mass of the lowest peak"),
        "best_amplitude": ((), float(design.design_amplitude), "m", "lowest peak"),
        "tuned_amplitude": ((), tuned, "m", "peak of the tuned disk, reduced"),
        "amplification": ("sample", factors, "1", "largest response over the tuned one"),
    }
    variables = {
        name: (dims, values, {"units": units, "long_name": words})
        for name, (dims, values, units, words) in described.items()
    }
    coordinates: dict[str, Any] = {
        "wave": [*known.modes],
        "speed": ("speed", lines.speed.values, {"units": "1/min"}),
        "mass": ("mass", MASSES, {"units": "kg"}),
        "share": ("share", [*SHARES], {"units": "1", "long_name": "of the static loads"}),
    }
    variables |= _curves("wedge", "mass", by_mass, known.tip)
    variables |= _curves("shroud", "share", by_share, known.tip)
    attributes = {
        "title": "A bladed sector of CalculiX, with wedges and with shrouds",
        "n_dof": known.disk.n_whole,
        "symhbm_schema": 1,
        "symhbm_version": version("symhbm"),
    }
    return xr.Dataset(variables, coordinates, attributes)


def _curves(name: str, over: str, responses: list[xr.Dataset], tip: str) -> dict[str, Any]:
    """Responses of the tip, with NaN beyond the end of each, and their highest peaks."""
    lines = [np.array(sh.plot.curve(one, place=tip)) for one in responses]
    values = np.full((2, len(responses), max(line.shape[1] for line in lines)), np.nan)
    for row, line in enumerate(lines):
        values[:, row, : line.shape[1]] = line
    dims = over, f"{name}_point"
    highest = [float(one.peak_amplitude.max()) for one in responses]
    words = "largest displacement of the tip along the circumference"
    return {
        f"{name}_frequency": (dims, values[0], {"units": "Hz", "long_name": "excited"}),
        f"{name}_amplitude": (dims, values[1], {"units": "m", "long_name": words}),
        f"{name}_peak": (over, highest, {"units": "m", "long_name": "highest peak"}),
    }


def draw(dataset: xr.Dataset) -> Figure:
    """Draw frequencies over the speed, and responses with wedges and with shrouds."""
    with sh.plot.panels(1, 3, size=(15.0, 4.8)) as (figure, (speeds, wedges, shrouds)):
        speeds.plot(dataset.speed, dataset.line, "o-")
        speeds.plot(dataset.speed, ORDER * dataset.speed / 60, "k--", label=f"order {ORDER}")
        speeds.set(xlabel="speed [1/min]", ylabel="frequency [Hz]")
        speeds.set_ylim(bottom=0.8 * float(dataset.line.min()))
        speeds.set_title(f"waves of {ORDER} nodal diameters")
        speeds.legend()
        for ax, name, over in ((wedges, "wedge", "mass"), (shrouds, "shroud", "share")):
            for value in dataset[over].values:
                row = dataset.sel({over: value})
                label = f"{1e3 * value:g} g" if over == "mass" else f"{value:g}"
                ax.semilogy(row[f"{name}_frequency"], 1e3 * row[f"{name}_amplitude"], label=label)
            ax.set(xlabel="excitation frequency [Hz]", ylabel="displacement of the tip [mm]")
            ax.legend(title="mass of a wedge" if over == "mass" else "share of static loads")
        wedges.axhline(1e3 * float(dataset.best_amplitude), color="0.5", linestyle=":")
        best = 1e3 * float(dataset.best_mass)
        wedges.set_title(f"wedges under the platforms, best with {best:.0f} g")
        shrouds.set_title("shrouds")
        figure.suptitle(
            f"A sector of {dataset.attrs['n_dof']:,} degrees of freedom by CalculiX, "
            f"engine order {ORDER}, {FORCE:g} N a blade"
        )
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Frequencies against those of CalculiX, and the reduced tuned disk against the design."""
    off = float(np.abs(dataset.frequency / dataset.own_frequency - 1).max())
    name = "largest difference of a natural frequency from that of CalculiX, relative"
    rows = [Landmark(name, off, 0.0, "", Source.CALCULIX, PRINTED)]
    name = "peak of the tuned disk, reduced, over that of all equations"
    ratio = float(dataset.tuned_amplitude / dataset.best_amplitude)
    return [*rows, Landmark(name, ratio, 1.0, "", Source.EXACT, REDUCED)]


def written(path: Path, known: Case, problem: sh.HarmonicBalance, point: xr.Dataset) -> Path:
    """A motion of the first harmonic and the states of contacts on the mesh, as ``.vtu``.

    ``real`` and ``imaginary`` are displacements [m] at a maximum of the force and a quarter of a
    period before it; ``state`` is that of the contact at a node, NaN without one.
    """
    import meshio

    places = known.disk.structure.places
    mesh = places.mesh
    motion = sh.datasets.recover(problem, point).coefficient.sel(harmonic=1).values
    fields = {name: np.zeros((len(mesh.node), 3)) for name in ("real", "imaginary")}
    at, way = mesh.at(places.node), np.searchsorted(["x", "y", "z"], places.direction)
    fields["real"][at, way], fields["imaginary"][at, way] = motion[:, 0], -motion[:, 1]
    state = np.full(len(mesh.node), np.nan)
    where = np.column_stack([point[f"contact_{axis}"].values for axis in "xyz"])
    for place, value in zip(where, point.contact_state.values, strict=True):
        state[np.linalg.norm(mesh.coordinates - place, axis=1).argmin()] = value
    cells = {kind: mesh.at(nodes) for kind, nodes in mesh.elements.items()}
    meshio.Mesh(mesh.coordinates, cells, point_data={**fields, "state": state}).write(path)
    return path


def fine(folder: Path) -> Case:
    """The disk of a sector of some 20,000 degrees of freedom, by gmsh and CalculiX."""
    mesh = sector_mesh(True, FINE, SECTORS["fine"], calculix_decks.OVERCLOSURE)
    calculix_decks.sector(folder, mesh)
    return case(folder, SECTORS["fine"])


def main() -> None:
    """Run the study with a fine mesh, in a folder that is removed."""
    with TemporaryDirectory() as folder:
        known = fine(Path(folder))
    run(f"{NAME}_fine", lambda: compute(known=known), draw)


if __name__ == "__main__":
    main()
