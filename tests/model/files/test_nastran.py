"""OP4 files of Nastran, where pyYeti is installed."""

import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import rods
from scipy.linalg import eigh

import symhbm as sh


def writer():
    with np.printoptions():  # which pyYeti changes
        return pytest.importorskip("pyyeti.nastran.op4")


@pytest.mark.slow
def test_numbers_are_printed_as_before(tmp_path):
    writer().write(str(tmp_path / "rod.op4"), {"maa": np.eye(2), "kaa": np.eye(2)})
    lines = "import sys, numpy, symhbm; before = numpy.get_printoptions(); "
    lines += "symhbm.read_structure(sys.argv[1]); assert numpy.get_printoptions() == before"
    subprocess.run([sys.executable, "-c", lines, tmp_path / "rod.op4"], check=True)


def test_without_pyyeti_it_says_what_to_install(tmp_path, monkeypatch):
    (tmp_path / "rod.op4").write_bytes(b"")
    monkeypatch.setitem(sys.modules, "pyyeti.nastran", None)
    with pytest.raises(ImportError, match=r"pip install symhbm\[nastran\]"):
        sh.read_structure(tmp_path / "rod.op4")


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("form", ["bigmat", "nonbigmat", "dense"])
def test_op4(tmp_path, binary, form):
    op4 = writer()
    path = tmp_path / "rod.op4"
    held = dict(zip(("maa", "baa", "kaa"), rods.matrices(), strict=True))
    op4.write(str(path), {k: m.tocoo() for k, m in held.items()}, sparse=form, binary=binary)
    assert rods.same(rods.read(path))
    model = rods.read(path, names={"mass": "MAA", "damping": "BAA"})
    assert rods.same(model)
    rods.halved(path)
    with pytest.raises(ValueError, match="truncated, damaged, or no OP4 file") as caught:
        sh.read_structure(path)
    assert "\n" not in str(caught.value)
    path.write_text("no matrices")
    with pytest.raises(ValueError, match="no OP4 file"):
        sh.read_structure(path)


PUBLISHED = 6.129345, 6.130134, 23.63188
"""Natural frequencies [Hz] with the boundary held, by ``inboard.out``."""


@pytest.fixture
def superelements():
    package = pytest.importorskip("pyyeti")
    folder = Path(package.__file__).parent / "tests" / "nas2cam_extseout"
    if not folder.is_dir():
        pytest.skip("this pyYeti comes without the files of its tests")
    return folder


def test_a_superelement_with_its_punched_bulk_data(superelements):
    words = "(?s)1 grids turned to the basic system.*8 scalar points.*are units= right"
    with pytest.warns(UserWarning, match=words):
        model = sh.read_structure(superelements / "inboard.op4")
    assert model.places.name(31) == "2995008:x"
    # Of inboard.op2: the modes with the boundary held, of two grids alone.
    np.testing.assert_allclose(model.places.program.modes.frequency, PUBLISHED, rtol=2e-7)
    assert "3 frequencies of the program are not compared" in model.places.program.account
    modes = [model.number_of(f"{2995001 + k}:x") for k in range(3)]
    stiffness = model.stiffness_matrix.toarray()[np.ix_(modes, modes)]
    found = np.sqrt(np.linalg.eigvalsh(stiffness)) / (2 * np.pi)
    np.testing.assert_allclose(found, PUBLISHED, rtol=2e-7)
    # One grid has directions of its own: a translation is none of these before it is turned.
    for way in "xyz":
        at = [model.number_of(f"{grid}:{way}") for grid in (3, 11, 19, 27)]
        moved = np.zeros(model.n_dof)
        moved[at] = 1
        stretched = abs(model.stiffness_matrix @ moved).max()
        assert stretched < 1e-12 * abs(model.stiffness_matrix).max()
        assert moved @ model.mass_matrix @ moved == pytest.approx(1.755052, rel=1e-6)


BULK = """SOL 103
SET 7 = 1 THRU 4, 9
BEGIN BULK
{grids}
CHEXA          1       1       1       2       3       4       5       6
+              7       8       9      10      11      12      13      14
+             15      16      17      18      19      20
PSOLID         1       3
MAT1           3   2.+11              .3   7850.
ENDDATA
"""


def bulk(folder, own=""):
    """Bulk data of a cube of 20 nodes beside matrices of all its rows."""
    op4 = writer()
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    points = [(*c, 0) for c in corners] + [(*c, 1) for c in corners]
    around = [(0, 1), (1, 2), (2, 3), (3, 0)]
    edges = around + [(k, k + 4) for k in range(4)] + [(i + 4, j + 4) for i, j in around]
    points += [
        tuple((a + b) / 2 for a, b in zip(points[i], points[j], strict=True)) for i, j in edges
    ]
    lines = [
        f"GRID    {k:8d}        " + "".join(f"{x:8.3f}" for x in p) + f"{own:>8}"
        for k, p in enumerate(points, 1)
    ]
    (folder / "cube.bdf").write_text(BULK.format(grids="\n".join(lines)))
    rng = np.random.default_rng(1)
    root = rng.normal(size=(120, 120))
    held = dict(mgg=np.eye(120), kgg=1e8 * (root @ root.T + 1e3 * np.eye(120)))
    op4.write(str(folder / "cube.op4"), held)
    return folder / "cube.op4"


def test_bulk_data_tells_places_sets_and_elements(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = sh.read_structure(bulk(tmp_path))
    assert model.places.name(119) == "20:rz"
    mesh = model.places.mesh
    assert mesh.sets["SET 7"].tolist() == [1, 2, 3, 4, 9]
    # Upright edges come before upper ones: in another order the element is folded.
    assert mesh.elements["hexahedron20"][0, 12:].tolist() == [17, 18, 19, 20, 13, 14, 15, 16]
    assert mesh.weighed({"hexahedron20": [1.0]})[0].sum() == pytest.approx(1)
    materials = {"3": dict(density=7850.0, modulus=2e11, poisson=0.3)}
    assert model.places.program.materials == materials


@pytest.mark.parametrize("spoilt", [False, True])
def test_modes_of_results_stand_beside_those_of_the_matrices(tmp_path, monkeypatch, spoilt):
    """By a table as pyYeti makes it of .op2, of a cube whose rotations have no rows."""
    path = bulk(tmp_path)
    rng = np.random.default_rng(1)
    root, mass = rng.normal(size=(60, 60)), np.diag(rng.uniform(1.0, 2.0, 60))
    stiffness = 1e8 * (root @ root.T + 1e3 * np.eye(60))
    rows = np.arange(120).reshape(20, 6)[:, :3].ravel()
    whole = {name: np.zeros((120, 120)) for name in ("mgg", "kgg")}
    whole["mgg"][np.ix_(rows, rows)], whole["kgg"][np.ix_(rows, rows)] = mass, stiffness
    writer().write(str(path), whole)
    squares, shapes = eigh(stiffness, mass, subset_by_index=[0, 3])
    table = np.zeros((120, 4))
    table[rows] = shapes[::-1] if spoilt else shapes
    index = pd.MultiIndex.from_product([range(1, 21), range(1, 7)], names=["Node", "DOF"])
    columns = [range(1, 5), np.sqrt(squares) / (2 * np.pi)]
    frame = pd.DataFrame(table.astype(np.float32), index, pd.MultiIndex.from_arrays(columns))

    class Results:
        def __init__(self, _):
            pass

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        def rdparampost(self, **_):
            return {"ougv1": frame}

    monkeypatch.setattr("pyyeti.nastran.op2.OP2", Results)
    (tmp_path / "cube.op2").write_bytes(b"")
    with pytest.warns(UserWarning, match="another speed" if spoilt else "60 zero rows dropped"):
        program = sh.read_structure(path).places.program
    np.testing.assert_allclose(program.modes.frequency, columns[1], rtol=1e-12)
    assert any("its shapes have the same here to" in line for line in program.account)
    assert any("another speed, mesh, material" in line for line in program.account) == spoilt


def test_materials_of_elements_tell_masses(tmp_path):
    with pytest.warns(UserWarning, match="the mass matrix has 20 kg, elements 7850 kg"):
        places = sh.read_structure(bulk(tmp_path)).places
    assert places.mesh.materials["hexahedron20"].tolist() == ["3"]
    assert places.program.mass.sum() == pytest.approx(7850)


def test_supports_that_the_case_control_chooses_are_no_rows(tmp_path):
    path = bulk(tmp_path)
    text = (tmp_path / "cube.bdf").read_text()
    cards = "SPC            1       7      12      .0       8       3      .0\n"
    cards += "SPC1           5  123456       1    THRU       4\n"
    cards += "SPC1           9       1      15\nSPCADD         6       1       5\n"
    grid = next(line for line in text.splitlines() if line.startswith("GRID") and line[15] == "5")
    text = text.replace(grid, f"{grid:<56}{'13':>8}").replace("PSOLID", f"{cards}PSOLID")
    (tmp_path / "cube.bdf").write_text(text.replace("SOL 103", "SOL 103\nSPC = 6"))
    with pytest.warns(UserWarning, match=r"29 degrees of freedom held by SPC dropped .*: 1:x"):
        places = sh.read_structure(path).places
    held = [[1, k] for k in range(3)] + [[2, k] for k in range(3)] + [[3, k] for k in range(3)]
    held += [[4, k] for k in range(3)] + [[5, 0], [5, 2], [7, 0], [7, 1], [8, 2]]
    assert places.program.held.tolist() == held
    assert places.n_dof == 120 - 29
    assert places.direction[places.node == 7].tolist() == ["z", "rx", "ry", "rz"]
    (tmp_path / "cube.bdf").write_text(text)  # nothing is chosen: grids alone hold
    with pytest.warns(UserWarning, match="2 degrees of freedom held by SPC dropped"):
        assert sh.read_structure(path).n_dof == 118


def test_unknown_directions_and_other_sizes_are_refused(tmp_path):
    path = bulk(tmp_path, own="12")
    with pytest.raises(ValueError, match="grid 1: expected directions of the basic system"):
        sh.read_structure(path)
    path = bulk(tmp_path)
    text = (tmp_path / "cube.bdf").read_text()
    (tmp_path / "cube.bdf").write_text(text.replace("PSOLID", "GRID          21\nPSOLID"))
    with pytest.raises(ValueError, match="120 rows of matrices, the bulk data tells 126"):
        sh.read_structure(path)
