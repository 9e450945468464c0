"""Files, tables and arguments that are not what they should be: each refused in one sentence."""

import netCDF4
import numpy as np
import pytest
import rods
import scipy.sparse as sp
from scipy.io import mmwrite, savemat

import symhbm as sh

KINDS = "mass", "damping", "stiffness"
MASS, DAMPING, STIFFNESS = (matrix.toarray() for matrix in rods.matrices())
EYE = np.eye(12)


def market(folder, symmetry="general", **changes):
    """Files of Matrix Market; the path of the stiffness."""
    for kind, matrix in zip(KINDS, rods.matrices(), strict=True):
        mmwrite(folder / f"rod_{kind}.mtx", changes.get(kind, matrix), symmetry=symmetry)
    return folder / "rod_stiffness.mtx"


def written(folder, text, name="rod_stiffness.mtx"):
    """A file of a text."""
    (folder / name).write_text(text)
    return folder / name


def renamed(folder, symmetry):
    """Files that call whole matrices symmetric ones."""
    path = market(folder)
    for kind in KINDS:
        text = (folder / f"rod_{kind}.mtx").read_text()
        written(folder, text.replace("general", symmetry, 1), f"rod_{kind}.mtx")
    return path


def without(folder, name):
    path = market(folder)
    (folder / name).unlink()
    return path


def alone(folder, *names):
    for name in names:
        mmwrite(folder / f"{name}.mtx", rods.matrices()[0])
    return folder / f"{names[0]}.mtx"


def scalar(folder, stiffness, field="real", symmetry="general"):
    """A mass of 2.5 kg on a spring, whose file is written by hand."""
    head = f"%%MatrixMarket matrix coordinate {field} {symmetry}\n% by hand\n"
    mmwrite(folder / "one_mass.mtx", sp.coo_array([[2.5]]))
    return written(folder, f"{head}1 1 1\n{stiffness}\n", "one_stiffness.mtx")


def arrays(folder, **held):
    np.savez(folder / "rod.npz", **held)
    return folder / "rod.npz"


def matlab(folder):
    savemat(folder / "rod.mat", dict(M=MASS, K=STIFFNESS))
    return folder / "rod.mat"


def hdf5(folder, change=None, damping=DAMPING):
    path = sh.save_structure(sh.Model(MASS, damping, STIFFNESS), folder / "rod.h5")
    with netCDF4.Dataset(path, "a") as file:
        if change:
            change(file)
    return path


def no_matrices(folder):
    with netCDF4.Dataset(folder / "rod.h5", "w") as file:
        file.createGroup("results")
    return folder / "rod.h5"


def with_table(folder, text):
    table = text if isinstance(text, dict) else written(folder, text, "places.csv")
    return dict(path=rods.saved(folder / "rod.npz"), places=table)


def rod(folder, **given):
    return dict(path=rods.saved(folder / "rod.npz")) | given


OF_A_TEXT = [
    ("1 1 12345,678", "real", "line 4: expected two places and one number, got '1 1 12345,678'"),
    ("1 1 3.0 4.0", "real", "line 4: expected two places and one number"),
    ("1 1 1e999", "real", "stiffness: expected finite numbers"),
    ("1 1", "pattern", "line 1: expected .* got 'matrix coordinate pattern general'"),
    ("1 1 3.0 0.0", "complex", "line 1: .* export real numbers"),
    *((line, "real", "line 4") for line in (
        "1 1 1.2.3", "1 1 1e5e3", "1 1 nan", "1 1 12345+678", "1 1 3+04", "1 1 3.0+4", "1 1",
        "1.5 1 2.0",
    )),
]  # fmt: skip
OF_TABLES = [
    ("node,x\n1,2\n", "columns x, y and z"),
    ("x,y,z\n1,2,3\n", "the column 'node'"),
    ("node,direction\n1,x\n2\n", "expected 2 values in each line"),
    ("node,direction\n1,x\nb,y\n", "node=.*expected real numbers"),
    ("node,direction\n1,up\n", "direction='up'"),
    ("node,direction\n1,x\n", "expected 12"),
    ("node\n1\n2\n3\n4\n5\n", "not 1, 2, 3 or 6"),
    ("node\n1\n1\n3\n4\n", "each node once"),
    ("node\n1\n1.5\n3\n4\n", "expected integers"),
]
OLD_MATLAB = "MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + "\0\2IM" + 400 * "\0"
REFUSED = [
    *((lambda f, a=line, b=field: scalar(f, a, b), ValueError, words)
      for line, field, words in OF_A_TEXT),
    (lambda f: rods.halved(market(f)), ValueError, "truncated, damaged, or no Matrix Market file"),
    (lambda f: written(f, "%%MatrixMarket nothing\n"), ValueError, "no Matrix Market file"),
    (lambda f: dict(path={"stiffness": written(f, "not a matrix\n")}),
     ValueError, "no Matrix Market file and no matrix of Abaqus"),
    (lambda f: f / "rod.mtx", FileNotFoundError, "no such file"),
    (lambda f: dict(path={"masses": market(f)}), KeyError, "did you mean 'mass'"),
    (lambda f: without(f, "rod_mass.mtx"),
     ValueError, "expected a mass matrix, there is damping and stiffness"),
    (lambda f: alone(f, "rod"), ValueError, "of which matrix"),
    (lambda f: alone(f, "K", "k2", "M"), ValueError, r"K\.mtx and k2\.mtx are both stiffness"),
    (lambda f: market(f, mass=rods.matrices(3)[0]),
     ValueError, "mass: expected 12 rows as the stiffness, got 9"),
    (lambda f: market(f, stiffness=np.ones((12, 11))), ValueError, "square matrix"),
    (lambda f: market(f, stiffness=1j * EYE), ValueError, "real numbers"),
    (lambda f: market(f, stiffness=sp.triu(rods.matrices()[2])),
     ValueError, "one triangle is there alone; symmetric=True"),
    *((lambda f, kind=kind: renamed(f, kind), ValueError, "entries on both sides of the diagonal")
      for kind in ("symmetric", "skew-symmetric")),
    (lambda f: f / "job.hb", ValueError, "Matrix Market"),
    (lambda f: f / "job.rua", ValueError, "Matrix Market"),
    (lambda f: f / "job.odb", ValueError, r"expected one of \.mtx"),
    (lambda f: 3, TypeError, "path=3"),
    (lambda f: dict(path=arrays(f, mine=MASS, K=STIFFNESS), names={"mass": "mines"}),
     KeyError, "did you mean 'mine'"),
    (lambda f: arrays(f, a=MASS), ValueError, "it holds a; names="),
    (lambda f: arrays(f, M=MASS, maa=MASS, K=STIFFNESS),
     ValueError, "expected one mass matrix, got M, maa"),
    (lambda f: arrays(f, M=MASS, K=np.tril(STIFFNESS)),
     ValueError, "stiffness: expected the whole matrix"),
    (lambda f: arrays(f, M=MASS, KLL=STIFFNESS, D=EYE),
     ValueError, "expected a stiffness matrix, there is mass.* not read: KLL; names="),
    (lambda f: rods.halved(rods.saved(f / "rod.npz")),
     ValueError, r"truncated, damaged, or no file of numpy\.savez"),
    (lambda f: rods.halved(matlab(f)), ValueError, "truncated, damaged, or no MATLAB file"),
    (lambda f: written(f, "no matrices", "rod.mat"), ValueError, "no MATLAB file"),
    (lambda f: written(f, OLD_MATLAB, "rod.mat"), ValueError, r"save.*'-v7'"),
    (lambda f: hdf5(f, lambda h: h["stiffness"]["indices"].__setitem__(0, 99)),
     ValueError, "truncated, damaged, or no HDF5 file"),
    (lambda f: rods.halved(hdf5(f), 0.3), ValueError, "truncated, damaged, or no HDF5 file"),
    (lambda f: written(f, "something else", "rod.h5"), ValueError, "no HDF5 file"),
    (no_matrices, ValueError, "it holds none"),
    (lambda f: dict(path=hdf5(f, damping=sh.RayleighDamping(1)), units="mm-t-s"),
     ValueError, "a structure saved in SI"),
    *((lambda f, text=text: with_table(f, text), (TypeError, ValueError), words)
      for text, words in OF_TABLES),
    (lambda f: rod(f, places=f / "nowhere.csv"), FileNotFoundError, "no such file"),
    (lambda f: with_table(f, dict(node=rods.NODES, directions=["x"])),
     KeyError, "did you mean 'direction'"),
    (lambda f: rod(f, labels={"tip": 3}), ValueError, "labels: expected places="),
    *((lambda f, units=units: rod(f, units=units), ValueError, "as 'mm-t-s' or 'mm-kg-ms'")
      for units in ("mm", "mm-t-h", 3)),
]  # fmt: skip


@pytest.mark.parametrize(("make", "error", "words"), REFUSED)
def test_what_is_no_structure_is_refused_in_one_sentence(tmp_path, make, error, words):
    made = make(tmp_path)
    given = made if isinstance(made, dict) else dict(path=made)
    with pytest.raises(error, match=words) as caught:
        sh.read_structure(**given)
    assert "\n" not in str(caught.value)
