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
        ("job.hb", "Matrix Market"),
        ("job.rua", "Matrix Market"),
        ("job.odb", r"expected one of \.mtx"),
    ],
)
def test_other_formats_say_what_to_do(tmp_path, name, words):
    with pytest.raises(ValueError, match=words):
        sh.read_structure(tmp_path / name)
    with pytest.raises(TypeError, match="path=3"):
        sh.read_structure(3)


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


@pytest.mark.parametrize(
    ("line", "field", "words"),
    [
        (
            "1 1 12345,678",
            "real",
            r"line 4: expected two places and one number, got '1 1 12345,678'",
        ),
        ("1 1 3.0 4.0", "real", "line 4: expected two places and one number"),
        ("1 1 1.2.3", "real", "line 4"),
        ("1 1 1e5e3", "real", "line 4"),
        ("1 1 nan", "real", "line 4"),
        ("1 1 12345+678", "real", "line 4"),
        ("1 1 3+04", "real", "line 4"),
        ("1 1 3.0+4", "real", "line 4"),
        ("1 1 1e999", "real", "stiffness: expected finite numbers"),
        ("1 1", "real", "line 4"),
        ("1.5 1 2.0", "real", "line 4"),
        ("1 1", "pattern", "line 1: expected .* got 'matrix coordinate pattern general'"),
        ("1 1 3.0 0.0", "complex", "line 1: .* export real numbers"),
    ],
)
def test_lines_that_are_no_real_entries(tmp_path, line, field, words):
    with pytest.raises(ValueError, match=words):
        sh.read_structure(scalar(tmp_path, line, field))


@pytest.mark.parametrize("symmetry", ["symmetric", "skew-symmetric"])
def test_symmetric_files_hold_one_half(tmp_path, symmetry):
    path = write(tmp_path)
    for kind in KINDS:
        whole = tmp_path / f"rod_{kind}.mtx"
        whole.write_text(whole.read_text().replace("general", symmetry, 1))
    with pytest.raises(ValueError, match="entries on both sides of the diagonal"):
        sh.read_structure(path)


def test_upper_halves_are_mirrored(tmp_path):
    for kind, matrix in zip(KINDS, rods.matrices(), strict=True):
        path = tmp_path / f"rod_{kind}.mtx"
        mmwrite(path, sp.triu(matrix), symmetry="general")
        path.write_text(path.read_text().replace("general", "symmetric", 1))
    assert rods.same(rods.read(tmp_path / "rod_mass.mtx"))
