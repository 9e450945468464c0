"""Builders against hand-written matrices, stuck rings against their closed form."""

import json
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

import symhbm as sh
from tests.problems import rub

EXACT = json.loads(
    (Path(__file__).parent.parent.parent / "data" / "reference" / "exact_values.json").read_text()
)
VALUES = dict(mass=1.0, stiffness=1e4, damping=0.5, **rub(1e6, 0.4, 10.0))
MATRICES = ("mass_matrix", "damping_matrix", "stiffness_matrix")
FREE = dict(contact_stiffness=1.0, friction_coefficient=1.0, normal_load=0.0)
UNEVEN = {name: value * np.array([1.0, 1.1, 0.9, 1.2]) for name, value in VALUES.items()}


def assert_same(model, other):
    assert model.contacts == other.contacts
    assert model.lumped == other.lumped
    for name in MATRICES:
        np.testing.assert_array_equal(
            getattr(model, name).toarray(), getattr(other, name).toarray()
        )
    assert model.parameters.keys() == other.parameters.keys()
    for name, value in model.parameters.items():
        np.testing.assert_array_equal(value, other.parameters[name])


def test_blade_is_as_written_by_hand():
    blade = sh.single_blade(**VALUES)
    hand = sh.Model([[1.0]], [[0.5]], [[1e4]], contacts=[(0,)], **rub(1e6, 0.4, 10.0), lumped=True)
    assert_same(blade, hand)
    assert blade.mass_matrix.toarray().tolist() == [[1.0]]
    assert blade.directions.toarray().tolist() == [[1.0]]


def test_ring_is_as_written_by_hand():
    ring = sh.bladed_disk(4, **UNEVEN)
    assert ring.contacts == ((0, 1), (1, 2), (2, 3), (3, 0))
    assert ring.directions.toarray().tolist() == [
        [1, -1, 0, 0],
        [0, 1, -1, 0],
        [0, 0, 1, -1],
        [-1, 0, 0, 1],
    ]
    for name in ("mass", "damping", "stiffness"):
        matrix = getattr(ring, f"{name}_matrix").toarray()
        np.testing.assert_array_equal(matrix, np.diag(UNEVEN[name]))
    for name in ("contact_stiffness", "friction_coefficient", "normal_load"):
        np.testing.assert_array_equal(getattr(ring, name), UNEVEN[name])


def test_contacts_join_two_degrees_of_freedom_or_one_and_the_ground():
    model = sh.Model(np.eye(3), np.eye(3), np.eye(3), contacts=[(2, 0), (1,), (2,)], **FREE)
    assert model.contacts == ((2, 0), (1,), (2,))
    assert model.directions.toarray().tolist() == [[-1, 0, 1], [0, 1, 0], [0, 0, 1]]
    free = sh.Model(np.eye(3), np.eye(3), np.eye(3))
    assert free.n_contacts == 0
    assert free.directions.shape == (0, 3)


def stuck_frequencies(model):
    """Natural frequencies [Hz] with every contact held by its spring."""
    w = model.directions.toarray()
    stiffness = model.stiffness_matrix.toarray() + w.T @ np.diag(model.contact_stiffness) @ w
    scale = 1 / np.sqrt(model.parameters["mass"])
    return np.sqrt(np.linalg.eigvalsh(scale[:, None] * stiffness * scale)) / (2 * np.pi)


@pytest.mark.parametrize("contact_stiffness", EXACT["ring_natural_hz"])
def test_natural_frequencies_of_the_paper(contact_stiffness):
    ring = sh.bladed_disk(13, **VALUES | {"contact_stiffness": float(contact_stiffness)})
    published = np.array([float(hz) for hz in EXACT["ring_natural_hz"][contact_stiffness]])
    # Nodal diameter 0 is single, the others are pairs.
    expected = np.sort(np.concatenate([published, published[1:]]))
    np.testing.assert_allclose(stuck_frequencies(ring), expected, rtol=1e-10)


@pytest.mark.parametrize("name", VALUES)
def test_one_value_or_one_per_blade_or_contact(name):
    ring = sh.bladed_disk(4, **VALUES)
    assert_same(ring, sh.bladed_disk(4, **VALUES | {name: [VALUES[name]] * 4}))
    assert_same(ring, ring.with_parameters(**{name: np.full(4, VALUES[name])}))
    assert ring.parameters[name].tolist() == [VALUES[name]] * 4
    uneven = ring.with_parameters(**{name: [1, 2, 3, 4]})
    assert uneven.parameters[name].tolist() == [1.0, 2.0, 3.0, 4.0]


def test_zero_values_keep_their_places():
    ring = sh.bladed_disk(3, **VALUES | {"damping": 0, "stiffness": [0, 1, 0]})
    assert ring.parameters["damping"].tolist() == [0.0, 0.0, 0.0]
    assert ring.parameters["stiffness"].tolist() == [0.0, 1.0, 0.0]
    assert ring.with_parameters(damping=[1, 0, 3]).parameters["damping"].tolist() == [1, 0, 3]


def test_with_parameters_leaves_the_original():
    ring = sh.bladed_disk(4, **VALUES)
    other = ring.with_parameters(mass=2, normal_load=[1, 2, 3, 4])
    assert_same(ring, sh.bladed_disk(4, **VALUES))
    assert_same(other, sh.bladed_disk(4, **VALUES | {"mass": 2.0, "normal_load": [1, 2, 3, 4]}))
    assert ring.with_parameters() is not ring
    assert_same(ring.with_parameters(), ring)


def test_names_of_the_parameters():
    assert set(sh.bladed_disk(3, **VALUES).parameters) == {*VALUES, "cubic_stiffness"}
    general = sh.Model(np.eye(2), np.eye(2), np.eye(2), contacts=[(0, 1)], **FREE)
    contact = {"contact_stiffness", "friction_coefficient", "normal_load", "cubic_stiffness"}
    assert set(general.parameters) == contact
    assert general.with_parameters(normal_load=3).normal_load.tolist() == [3.0]


def test_arrays_of_the_caller_stay_theirs():
    matrix, loads, sparse = np.eye(2), np.ones(2), sp.csc_array(np.eye(2))
    model = sh.Model(matrix, sparse, matrix, contacts=[(0,), (1,)], **FREE | {"normal_load": loads})
    for given in (matrix[0], loads, sparse.data):
        given[0] = 7.0
    assert model.mass_matrix[0, 0] == model.damping_matrix[0, 0] == model.normal_load[0] == 1.0


def test_repr_has_sizes_and_values():
    text = repr(sh.bladed_disk(5, **VALUES | {"normal_load": [1, 2, 3, 4, 7]}))
    for part in ("5 lumped blades", "5 contacts", "0.5 N s/m", "10000 N/m", "1e+06 N/m"):
        assert part in text
    assert "1 .. 7 N" in text
    assert "friction_coefficient  0.4" in text
    text = repr(sh.Model(np.eye(2), np.eye(2), np.eye(2)))
    assert text == "Model: 2 degrees of freedom, 0 contacts"


def test_entries_given_twice_add_up():
    twice = sp.coo_array(([1.0, 2.0, 5.0], ([0, 0, 1], [0, 0, 1])), shape=(2, 2))
    model = sh.Model(twice, twice, twice)
    assert model.mass_matrix.toarray().tolist() == [[3.0, 0.0], [0.0, 5.0]]


def mass_model(mass):
    size = mass.shape[0]
    return sh.Model(mass, 0.5 * sp.eye_array(size), 1e4 * sp.eye_array(size))


def consistent(n, sign=1.0):
    """Masses of ``n`` bilinear squares a side, whose rows are not led by their diagonals."""
    line = sp.diags_array(
        [np.full(n, 1.0), np.full(n + 1, 4.0), np.full(n, 1.0)], offsets=[-1, 0, 1]
    )
    return sp.csc_array(sp.kron(line, line) * sign)


@pytest.mark.parametrize("n", [4, 40])
def test_mass_matrices_of_finite_elements(n):
    """Small and large: definite ones, ones without inertia somewhere, and one wrong entry."""
    mass = consistent(n).tolil()
    mass_model(mass)
    free = mass.copy()
    free[3, :] = free[:, 3] = 0.0
    mass_model(free)
    wrong = mass.copy()
    wrong[n // 2, n // 2 + 1] = wrong[n // 2 + 1, n // 2] = 30.0
    with pytest.raises(ValueError, match=r"mass_matrix: .*negative kinetic energy"):
        mass_model(wrong)
    half = mass.copy()
    half[3, 3] = 0.0
    with pytest.raises(ValueError, match=r"mass_matrix: .*entry \(3, 3\) of its diagonal is 0"):
        mass_model(half)


def test_semidefinite_masses_are_let_pass_where_no_inertia_is_needed():
    """A rod without rotary inertia: its balance is that of the mass on what is left to it."""
    stiffness = np.array([[2e4, -1e4], [-1e4, 2e4]])
    contact = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=1.0)
    rod = sh.Model(np.diag([1.0, 0.0]), 0 * np.eye(2), stiffness, [(0,)], **contact)
    mass = sh.Model([[1.0]], [[0.0]], [[1.5e4]], [(0,)], **contact)
    rod, mass = (
        sh.HarmonicBalance(m, sh.forces.PointForce(amplitude=1.0), (1, 3)) for m in (rod, mass)
    )
    found, expected = (sh.frf(p, (10, 18), at=[10.0, 15.0], throw=True) for p in (rod, mass))
    amplitude = found.amplitude.isel(dof=0)
    np.testing.assert_allclose(amplitude, expected.amplitude.isel(dof=0), rtol=1e-9)
    assert found.peak_amplitude.values == pytest.approx(expected.peak_amplitude.values, rel=1e-9)
    assert int(sh.solve(rod, 15.0, stability=True).stability) == -1
    refusals = (
        lambda: sh.periodic_motion(rod, 15.0),
        lambda: sh.minimise_peak(rod, "normal_load", (1, 2), progress=False),
    )
    for call in refusals:
        with pytest.raises(
            ValueError, match=r"mass matrix is positive definite|mass_matrix: expec"
        ):
            call()


@pytest.mark.parametrize("share", [1.0, 1 + 1e-6, 2.0])
def test_masses_that_only_round_off_keeps_definite(share):
    model = [[1.0, 1.0], [1.0, 1.0]] if share == 1 else [[1.0, share], [share, 1.0]]
    if share > 1:
        with pytest.raises(ValueError, match="negative kinetic energy"):
            sh.Model(model, np.eye(2), 1e3 * np.eye(2))
        return
    singular = sh.Model(np.array(model) / 3 + 1e-17 * np.eye(2), np.eye(2), 1e3 * np.eye(2))
    with pytest.raises(ValueError, match="mass_matrix: expected a positive definite"):
        sh.periodic_motion(sh.HarmonicBalance(singular, sh.forces.PointForce()), 1.0)
