"""A disk of 24 sectors by finite elements: modes by nodal diameters, Campbell and SAFE diagrams.

The sector is that of `studies.open_sector`, its matrices by scikit-fem. With straight blades the
disk is its own mirror image: bending of the disk along the axis and bending of the blades along the
circumference do not couple, and their frequencies cross between 4 and 5 nodal diameters. Blades
that are twisted by 30 degrees couple them. Frequencies veer, and with 5 nodal diameters both modes
share both motions.

The rotating disk is stiffened by the stresses of centrifugal loads, those of the tuned disk by
linear elasticity, and softened by spin; Coriolis forces are left out. Squares of frequencies are
then nearly linear in that of the speed. Engine order E meets waves of `E mod 24` nodal diameters
of either sense alone. In the SAFE diagram each bar is a mode from rest to the highest speed, and a
dot is where an engine order meets it on the way.

Reference: J. Wildheim, Excitation of rotationally periodic structures, J. Appl. Mech. 46 (1979),
878-882.
"""

from importlib.metadata import version
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D

import symhbm as sh
from studies.landmark import Landmark, Source
from studies.open_sector import COARSE, OpenSector, open_sector
from studies.run import run
from symhbm.numerics import FloatArray

NAME = "open_sector_modes"
TWIST = np.radians(30)
SPEEDS = (0.0, 6000.0, 12000.0)  # 1/min
ORDERS = tuple(range(10, 21))
COUNT = 2
"""Families of modes that are followed over the speed."""
SHOWN = (5, 0)
"""Nodal diameters and number of the mode that is drawn."""
DEFLECTION = 0.02
"""Largest displacement [m] that is drawn."""
SHARE = "share of motion along the axis in the kinetic energy"
STRAIGHT = {
    0: (904.601, 1706.458),
    1: (894.001, 1876.713),
    2: (967.929, 1932.847),
    3: (1263.404, 1939.198),
    6: (1936.558, 2142.468),
    12: (1932.608, 2494.626),
}
"""The two lowest frequencies [Hz] by nodal diameters with straight blades."""
DIGITS = 1e-6
"""Relative, of the digits of those frequencies."""


def compute(progress: bool = True) -> xr.Dataset:
    """Modes at rest with straight and twisted blades, lines over the speed, and a mode to draw."""
    straight, twisted = open_sector(COARSE), open_sector(COARSE, twist=TWIST)
    lines = sh.campbell(twisted.rotating.disk, SPEEDS, orders=ORDERS, count=COUNT)
    at_rest = sh.natural_modes(twisted.disk, count=COUNT)
    by_stress, by_work = twisted.virials(twisted.static())
    shape = at_rest.mode_shape.sel(nodal_diameter=SHOWN[0]).isel(mode=SHOWN[1]).values
    motion = twisted.corners(shape[:, 0] - 1j * shape[:, 1])
    faces, cut = twisted.faces()
    over = "nodal_diameter", "mode"
    straight_frequency = sh.natural_modes(straight.disk, count=COUNT).frequency.values
    variables = {
        "straight_frequency": (over, straight_frequency, "Hz", "with straight blades, at rest"),
        "axial_share": (over, _axial(twisted, at_rest), "1", SHARE),
        "stress": ("component", by_stress, "kg m2", "integrals of stresses over Omega^2"),
        "work": ("component", by_work, "kg m2", "the same by virtual work"),
        "position": (("way", "node"), twisted.basis.mesh.p, "m", "positions of corners"),
        "motion": (("part", "way", "node"), np.array([motion.real, motion.imag]), "m", "mode"),
        "face": (("face", "corner"), faces, "1", "corners of outer faces"),
        "cut": ("face", cut.astype(int), "1", "1 where the next sector hides it"),
    }
    attributes = {
        "title": "Modes of a disk of 24 sectors by finite elements",
        "references": "J. Wildheim, J. Appl. Mech. 46 (1979), 878-882",
        "symhbm_schema": 1,
        "symhbm_version": version("symhbm"),
    }
    added = {
        name: (dims, values, {"units": units, "long_name": long_name})
        for name, (dims, values, units, long_name) in variables.items()
    }
    return lines.assign(added).assign_attrs(attributes)


def _axial(sector: OpenSector, modes: xr.Dataset) -> FloatArray:
    """Share of displacements along the axis in the kinetic energy of modes."""
    along = sector.structure.places.direction == "z"
    mass = sector.structure.mass_matrix[along][:, along]
    motion = modes.mode_shape.values[:, :, along]
    # Modes have unit mass.
    return np.einsum("nmic,ij,nmjc->nm", motion, mass.toarray(), motion, optimize=True)


def draw(dataset: xr.Dataset) -> Figure:
    """Draw frequencies by nodal diameters, both diagrams, and a mode of a sector and disk."""
    with sh.plot.panels(0, size=(16.0, 10.5)) as (figure, _):
        parts: Any = figure.subfigures(2, 1)
        above, below = parts
        left, middle, right = above.subplots(1, 3)
        _draw_frequencies(left, dataset)
        sh.plot.campbell(dataset, ax=middle)
        middle.set_title("Campbell diagram", pad=28)
        sh.plot.interference(dataset, ax=right)
        right.set_title("SAFE diagram", pad=28)
        sector = below.add_subplot(1, 2, 1, projection="3d")
        disk = below.add_subplot(1, 2, 2, projection="3d")
        n, mode = SHOWN
        hertz = float(dataset.frequency.isel(speed=0).sel(nodal_diameter=n).isel(mode=mode))
        _draw_faces(sector, dataset, 1)
        sector.set_title(f"a sector, {n} nodal diameters, {hertz:.0f} Hz")
        _draw_faces(disk, dataset, 24)
        disk.set_title("the disk")
    return figure


def _draw_frequencies(ax: Axes, dataset: xr.Dataset) -> None:
    n = dataset.nodal_diameter.values
    dots: Any = None
    for mode in range(COUNT):
        label = "straight blades" if mode == 0 else None
        straight = dataset.straight_frequency.isel(mode=mode)
        ax.plot(n, straight, "o", color="0.5", mfc="none", ms=9, label=label)
        frequency = dataset.frequency.isel(speed=0, mode=mode)
        share = dataset.axial_share.isel(mode=mode)
        dots = ax.scatter(n, frequency, c=share, vmin=0, vmax=1, s=28, cmap="coolwarm", zorder=3)
    ax.figure.colorbar(dots, ax=ax, label="twisted blades: axial share of motion", shrink=0.8)
    ax.set(xlabel="nodal diameters", ylabel="natural frequency [Hz]", ylim=(0, 2800))
    ax.set_xticks(range(0, 13, 2))
    ax.set_title("at rest", pad=28)
    ax.legend(loc="lower right")


def _draw_faces(ax: Axes3D, dataset: xr.Dataset, n_sectors: int) -> None:
    """Faces of the first sectors, moved, with colours by the displacement."""
    position, face = dataset.position.values, dataset.face.values
    face = face if n_sectors == 1 else face[dataset.cut.values == 0]
    motion = dataset.motion.values[0] + 1j * dataset.motion.values[1]
    largest = np.linalg.norm(np.abs(motion), axis=0).max()
    faces, sizes = [], []
    for j in range(n_sectors):
        angle = 2 * np.pi * j / 24
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        moved = (motion * np.exp(-1j * SHOWN[0] * angle)).real / largest
        faces.append((turn @ (position + DEFLECTION * moved)).T[face])
        sizes.append(np.linalg.norm(moved, axis=0)[face].mean(axis=1))
    corners, size = np.concatenate(faces), np.concatenate(sizes)
    colors = plt.get_cmap("viridis")(size / size.max())
    ax.add_collection3d(Poly3DCollection(corners, facecolors=colors, edgecolors="k", lw=0.25))
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    zoom: Any = 1.35 if n_sectors > 1 else 1.0
    ax.set_box_aspect(high - low, zoom=zoom)
    ax.view_init(elev=38, azim=-70)
    ax.set_axis_off()


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Frequencies with straight blades, and stresses by virtual work."""
    rows = []
    for n, expected in STRAIGHT.items():
        found = dataset.straight_frequency.sel(nodal_diameter=n).values
        for mode, (value, known) in enumerate(zip(found, expected, strict=False)):
            name = f"{n} nodal diameters, frequency {mode + 1} with straight blades"
            rows.append(Landmark(name, float(value), known, "Hz", Source.OTHER_PROGRAM, DIGITS))
    difference = np.abs(dataset.stress - dataset.work).max() / np.abs(dataset.work).max()
    name = "stresses that stiffen, integrals against virtual work"
    rows.append(Landmark(name, float(difference), 0.0, "", Source.CLOSED_FORM, 1e-9))
    return rows


if __name__ == "__main__":
    run(NAME, compute, draw)
