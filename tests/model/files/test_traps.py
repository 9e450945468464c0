"""Zero rows, rows without mass or stiffness, asymmetry, wrong units, large files."""

import re
import tracemalloc

import numpy as np
import pytest
import rods
import scipy.sparse as sp
from scipy.io import mmwrite

import symhbm as sh
from symhbm.model.files.traps import _lowest_elastic


def write(path, **changes):
    table = dict(node=rods.places().node, direction=rods.places().direction)
    return rods.saved(path, **table | changes)


def zeroed(matrix, rows):
    result = matrix.toarray()
    result[rows] = result[:, rows] = 0.0
    return result


def test_constrained_rows_are_dropped(tmp_path):
    mass, damping, stiffness = rods.matrices()
    rows = [1, 7]
    parts = {"M": mass, "C": damping, "K": stiffness}
    path = write(tmp_path / "rod.npz", **{k: zeroed(m, rows) for k, m in parts.items()})
    with pytest.warns(UserWarning, match=re.escape("2 zero rows dropped (the first: 3:y)")):
        model = sh.read_structure(path)
    kept = np.delete(np.arange(12), rows)
    np.testing.assert_array_equal(
        model.stiffness_matrix.toarray(), stiffness[kept][:, kept].toarray()
    )
    assert model.number_of("8:x") == 5
    with pytest.raises(KeyError, match="8 has x, z"):
        model.number_of("8:y")


def test_rows_without_mass_or_stiffness_are_kept_and_told(tmp_path):
    mass, _, stiffness = rods.matrices()
    path = write(tmp_path / "rod.npz", M=zeroed(mass, [4]))
    with pytest.warns(UserWarning, match=r"1 degrees of freedom without mass .*5:y"):
        assert sh.read_structure(path).n_dof == 12
    path = write(tmp_path / "rod.npz", K=zeroed(stiffness, [5]))
    with pytest.warns(UserWarning, match=r"1 degrees of freedom without stiffness .*5:z"):
        assert sh.read_structure(path).n_dof == 12


def test_asymmetry_is_told(tmp_path):
    stiffness = rods.matrices()[2].toarray()
    stiffness[0, 1] *= 1.01
    path = write(tmp_path / "rod.npz", K=stiffness)
    with pytest.warns(UserWarning, match="stiffness is not symmetric, by"):
        sh.read_structure(path)
    with pytest.raises(ValueError, match="expected a symmetric matrix"):
        sh.read_structure(path, symmetric=True)


@pytest.mark.parametrize("factor", [1e-14, 1e14])
def test_frequencies_that_no_machine_has(tmp_path, factor):
    path = write(tmp_path / "rod.npz", K=factor * rods.matrices()[2].toarray())
    with pytest.warns(UserWarning, match=r"lowest natural frequency .* Hz, is units="):
        sh.read_structure(path)


@pytest.mark.parametrize("n", [8, 40])
def test_rigid_bodies_are_no_wrong_units(tmp_path, n):
    chain = sp.diags_array([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    free = chain.toarray()
    free[0, 0] = free[-1, -1] = 1.0
    path = tmp_path / "free.npz"
    np.savez(path, M=np.eye(3 * n), K=np.kron(1e7 * free, np.eye(3)))
    rods.read(path)
    np.savez(path, M=np.eye(3 * n), K=np.kron(1e-9 * free, np.eye(3)))
    with pytest.warns(UserWarning, match="lowest natural frequency"):
        sh.read_structure(path)


def test_lowest_frequency_of_a_long_free_chain():
    n = 3000
    twice = np.r_[1.0, 2 * np.ones(n - 2), 1.0]
    chain = sp.diags_array([-np.ones(n - 1), twice, -np.ones(n - 1)], offsets=[-1, 0, 1])
    lowest = _lowest_elastic(sp.eye_array(n, format="csc"), chain.tocsc(), 2.0, np.nan)
    assert lowest == pytest.approx(np.sin(np.pi / (2 * n)) / np.pi, rel=1e-9)


def test_large_files_are_read_without_dense_copies(tmp_path):
    n = 30_000  # 7.2 GB if it were dense
    chain = sp.diags_array([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    mmwrite(tmp_path / "rod_K.mtx", 1e7 * chain, symmetry="symmetric")
    mmwrite(tmp_path / "rod_M.mtx", sp.eye_array(n))
    tracemalloc.start()
    try:
        model = rods.read(tmp_path / "rod.mtx")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert model.n_dof == n
    assert peak < 40e6
