"""Files of NumPy and MATLAB, with arrays, sparse matrices and places."""

import numpy as np
import pytest
import rods
import scipy.sparse as sp
from scipy.io import savemat

import symhbm as sh


def columns():
    table = rods.places()
    return dict(
        node=table.node, direction=table.direction, coordinates=table.coordinates, label=table.label
    )


def test_arrays_of_numpy(tmp_path):
    mass, damping, stiffness = (matrix.toarray() for matrix in rods.matrices())
    np.savez(tmp_path / "rod.npz", M=mass, C=damping, K=stiffness, **columns())
    model = rods.read(tmp_path / "rod.npz")
    assert rods.same(model)
    assert model.number_of("tip:y") == 10
    np.savez(tmp_path / "other.npz", mine=mass, K=stiffness, M=damping)
    with pytest.warns(UserWarning, match=r"other\.npz: not read: M$"):
        model = sh.read_structure(tmp_path / "other.npz", names={"mass": "mine"})
    assert rods.same(model, damping=False)


def test_matrices_that_are_not_read_are_told(tmp_path):
    mass, damping, stiffness = rods.matrices()
    held = dict(M=mass.toarray(), K=stiffness.toarray(), K4AA=0.02 * stiffness.toarray())
    np.savez(tmp_path / "rod.npz", **held, modes=np.ones((12, 3)))
    with pytest.warns(UserWarning, match=r"rod\.npz: not read: K4AA$"):
        sh.read_structure(tmp_path / "rod.npz")
    for end, matrix in (("MASS2", mass), ("STIF2", stiffness), ("DMPS2", damping)):
        sp.save_npz(tmp_path / f"job_{end}.npz", matrix)
    with pytest.warns(UserWarning, match=r"not read: job_DMPS2\.npz$"):
        model = sh.read_structure(tmp_path / "job_STIF2.npz")
    assert rods.same(model, damping=False)


def test_names_of_one_letter(tmp_path):
    for name, matrix in zip("mck", rods.matrices(), strict=True):
        sp.save_npz(tmp_path / f"{name}.npz", matrix)
    assert rods.same(rods.read(tmp_path / "k.npz"))


def test_sparse_matrices_of_numpy(tmp_path):
    for name, matrix in zip(("M", "C", "K"), rods.matrices(), strict=True):
        sp.save_npz(tmp_path / f"rod_{name}.npz", matrix)
    assert rods.same(rods.read(tmp_path / "rod_K.npz"))


@pytest.mark.parametrize("form", [sp.csc_array, lambda matrix: matrix.toarray()])
def test_matlab(tmp_path, form):
    held = {name: form(matrix) for name, matrix in zip("MCK", rods.matrices(), strict=True)}
    path = tmp_path / "rod.mat"
    savemat(path, held | columns() | dict(direction=np.array(columns()["direction"], dtype=object)))
    model = rods.read(path)
    assert rods.same(model)
    assert model.number_of("tip:z") == 11


def test_triangles_in_files_of_several(tmp_path):
    mass, _, stiffness = (matrix.toarray() for matrix in rods.matrices())
    np.savez(tmp_path / "rod.npz", M=mass, K=np.tril(stiffness))
    with pytest.warns(UserWarning, match="stiffness completed"):
        model = sh.read_structure(tmp_path / "rod.npz", symmetric=True)
    assert rods.same(model, damping=False)
