"""``symhbm import``: files of programs to one file of a structure, with an account."""

import numpy as np
import pytest
import rods
import scipy.io
import swept_bricks

import symhbm as sh
from tests.archives import run

BRICK = swept_bricks.DATA / "brick8"


def test_jobs_become_one_file_and_an_account(tmp_path):
    output = tmp_path / "sector.nc"
    jobs = [BRICK / f"{job}.inp" for job in ("still", "turning", "waves")]
    code, out, err = run("import", *jobs, "--output", output)
    assert (code, err) == (0, "")
    assert "sector of 6, 60 degrees about z: 4 pairs of nodes" in out
    assert "LOOK: nodal diameters of all modes" in out
    assert "-1 nodal diameters: 1314.689, 4118.281, 4593.906 Hz by the program" in out
    assert out.splitlines()[-1] == str(output)
    structure = sh.read_structure(output)
    assert structure.speeds == pytest.approx((0, swept_bricks.SPEED))
    code, told, err = run("info", output)
    assert (code, err) == (0, "")
    assert told.startswith("RotatingModel: 48 degrees of freedom")
    assert set(out.splitlines()[:-1]) <= set(told.splitlines())


def test_matrices_alone_say_what_reading_says(tmp_path):
    mass, _, stiffness = rods.matrices()
    for name, matrix in (("mass", mass), ("stiffness", stiffness)):
        scipy.io.mmwrite(tmp_path / f"rod_{name}.mtx", matrix)
    output = tmp_path / "rod.h5"
    code, out, _ = run("import", tmp_path / "rod.mtx", "--units", "mm-t-s", "-o", output)
    assert code == 0
    assert "mm-t-s changed to SI" in out
    quiet = run("import", tmp_path / "rod.mtx", "-o", tmp_path / "si.h5")
    assert quiet == (0, f"{tmp_path / 'si.h5'}\n", "")
    given = sh.read_structure(output).mass_matrix
    np.testing.assert_allclose(given.toarray(), 1e3 * mass.toarray())
    assert run("info", output)[1].startswith("Model: 12 degrees of freedom")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["{here}/none.inp", "-o", "{here}/a.nc"], "none.inp': no such file"),
        (["{brick}/waves.inp", "-o", "{here}/a.nc"], "expected matrices"),
        (["{brick}/still.inp", "-o", "{here}/a.mtx"], "ending in .h5, .hdf5, .nc"),
        (["{brick}/still.inp", "-o", "{here}/there.nc"], "--overwrite replaces it"),
        (["{brick}/still.inp", "--units", "mm", "-o", "{here}/a.nc"], "expected length-mass-time"),
    ],
)
def test_bad_input_is_told_in_one_line(tmp_path, arguments, words):
    (tmp_path / "there.nc").write_text("")
    given = (text.format(here=tmp_path, brick=BRICK) for text in arguments)
    code, out, err = run("import", *given)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert words in err
