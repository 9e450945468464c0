"""What CalculiX wrote, read by few lines that share nothing with the readers of the library."""

import re
from pathlib import Path

import numpy as np
import scipy.sparse as sp

import symhbm as sh

DATA = Path(__file__).parent.parent / "data" / "calculix"


def mesh(folder):
    """Coordinates (n_nodes, 3) and sets of nodes of ``mesh.inp``."""
    coordinates, sets, into = [], {}, None
    for line in (folder / "mesh.inp").read_text().splitlines():
        if line.startswith("*"):
            name = re.match(r"\*NSET, NSET=(\w+)", line)
            into = coordinates if line.startswith("*NODE") else None
            into = sets.setdefault(name[1], []) if name else into
        elif into is coordinates:
            coordinates.append([float(word) for word in line.split(",")[1:]])
        elif into is not None:
            into += [int(word) for word in line.split(",") if word.strip()]
    return np.array(coordinates), {name: np.array(nodes) for name, nodes in sets.items()}


def matrix(path):
    """The whole of a symmetric matrix."""
    row, column, value = np.loadtxt(path, unpack=True)
    upper = sp.coo_array((value, (row.astype(int) - 1, column.astype(int) - 1))).tocsc()
    return sp.csc_array(upper + sp.triu(upper, 1).T)


def structure(folder, job="matrices", damping=(0.0, 0.0)):
    """A `Model` with places, damped by shares of mass and stiffness."""
    dofs = np.array([line.split(".") for line in (folder / f"{job}.dof").read_text().split()])
    node, way = dofs.astype(int).T
    stiffness, mass = (matrix(folder / f"{job}.{kind}") for kind in ("sti", "mas"))
    places = sh.Places(node, np.array(["x", "y", "z"])[way - 1], mesh(folder)[0][node - 1])
    alpha, beta = damping
    return sh.Model(mass, alpha * mass + beta * stiffness, stiffness, places=places)


def turn(angle):
    """A rotation (3, 3) about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def sides(folder, n_sectors):
    """Nodes of LEFT, and their images at RIGHT in the same order."""
    coordinates, sets = mesh(folder)
    image = coordinates[sets["LEFT"] - 1] @ turn(2 * np.pi / n_sectors).T
    apart = np.linalg.norm(image[:, None] - coordinates[sets["RIGHT"] - 1], axis=2)
    assert apart.min(axis=1).max() < 1e-12
    return sets["LEFT"], sets["RIGHT"][apart.argmin(axis=1)]


def disk(folder, n_sectors, job="matrices", damping=(0.0, 0.0)):
    """The `Sector` of a folder."""
    model = structure(folder, job, damping)
    left, right = (
        [model.number_of(f"{node}:{way}") for node in nodes.tolist() for way in "xyz"]
        for nodes in sides(folder, n_sectors)
    )
    return sh.Sector(model, left, right, n_sectors, rotation="z")


def eigenvalues(path):
    """Eigenvalues [1/s^2] by nodal diameter of the table of a file ``.dat``, each once."""
    found = re.findall(r"^ +(\d+) +\d+ +(\S+E\S+) +\S+ +\S+ +\S+$", path.read_text(), re.M)
    of = {}
    for diameter, value in found:
        of.setdefault(int(diameter), []).append(float(value))
    return {diameter: np.array(values[::2]) for diameter, values in of.items()}


def printed(path):
    """Displacements (n, 3) [m] by node of each block that a file ``.dat`` has of them."""
    blocks = re.split(r"displacements \(vx,vy,vz\).*\n\n", path.read_text())[1:]
    return [
        np.array([row.split() for row in block.split("\n\n")[0].splitlines()], dtype=float)
        for block in blocks
    ]


def shapes(path, n_nodes):
    """Complex shapes (n, n_nodes, 3) of a file ``.frd`` of modes of a cyclic structure."""
    blocks = re.findall(r"^ -4  DISPI? .*\n(?: -5.*\n)*((?: -1.*\n)+)", path.read_text(), re.M)
    parts = [
        [[float(line[k : k + 12]) for k in (13, 25, 37)] for line in block.splitlines()]
        for block in blocks
    ]
    real, imaginary = np.array(parts)[::2], np.array(parts)[1::2]
    assert real.shape[1] == n_nodes
    return real + 1j * imaginary
