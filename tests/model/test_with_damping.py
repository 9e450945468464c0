"""Damping that is given later, or to a file; files that lack a matrix."""

import numpy as np
import pytest
import scipy.io

import symhbm as sh
from tests.refusals import refused

MASS, STIFFNESS = np.diag([1.0, 2.0]), np.array([[3e4, -1e4], [-1e4, 2e4]])
RUB = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3.0)


def model(damping, **more):
    return sh.Model(MASS, damping, STIFFNESS, contacts=[(0, 1)], **RUB, **more)


@pytest.mark.parametrize(
    "damping", [sh.ModalDamping(0.01), np.diag([1.0, 2.0]), sh.StructuralDamping(0.02)]
)
@pytest.mark.parametrize("before", [np.zeros((2, 2)), sh.RayleighDamping(0.1, 1e-4)])
def test_a_copy_is_the_model_with_that_damping(before, damping):
    first = model(before)
    point = sh.HarmonicBalance(first.with_damping(damping), sh.forces.PointForce(0, 5.0))
    expected = sh.HarmonicBalance(model(damping), sh.forces.PointForce(0, 5.0))
    np.testing.assert_array_equal(
        sh.solve(point, 25.0).coefficient, sh.solve(expected, 25.0).coefficient
    )
    assert repr(point.model) == repr(expected.model)
    # The model itself stays as it is.
    np.testing.assert_array_equal(
        first.damping_matrix.toarray(), model(before).damping_matrix.toarray()
    )


BLADE = sh.single_blade(mass=1, stiffness=1e4, damping=0.5, **RUB)
test_blades_are_told_what_their_damping_is = refused([
    (lambda: BLADE.with_damping(sh.ModalDamping(0.01)), TypeError, "the parameter damping"),
    (lambda: model(np.zeros((2, 2))).with_damping(np.eye(3)), ValueError, r"damping_matrix"),
])  # fmt: skip


def test_files_take_damping_and_list_what_they_have(tmp_path):
    scipy.io.mmwrite(tmp_path / "rod_mass.mtx", MASS)
    scipy.io.mmwrite(tmp_path / "rod_stiffness.mtx", STIFFNESS)
    rod = sh.read_structure(tmp_path / "rod.mtx", damping=sh.ModalDamping(0.01))
    ratios = np.diag(rod.damping_matrix.toarray())
    np.testing.assert_allclose(
        ratios, np.diag(model(sh.ModalDamping(0.01)).damping_matrix.toarray())
    )
    path = tmp_path / "other.npz"
    np.savez(path, M=MASS, KLL=STIFFNESS, D=np.eye(2))
    found = sh.read_structure(path, names={"stiffness": "KLL"}, damping=2 * np.eye(2))
    np.testing.assert_array_equal(found.stiffness_matrix.toarray(), STIFFNESS)
    np.testing.assert_array_equal(found.damping_matrix.toarray(), 2 * np.eye(2))
