"""Jobs of CalculiX: decks of a small swept sector of a bladed disk, and their runs.

``python -m tests.swept_bricks`` runs all of them anew and keeps what the quick tests read in
``data/calculix/``.
"""

import shutil
import subprocess
from pathlib import Path

import hexahedra
import numpy as np

DATA = Path(__file__).parent.parent / "data" / "calculix"
PROGRAM = shutil.which("ccx")
MISSING = "CalculiX is not installed: apt install calculix-ccx"
N_SECTORS = 6
SPEED = 5000.0
"""Turns per minute."""
SIZES = {8: (3, 2, 1), 20: (2, 1, 1)}
"""Cells along the radius, of which the last is a blade, around and along the axis."""
UNITS = {8: "mm-t-s", 20: "m-kg-s"}
WAVES = range(N_SECTORS // 2 + 1)


def sector(nodes):
    """Coordinates (n, 3) [m], elements and sets of nodes of the sector, swept and inclined."""
    long, around, high = SIZES[nodes]
    grid, elements = hexahedra.cells(
        (long, around, high), 1 + (nodes == 20), lambda r, t, z: r < long - 1 or t < 1
    )
    r, t, z = (grid / SIZES[nodes]).T
    radius = 0.1 + 0.18 * r
    angle = 2 * np.pi / N_SECTORS * (t - 0.5) + 1.5 * (radius - 0.1)
    points = np.column_stack(
        [radius * np.cos(angle), radius * np.sin(angle), 0.02 * z + 0.1 * (radius - 0.1)]
    )
    disk = grid[:, 0] <= long - 1
    chosen = {
        "left": disk & (t == 0),
        "right": disk & (t == 1),
        "bore": r == 0,
        "tip": r == 1,
        "free_left": disk & (t == 0) & (r > 0),
        "free_right": disk & (t == 1) & (r > 0),
    }
    return points, elements, {name: 1 + np.flatnonzero(each) for name, each in chosen.items()}


def mesh_of(nodes):
    """The deck of the mesh and its steel."""
    points, elements, sets = sector(nodes)
    small = UNITS[nodes] == "mm-t-s"
    lines = ["*NODE, NSET=every"]
    length = 1e3 if small else 1.0
    lines += [f"{i},{x:.12g},{y:.12g},{z:.12g}" for i, (x, y, z) in enumerate(length * points, 1)]
    lines += [f"*ELEMENT, TYPE=C3D{nodes}, ELSET=sector"]
    for number, element in enumerate(elements, 1):
        words = [str(number), *map(str, element)]
        lines += [",".join(words[:11]) + ","] if len(words) > 11 else [",".join(words)]
        lines += [",".join(words[11:])] if len(words) > 11 else []
    for name, numbers in sets.items():
        lines += [f"*NSET, NSET={name}", *(f"{number}," for number in numbers)]
    modulus, density = ("210000.", "7.8E-9") if small else ("2.1E11", "7800.")
    lines += ["*MATERIAL, NAME=steel", "*ELASTIC", f"{modulus}, 0.3", "*DENSITY", density]
    lines += ["*SOLID SECTION, ELSET=sector, MATERIAL=steel", "*BOUNDARY", "bore, 1, 3"]
    return "\n".join(lines) + "\n"


def load():
    return f"*DLOAD\nsector, CENTRIF, {(np.pi * SPEED / 30) ** 2:.12g}, 0,0,0, 0,0,1\n"


def cyclic(first="free_left", second="free_right"):
    """Cards of a sector in waves, the dependent side first."""
    return (
        f"*SURFACE, NAME=one, TYPE=NODE\n{first}\n*SURFACE, NAME=two, TYPE=NODE\n{second}\n"
        "*TIE, NAME=joint, CYCLIC SYMMETRY\none, two\n"
        f"*CYCLIC SYMMETRY MODEL, N={N_SECTORS}, TIE=joint\n0,0,0, 0,0,1\n"
    )


def equations(nodes):
    """Cards that join the sides of a sector as rotation moves them, for a static step."""
    points, _, sets = sector(nodes)
    angle = 2 * np.pi / N_SECTORS
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    lines = [f"*TRANSFORM, NSET=free_{side}, TYPE=C\n0,0,0, 0,0,1" for side in ("left", "right")]
    for left in sets["free_left"]:
        off = np.linalg.norm(points[sets["free_right"] - 1] - turn @ points[left - 1], axis=1)
        right = sets["free_right"][off.argmin()]
        lines += [f"*EQUATION\n2\n{right},{way},1., {left},{way},-1." for way in (1, 2, 3)]
    return "\n".join(lines) + "\n"


def decks(nodes):
    """The decks of all jobs by their names."""
    tie = cyclic() if nodes == 8 else cyclic("free_right", "free_left")
    modes = f"*FREQUENCY\n6\n*SELECT CYCLIC SYMMETRY MODES, NMIN=0, NMAX={N_SECTORS // 2}\n"
    shapes = "*NODE FILE\nU\n*END STEP\n"
    include = "*INCLUDE, INPUT=mesh.inp\n"
    turning = f"*STEP, NLGEOM\n*STATIC\n{load()}{shapes}*STEP, PERTURBATION\n"
    wrote = "*FREQUENCY, SOLVER=MATRIXSTORAGE\n"
    return {
        "mesh": mesh_of(nodes),
        "still": f"{include}*STEP\n{wrote}*END STEP\n",
        "turning": f"{include}{equations(nodes)}{turning}{wrote}{load()}*EQUATION, REMOVEALL\n"
        "*END STEP\n",
        "waves": f"{include}{tie}*STEP\n{modes}{shapes}",
        "turning_waves": f"{include}{tie}{turning}{modes}{load()}{shapes}",
        "static": f"{include}{tie}*STEP\n*STATIC\n{load()}*NODE PRINT, NSET=every\nU\n"
        "*EL PRINT, ELSET=sector, TOTALS=ONLY\nEMAS\n*END STEP\n",
    }


def run(folder, job):
    """Run a job; RuntimeError with what the program said."""
    assert PROGRAM is not None
    done = subprocess.run([PROGRAM, job], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(done.stdout[-2000:])


def jobs(folder, nodes):
    """All jobs of a sector in a new folder, run."""
    folder.mkdir(parents=True)
    for name, text in decks(nodes).items():
        (folder / f"{name}.inp").write_text(text)
    for name in decks(nodes):
        if name != "mesh":
            run(folder, name)
    return folder


def kept(path):
    """Whether the quick tests read a file of a job."""
    keeps = {"static": (".inp", ".dat"), "mesh": (".inp",)}
    matrices = (".inp", ".sti", ".mas", ".dof")
    keeps |= {"still": matrices, "turning": (*matrices, ".frd")}
    return path.suffix in keeps.get(path.stem, (".inp", ".frd"))


if __name__ == "__main__":
    from tempfile import TemporaryDirectory

    for nodes in SIZES:
        shutil.rmtree(DATA / f"brick{nodes}", ignore_errors=True)
        with TemporaryDirectory() as scratch:
            made = jobs(Path(scratch) / "jobs", nodes)
            (DATA / f"brick{nodes}").mkdir(parents=True)
            for file in filter(kept, sorted(made.iterdir())):
                shutil.copy(file, DATA / f"brick{nodes}")
