"""What CalculiX says of a sector and of a whole disk, and what we say from its matrices."""

import filecmp

import numpy as np
import pytest
import scipy.sparse as sp
from calculix import DATA, disk, eigenvalues, mesh, printed, shapes, sides, structure, turn
from scipy.sparse.linalg import spsolve

import symhbm as sh
from studies import calculix_decks

N = 12
SPEED = 2 * np.pi * calculix_decks.SPEED / 60


@pytest.mark.parametrize("speed", ["", "spinning_"])
@pytest.mark.parametrize("bricks", ["hex8", "hex20"])
def test_frequencies_of_each_nodal_diameter_are_those_of_calculix(bricks, speed):
    sector = disk(DATA / bricks, N, f"{speed}matrices")
    own = eigenvalues(DATA / bricks / f"{speed}modes.dat")
    assert own.keys() == set(range(N // 2 + 1))
    for diameter, squares in own.items():
        found = sh.natural_modes(sector, nodal_diameter=diameter, count=len(squares))
        expected = np.sqrt(squares) / (2 * np.pi)
        np.testing.assert_allclose(found.frequency, expected, rtol=1e-6)


def test_stiffening_by_speed_is_large():
    at_rest, moving = (
        np.concatenate([*eigenvalues(DATA / "hex20" / f"{job}.dat").values()])
        for job in ("modes", "spinning_modes")
    )
    assert np.min(moving / at_rest) > 1.02


@pytest.mark.parametrize("bricks", ["hex8", "hex20"])
def test_a_wave_of_calculix_runs_as_ours(bricks):
    coordinates, _ = mesh(DATA / bricks)
    left, right = sides(DATA / bricks, N)
    found = shapes(DATA / bricks / "modes.frd", len(coordinates))
    assert len(found) == 2 * (N // 2 + 1)
    for k, shape in enumerate(found):
        lagging = shape[left - 1] @ turn(2 * np.pi / N).T * np.exp(-2j * np.pi * (k // 2) / N)
        error = np.abs(lagging - shape[right - 1]).max()
        assert error < 1e-4 * np.abs(shape).max()


@pytest.mark.parametrize("bricks", ["hex8", "hex20"])
def test_static_displacement_under_speed_is_that_of_calculix(bricks):
    folder = DATA / bricks
    coordinates, sets = mesh(folder)
    model, sector = structure(folder, "free_matrices"), disk(folder, N)
    node, way = model.places.node, model.places.direction
    from_axis = np.select([way == "x", way == "y"], coordinates[node - 1, :2].T, 0)
    held = np.isin(node, sets["BORE"])
    load = SPEED**2 * (model.mass_matrix @ from_axis)[~held]
    stiffness = sp.csc_array(sector.matrices(0).stiffness_matrix.real)
    motion = spsolve(stiffness, sector.interfaces.folded(load, 0).real)
    found = sector.expanded(motion, 0).real
    [rows] = printed(folder / "linear_static.dat")
    expected = rows[node[~held] - 1, 1 + np.searchsorted(["x", "y", "z"], way[~held])]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def test_forced_response_of_the_whole_disk_is_that_of_calculix():
    folder = DATA / "whole_disk"
    sector = disk(folder, 6, damping=(40.0, 1e-7))
    [tip] = mesh(folder)[1]["TIP"].tolist()
    force = sh.forces.EngineOrder(2, pattern={f"{tip}:y": 1.0})
    problem = sh.HarmonicBalance(sector, force, harmonics=(1,))
    blocks = printed(folder / "steady.dat")
    assert len(blocks) == 2 * 10
    for frequency, real, imaginary in zip(
        np.linspace(1500, 12000, 10), blocks[::2], blocks[1::2], strict=True
    ):
        point = sh.solve(problem, frequency)
        motion = point.coefficient.values[point.node.values == tip, 0]
        first = motion @ [1, -1j]
        expected = [turn(a) @ first * np.exp(-2j * a) for a in np.arange(6) * np.pi / 3]
        found = real[:, 1:] + 1j * imaginary[:, 1:]
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(found).max())


@pytest.mark.slow
@pytest.mark.skipif(not calculix_decks.available(), reason="CalculiX (ccx) is not installed")
def test_calculix_makes_the_same_files_anew(tmp_path):
    pytest.importorskip("gmsh")
    assert calculix_decks.version() in (DATA / "README.md").read_text()
    calculix_decks.small(tmp_path)
    kept = sorted(path.relative_to(tmp_path) for path in tmp_path.glob("*/*"))
    own = {path.parent for path in kept}
    assert kept == sorted(
        p for each in own for p in (f.relative_to(DATA) for f in (DATA / each).iterdir())
    )
    for path in kept:
        if path.suffix == ".dof":
            assert filecmp.cmp(DATA / path, tmp_path / path, shallow=False), path
        elif path.suffix in (".mas", ".sti"):
            old, new = (np.loadtxt(folder / path)[:, 2] for folder in (DATA, tmp_path))
            np.testing.assert_allclose(new, old, rtol=0, atol=1e-7 * np.abs(old).max())
        elif path.name.endswith("modes.dat"):
            old, new = (eigenvalues(folder / path) for folder in (DATA, tmp_path))
            for diameter, squares in old.items():
                np.testing.assert_allclose(new[diameter], squares, rtol=1e-6)
