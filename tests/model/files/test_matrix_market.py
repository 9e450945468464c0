"""Matrix Market files: whole, symmetric, a triangle, truncated, others."""

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


def test_a_triangle_is_no_whole(tmp_path):
    mass, damping, stiffness = rods.matrices()
    path = write(tmp_path, stiffness=sp.triu(stiffness), mass=sp.tril(mass), damping=damping)
    with pytest.warns(UserWarning, match="mass completed .*; stiffness completed"):
        assert rods.same(sh.read_structure(path, symmetric=True))


def scalar(folder, stiffness, field="real", symmetry="general"):
    """A mass of 2.5 kg on a spring, whose file is written by hand."""
    head = f"%%MatrixMarket matrix coordinate {field} {symmetry}\n% by hand\n"
    (folder / "one_stiffness.mtx").write_text(f"{head}1 1 1\n{stiffness}\n")
    mmwrite(folder / "one_mass.mtx", sp.coo_array([[2.5]]))
    return folder / "one_stiffness.mtx"


@pytest.mark.parametrize("written", ["3.0D+08", "3.0d8", "3.0+008", "3.0+08", "3.+08", "  3.E8 "])
def test_exponents_as_fortran_writes_them(tmp_path, written):
    model = sh.read_structure(scalar(tmp_path, f"1 1 {written}"))
    assert model.stiffness_matrix.toarray().tolist() == [[3e8]]
    small = sh.read_structure(scalar(tmp_path, "1 1 300000.0D-003"))
    assert small.stiffness_matrix.toarray().tolist() == [[300.0]]


def test_upper_halves_are_mirrored(tmp_path):
    for kind, matrix in zip(KINDS, rods.matrices(), strict=True):
        path = tmp_path / f"rod_{kind}.mtx"
        mmwrite(path, sp.triu(matrix), symmetry="general")
        path.write_text(path.read_text().replace("general", "symmetric", 1))
    assert rods.same(rods.read(tmp_path / "rod_mass.mtx"))
