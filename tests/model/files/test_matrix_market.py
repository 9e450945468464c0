"""Matrix Market files: whole, symmetric, a triangle, truncated, others."""

import numpy as np
import pytest
import rods
import scipy.sparse as sp
from scipy.io import mmwrite

import symhbm as sh

KINDS = ("mass", "damping", "stiffness")


def write(folder, symmetry="general", name="rod", **changes):
    for kind, matrix in zip(KINDS, rods.matrices(), strict=True):
        mmwrite(folder / f"{name}_{kind}.mtx", changes.get(kind, matrix), symmetry=symmetry)
    return folder / f"{name}_stiffness.mtx"


@pytest.mark.parametrize("symmetry", ["general", "symmetric"])
@pytest.mark.parametrize("name", ["rod.mtx", "rod_mass.mtx", "rod_stiffness.mtx"])
def test_files_beside_each_other(tmp_path, symmetry, name):
    write(tmp_path, symmetry)
    write(tmp_path, name="other_rod")
    assert rods.same(rods.read(tmp_path / name))


def test_files_by_kind(tmp_path):
    write(tmp_path)
    files = {"stiffness": tmp_path / "rod_stiffness.mtx", "mass": tmp_path / "rod_mass.mtx"}
    assert rods.same(rods.read(files), damping=False)
    with pytest.raises(KeyError, match="did you mean 'mass'"):
        sh.read_structure({"masses": files["mass"]})


def test_a_triangle_is_no_whole(tmp_path):
    mass, damping, stiffness = rods.matrices()
    path = write(tmp_path, stiffness=sp.triu(stiffness), mass=sp.tril(mass), damping=damping)
    with pytest.raises(ValueError, match="one triangle is there alone; symmetric=True"):
        sh.read_structure(path)
    with pytest.warns(UserWarning, match="mass completed .*; stiffness completed"):
        assert rods.same(sh.read_structure(path, symmetric=True))


def test_truncated_and_other_files(tmp_path):
    path = write(tmp_path)
    rods.halved(path)
    with pytest.raises(ValueError, match="truncated, damaged, or no Matrix Market file") as caught:
        sh.read_structure(path)
    assert "\n" not in str(caught.value)
    path.write_text("%%MatrixMarket nothing\n")
    with pytest.raises(ValueError, match="no Matrix Market file"):
        sh.read_structure(path)
    path.write_text("not a matrix at all\n")
    with pytest.raises(ValueError, match="no Matrix Market file and no matrix of Abaqus"):
        sh.read_structure({"stiffness": path})


def test_missing_files_and_matrices(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such file"):
        sh.read_structure(tmp_path / "rod.mtx")
    path = write(tmp_path)
    (tmp_path / "rod_mass.mtx").unlink()
    with pytest.raises(ValueError, match="expected a mass matrix, there is damping and stiffness"):
        sh.read_structure(path)


def test_names_that_tell_no_kind(tmp_path):
    mmwrite(tmp_path / "rod.mtx", rods.matrices()[0])
    with pytest.raises(ValueError, match="of which matrix"):
        sh.read_structure(tmp_path / "rod.mtx")
    for name in ("K", "k2", "M"):
        mmwrite(tmp_path / f"{name}.mtx", rods.matrices()[0])
    with pytest.raises(ValueError, match=r"K\.mtx and k2\.mtx are both stiffness"):
        sh.read_structure(tmp_path / "K.mtx")


def test_matrices_that_do_not_fit(tmp_path):
    path = write(tmp_path, mass=rods.matrices(3)[0])
    with pytest.raises(ValueError, match="mass: expected 12 rows as the stiffness, got 9"):
        sh.read_structure(path)
    path = write(tmp_path, stiffness=np.ones((12, 11)))
    with pytest.raises(ValueError, match="square matrix"):
        sh.read_structure(path)
    path = write(tmp_path, stiffness=1j * np.eye(12))
    with pytest.raises(ValueError, match="real numbers"):
        sh.read_structure(path)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("file.full", "EXPORT"),
        ("job.hb", "Matrix Market"),
        ("job.rua", "Matrix Market"),
        ("job.inp", r"expected one of \.mtx"),
    ],
)
def test_other_formats_say_what_to_do(tmp_path, name, words):
    with pytest.raises(ValueError, match=words):
        sh.read_structure(tmp_path / name)
    with pytest.raises(TypeError, match="path=3"):
        sh.read_structure(3)
