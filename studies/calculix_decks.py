"""Decks of CalculiX for a bladed sector, and how they are run.

CalculiX writes the matrices of a sector only without cyclic symmetry, which joins both sides. At a
speed the sector therefore deforms under equations that make its sides move alike, in directions of
a cylinder, and these are removed for the matrices.
"""

import os
import re
import subprocess
from collections.abc import Iterable
from math import ceil
from pathlib import Path
from shutil import which

import numpy as np

from studies.calculix_mesh import SectorMesh, sector_mesh

Rayleigh = tuple[float, float]
"""Damping over mass [1/s] and over stiffness [s]."""
_HELD = "*INCLUDE, INPUT=mesh.inp\n*BOUNDARY\nBORE,1,3\n"
_CYCLIC = """*SURFACE, NAME=N_LEFT, TYPE=NODE
LEFT
*SURFACE, NAME=N_RIGHT, TYPE=NODE
RIGHT
*TIE, NAME=CYCLIC, CYCLIC SYMMETRY
N_RIGHT,N_LEFT
*CYCLIC SYMMETRY MODEL, N={n_sectors}, NGRAPH=1, TIE=CYCLIC
0,0,0,0,0,1
"""
# The first of a tie lags behind the second: waves of symhbm, whose right side lags behind the left.
_EXACT = "*CONTROLS, PARAMETERS=FIELD\n1.e-10,1.e-10,0.,0.,1.e-10,1.e-5,1.e-3,1.e-16\n"
_STATIC = "*STEP, NLGEOM\n" + _EXACT + "*STATIC\n{load}*NODE PRINT, NSET=NALL\nU\n*END STEP\n"
_MATRICES = "*FREQUENCY, SOLVER=MATRIXSTORAGE\n1\n"
_MODES = """*FREQUENCY
{count}
*SELECT CYCLIC SYMMETRY MODES, NMIN=0, NMAX={most}
*NODE PRINT, NSET=TIP
U
*NODE FILE
U
*END STEP
"""
_CONTACT = """*SURFACE INTERACTION, NAME=PENALTY
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR
1.e14
*CONTACT PAIR, INTERACTION=PENALTY, TYPE=SURFACE TO SURFACE
S_SHROUD_ARM,S_SHROUD_STUB
"""


def available() -> bool:
    """Whether CalculiX is installed here."""
    return which("ccx") is not None


def version() -> str:
    """The version of CalculiX, ``"2.20"``."""
    said = subprocess.run(["ccx", "-v"], capture_output=True, text=True).stdout
    return re.search(r"Version (\S+)", said)[1]  # type: ignore[index]


def run(folder: Path, job: str, text: str | None = None) -> str:
    """Run a deck, written here if its text is given, and return what CalculiX said of it.

    Raises RuntimeError where it fails.
    """
    if text is not None:
        (folder / f"{job}.inp").write_text(text)
    threads = os.environ | {"OMP_NUM_THREADS": "1", "CCX_NPROC_STIFFNESS": "1"}
    done = subprocess.run(
        ["ccx", "-i", job], cwd=folder, capture_output=True, text=True, env=threads
    )
    if done.returncode or "*ERROR" in done.stdout:
        raise RuntimeError(f"ccx -i {job} in {folder}:\n{done.stdout[-2000:]}{done.stderr[-500:]}")
    for suffix in ("12d", "cvg", "sta"):
        (folder / f"{job}.{suffix}").unlink(missing_ok=True)
    (folder / "spooles.out").unlink(missing_ok=True)
    return done.stdout


def centrifugal(speed: float) -> str:
    """The load of a speed [1/min] about z."""
    return f"*DLOAD\nEALL,CENTRIF,{(2 * np.pi * speed / 60) ** 2:.14g},0,0,0,0,0,1\n"


def matrices(folder: Path) -> None:
    """Files ``matrices`` of the sector at rest, ``free_matrices`` with the nodes of the bore."""
    step = f"*STEP\n{_MATRICES}*END STEP\n"
    run(folder, "matrices", _HELD + step)
    run(folder, "free_matrices", _HELD.split("*BOUNDARY")[0] + step)


def modes(folder: Path, n_sectors: int, count: int = 4) -> None:
    """Files ``modes`` of the disk at rest by nodal diameter; of each frequency there are two."""
    head = _HELD + _CYCLIC.format(n_sectors=n_sectors)
    run(folder, "modes", head + "*STEP\n" + _MODES.format(count=count, most=n_sectors // 2))


def spinning(
    folder: Path, mesh: SectorMesh, speed: float, count: int = 4, prefix: str = "spinning"
) -> None:
    """Files ``spinning_modes`` and ``spinning_matrices`` at a speed [1/min], under its load."""
    load = centrifugal(speed)
    head = _HELD + _CYCLIC.format(n_sectors=mesh.n_sectors)
    static = _STATIC.format(load=load)
    after = "*STEP, PERTURBATION\n" + _MODES.format(count=count, most=mesh.n_sectors // 2)
    run(folder, f"{prefix}_modes", head + static + after)
    left, right = mesh.sets["LEFT"].tolist(), (mesh.partners() + 1).tolist()
    joined = "*TRANSFORM, NSET=SIDES, TYPE=C\n0,0,0,0,0,1\n*EQUATION\n" + "".join(
        f"2\n{other},{way},1.,{one},{way},-1.\n"
        for one, other in zip(left, right, strict=True)
        for way in (1, 2, 3)
    )
    freed = f"*STEP, PERTURBATION\n{_MATRICES}*EQUATION, REMOVEALL\n*END STEP\n"
    sides = "*NSET, NSET=SIDES\nLEFT, RIGHT\n"
    run(folder, f"{prefix}_matrices", _HELD + sides + joined + static + freed)


def linear_static(folder: Path, n_sectors: int, speed: float) -> None:
    """Files ``linear_static``: displacements by small strains under the load of a speed."""
    head = _HELD + _CYCLIC.format(n_sectors=n_sectors)
    end = "*NODE PRINT, NSET=NALL\nU\n*NODE FILE\nU\n*EL FILE\nS\n*END STEP\n"
    run(folder, "linear_static", f"{head}*STEP\n*STATIC\n{centrifugal(speed)}{end}")


def contact_static(folder: Path, n_sectors: int, speed: float) -> None:
    """Files ``contact_static``: pressures [Pa] of the shroud at a speed [1/min], and stresses."""
    head = _HELD + _CYCLIC.format(n_sectors=n_sectors) + _CONTACT
    files = "*NODE FILE\nU\n*EL FILE\nS\n*CONTACT FILE\nCDIS,CSTR\n"
    step = f"*STEP, NLGEOM\n*STATIC\n{centrifugal(speed)}*NODE PRINT, NSET=NALL\nU\n{files}"
    run(folder, "contact_static", f"{head}{step}*END STEP\n")


def whole_disk(
    folder: Path, disk: SectorMesh, order: int, frequencies: Iterable[float], damping: Rayleigh
) -> None:
    """Files ``steady``: motions of the tips of the `ring` of sectors, driven there by 1 N.

    The force on the tip of sector k is along y of that sector, ``exp(-2 pi i order k / N)``. All
    modes are kept, of which CalculiX finds a quarter of the number of degrees of freedom: a block
    beside the disk has the others.
    """
    n = disk.n_sectors
    n_free = 3 * (disk.n_nodes - len(disk.sets["BORE"]))
    disk.beside_a_block(ceil(n_free ** (1 / 3)) + 2).write(folder / "disk.inp")
    forces = {1: "", 2: ""}
    for k, node in enumerate(disk.sets["TIP"].tolist()):
        turn = 2 * np.pi * k / n
        phase = np.exp(-1j * order * turn)
        for case, part in ((1, phase.real), (2, phase.imag)):
            for way, along in ((1, -np.sin(turn)), (2, np.cos(turn))):
                forces[case] += f"{node},{way},{part * along:.14f}\n"
    text = "*INCLUDE, INPUT=disk.inp\n*BOUNDARY\nBORE,1,3\n"
    text += f"*STEP\n*FREQUENCY, STORAGE=YES\n{n_free}\n*END STEP\n"
    alpha, beta = damping
    for frequency in frequencies:
        text += (
            f"*STEP\n*STEADY STATE DYNAMICS\n{frequency:.10g},{frequency:.10g},1\n"
            f"*MODAL DAMPING, RAYLEIGH\n,,{alpha:.10g},{beta:.10g}\n"
            f"*CLOAD, OP=NEW, LOAD CASE=1\n{forces[1]}*CLOAD, LOAD CASE=2\n{forces[2]}"
            "*NODE PRINT, NSET=TIP\nU\n*END STEP\n"
        )
    run(folder, "steady", text)
    (folder / "steady.eig").unlink()


SPEED, OPERATING = 12000.0, 3000.0
"""Of matrices and modes, and of the contact of the shroud [1/min]."""
SMALL = dict(disk=1, neck=1, platform=1, blade=2, shroud=1, width=1, side=1, height=1)
OVERCLOSURE = 1e-4
"""How far the stub reaches into the arm of the unloaded shroud [m]."""
_DISK = "disk_left", "disk", "disk_right", "neck"


def sector(folder: Path, mesh: SectorMesh) -> None:
    """All files of a sector."""
    folder.mkdir(parents=True, exist_ok=True)
    mesh.write(folder / "mesh.inp")
    matrices(folder)
    modes(folder, mesh.n_sectors)
    spinning(folder, mesh, SPEED)
    linear_static(folder, mesh.n_sectors, SPEED)
    contact_static(folder, mesh.n_sectors, OPERATING)


def small(folder: Path) -> None:
    """Files of the small sectors: of 12 with bricks of 8 and of 20 nodes, and of a disk of 6."""
    for quadratic, name in ((False, "hex8"), (True, "hex20")):
        sector(folder / name, sector_mesh(quadratic, SMALL, 12, OVERCLOSURE))
    mesh, own = sector_mesh(False, SMALL, 6, blocks=_DISK), folder / "whole_disk"
    own.mkdir(parents=True, exist_ok=True)
    mesh.write(own / "mesh.inp")
    matrices(own)
    modes(own, mesh.n_sectors)
    whole_disk(own, mesh.ring(), 2, np.linspace(1500, 12000, 10), (40.0, 1e-7))
    for path in folder.glob("*/*"):
        if not path.stat().st_size or path.name in (
            "matrices.frd",
            "free_matrices.frd",
            "steady.frd",
        ):
            path.unlink()


if __name__ == "__main__":
    small(Path(__file__).parent.parent / "data" / "calculix")
