"""HDF5 files: written and read, those of others, truncated ones."""

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
        sh.save_structure(model, tmp_path / "rod.mtx")
    with pytest.raises(TypeError, match="expected a Model"):
        sh.save_structure(3, tmp_path / "three.h5")


@pytest.mark.parametrize(
    "rule",
    [
        sh.StructuralDamping(0.03),
        sh.RayleighDamping(1.0, 1e-6),
        sh.ModalDamping((0.01, 0.02)),
        sh.ModalDamping(0.01, modes=2),
    ],
)
def test_damping_by_a_rule_comes_back(rule, tmp_path):
    mass, _, stiffness = rods.matrices()
    model = sh.Model(mass, rule, stiffness)
    again = sh.read_structure(sh.save_structure(model, tmp_path / "rod.h5"))
    assert again.damping == rule
    natural = sh.natural_modes(model).frequency.values[0]
    found, expected = (
        sh.solve(sh.HarmonicBalance(each, sh.forces.PointForce(0)), natural).amplitude.values
        for each in (again, model)
    )
    np.testing.assert_allclose(found, expected, rtol=1e-13)


def dense(matrix):
    return matrix.toarray() if hasattr(matrix, "toarray") else np.array(matrix)


def test_what_no_matrix_tells_is_not_saved(tmp_path):
    mass, _, stiffness = map(dense, rods.matrices())
    skew = np.zeros_like(stiffness)
    skew[0, 1], skew[1, 0] = 1e-3, -1e-3
    runs = {0: stiffness, 100: 1.1 * stiffness}
    rotor = sh.RotatingModel(sh.Model(mass, sh.ModalDamping(0.01), stiffness), runs, coriolis=skew)
    with pytest.raises(TypeError, match="beside Coriolis forces"):
        sh.save_structure(rotor.at(50), tmp_path / "rotor.h5")
    still = rotor.at(50)
    whole = sh.Model(mass, still.damping_matrix, still.stiffness_matrix)
    again = sh.read_structure(sh.save_structure(whole, tmp_path / "rotor.h5"))
    difference = again.damping_matrix - still.damping_matrix
    assert abs(difference).max() == 0


@pytest.mark.parametrize("suffix", [".h5", ".nc"])
def test_what_turns_comes_back_with_its_speeds(tmp_path, suffix):
    mass, damping, stiffness = map(dense, rods.matrices())
    skew = np.zeros_like(stiffness)
    skew[0, 1], skew[1, 0] = 1e-3, -1e-3
    runs = {0: stiffness, 100: 1.1 * stiffness, 250: 1.3 * stiffness}
    for rule, coriolis in ((damping, skew), (sh.RayleighDamping(1.0), None)):
        model = sh.Model(mass, rule, stiffness, places=rods.places())
        rotor = sh.RotatingModel(model, runs, coriolis=coriolis)
        path = sh.save_structure(rotor, tmp_path / f"rotor{suffix}", overwrite=True)
        again = rods.read(path)
        assert isinstance(again, sh.RotatingModel)
        assert again.speeds == rotor.speeds
        assert again.number_of("tip:y") == rotor.number_of("tip:y")
        for speed in (0, 170):
            one, other = again.at(speed), rotor.at(speed)
            for name in ("mass", "damping", "stiffness"):
                given, expected = (getattr(each, f"{name}_matrix") for each in (one, other))
                off = abs(given - expected).max()
                assert off <= 1e-14 * abs(expected).max()
