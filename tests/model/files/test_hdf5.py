"""HDF5 files: written and read, those of others, truncated ones."""

import netCDF4
import numpy as np
import pytest
import rods

import symhbm as sh


def test_round_trip(tmp_path):
    path = sh.save_structure(sh.Model(*rods.matrices(), places=rods.places()), tmp_path / "rod.h5")
    model = rods.read(path)
    assert rods.same(model)
    for column in ("node", "direction", "coordinates", "label"):
        given, expected = (getattr(each, column) for each in (model.places, rods.places()))
        np.testing.assert_array_equal(given, expected)
    bare = sh.save_structure(sh.Model(*rods.matrices()), tmp_path / "bare.hdf5")
    assert rods.read(bare).places is None


def test_writing_says_what_is_wrong(tmp_path):
    model = sh.Model(*rods.matrices())
    path = sh.save_structure(model, tmp_path / "rod.h5")
    with pytest.raises(FileExistsError, match="overwrite=True"):
        sh.save_structure(model, path)
    assert sh.save_structure(model, path, overwrite=True) == path
    with pytest.raises(ValueError, match=r"ending in \.h5"):
        sh.save_structure(model, tmp_path / "rod.nc")
    with pytest.raises(TypeError, match="expected a Model"):
        sh.save_structure(3, tmp_path / "three.h5")


def test_damaged_and_other_files(tmp_path):
    path = sh.save_structure(sh.Model(*rods.matrices()), tmp_path / "rod.h5")
    with netCDF4.Dataset(path, "a") as file:
        file["stiffness"]["indices"][0] = 99
    with pytest.raises(ValueError, match="truncated, damaged, or no HDF5 file") as caught:
        sh.read_structure(path)
    assert "\n" not in str(caught.value)
    rods.halved(path, 0.3)
    with pytest.raises(ValueError, match="truncated, damaged, or no HDF5 file"):
        sh.read_structure(path)
    path.write_text("something else")
    with pytest.raises(ValueError, match="no HDF5 file"):
        sh.read_structure(path)
    with netCDF4.Dataset(path, "w") as file:
        file.createGroup("results")
    with pytest.raises(ValueError, match="it holds none"):
        sh.read_structure(path)
