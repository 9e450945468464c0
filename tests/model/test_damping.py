"""Damping by modal ratios, by shares of mass and stiffness, and by a loss factor."""

import sys

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose
from scipy.linalg import eigh

import symhbm as sh
from symhbm.model import damping
from symhbm.model.linear import LowRankSum
from tests.refusals import refused

N = 40
MASS = sp.eye_array(N)
STIFFNESS = 1e4 * (2 * MASS - sp.eye_array(N, k=1) - sp.eye_array(N, k=-1))
CONTACTS = dict(
    contacts=[(N - 1,), (3, 5)], contact_stiffness=1e4, friction_coefficient=0.5, normal_load=0.5
)
RATIOS = np.linspace(0.01, 0.05, 12)
FORCE = sh.forces.PointForce(place=20)
RAD = 2 * np.pi * 1.3


def chain(given):
    return sh.Model(MASS, given, STIFFNESS, **CONTACTS)


def by_definition(stiffness, mass, ratios):
    ratios = np.array(ratios)
    squares, shapes = eigh(stiffness, mass)
    n = len(ratios)
    momentum = mass @ shapes[:, :n]
    return momentum @ np.diag(2 * ratios * np.sqrt(squares[:n])) @ momentum.conj().T


@pytest.fixture
def in_factors(monkeypatch):
    monkeypatch.setattr(damping, "DENSE_LIMIT", 10)
    model = chain(sh.ModalDamping(RATIOS))
    assert isinstance(model.damping_matrix, LowRankSum)
    return model


def test_modal_damping_of_a_model_is_its_definition():
    expected = by_definition(STIFFNESS.toarray(), np.eye(N), RATIOS)
    found = chain(sh.ModalDamping(RATIOS)).damping_matrix.toarray()
    assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())
    same = chain(sh.ModalDamping(0.02, modes=5)).damping_matrix.toarray()
    assert_allclose(same, by_definition(STIFFNESS.toarray(), np.eye(N), [0.02] * 5), atol=1e-10)


def test_modal_damping_condenses_massless_degrees_of_freedom():
    mass = np.diag([1.0, 0.0, 2.0])
    stiffness = 1e4 * np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
    held = stiffness[[0, 2]][:, [0, 2]] - np.outer(stiffness[[0, 2], 1], stiffness[1, [0, 2]]) / 2e4
    expected = by_definition(held, mass[[0, 2]][:, [0, 2]], [0.01, 0.01])
    found = sh.Model(mass, sh.ModalDamping(0.01), stiffness).damping_matrix.toarray()
    assert_allclose(found[[0, 2]][:, [0, 2]], expected, atol=1e-10)
    assert not found[1].any()


def softened(by, n=N):
    """A chain whose squares of frequencies are all less by the same."""
    mass = sp.eye_array(n)
    return mass, 1e4 * (2 * mass - sp.eye_array(n, k=1) - sp.eye_array(n, k=-1)) - by * mass


@pytest.mark.parametrize(
    ("n", "rule"), [(N, sh.ModalDamping(0.01)), (600, sh.ModalDamping(0.01, 3))]
)
def test_a_motion_that_grows_has_no_damping_ratio(n, rule):
    """Above a critical speed; it was left without damping. Growing ones need not be next to 0."""
    mass, stiffness = softened(1.5e4, n)
    model = sh.Model(mass, rule, stiffness)
    with pytest.raises(
        ValueError, match=r"damping=ModalDamping.*no damping ratio; give a Rayleigh"
    ):
        assert model.damping_matrix.shape
    with pytest.raises(ValueError, match="one grows, and has no natural frequency"):
        sh.natural_modes(model, count=3)


@pytest.mark.parametrize("n", [N, 600])
def test_a_free_motion_has_no_damping_by_its_ratio(n):
    """Its square is 0 but for the round-off of a file, of either sign."""
    mass, stiffness = softened(1e-7, n)
    stiffness = sp.lil_array(stiffness)
    stiffness[0, 0] = stiffness[n - 1, n - 1] = 1e4 - 1e-7
    damping = sh.Model(mass, sh.ModalDamping(0.01, 3), stiffness).damping_matrix
    assert np.abs(damping @ np.ones(n)).max() < 1e-4 * np.abs(damping @ np.arange(n)).max()
    assert sh.natural_modes(sh.Model(mass, mass, stiffness), count=3).frequency[0] < 1e-4


def test_rayleigh_damping_is_a_sum():
    found = chain(sh.RayleighDamping(0.5, 1e-5)).damping_matrix
    assert abs(found - (0.5 * MASS + 1e-5 * STIFFNESS)).max() < 1e-15


def test_modal_damping_in_factors_is_the_matrix(in_factors):
    expected = by_definition(STIFFNESS.toarray(), np.eye(N), RATIOS)
    scale = np.abs(expected).max()
    found = in_factors.damping_matrix
    assert_allclose(found.toarray(), expected, atol=1e-10 * scale)
    assert_allclose(found.diagonal(), expected.diagonal(), atol=1e-10 * scale)
    assert_allclose(found[[1, 4]][:, [0, 7]].toarray(), expected[[1, 4]][:, [0, 7]], atol=1e-9)
    with pytest.raises(TypeError, match=r"condense or symhbm\.craig_bampton"):
        sh.HarmonicBalance(in_factors, FORCE)


def test_condensed_factors_agree_with_the_full_matrix(in_factors):
    small = sh.condense(in_factors, FORCE, (0.5, 2), (1, 3), places=[7])
    full = chain(by_definition(STIFFNESS.toarray(), np.eye(N), RATIOS))
    for harmonic in (1, 3):
        whole = np.linalg.inv(full.dynamic_stiffness(harmonic, RAD)[0])
        exact = np.linalg.inv(whole[np.ix_(small.dofs, small.dofs)])
        found = small.dynamic_stiffness(harmonic, RAD)[0]
        assert np.abs(found - exact).max() < 1e-10 * np.abs(exact).max()
    problem = sh.HarmonicBalance(small, FORCE, (1, 3))
    point = sh.datasets.recover(problem, sh.solve(problem, 1.3))
    truth = sh.solve(sh.HarmonicBalance(full, FORCE, (1, 3)), 1.3)
    difference = np.abs(point.coefficient - truth.coefficient.values).max()
    assert difference < 1e-9 * np.abs(truth.coefficient).max()


def test_a_loss_factor_condensed_agrees_with_the_whole():
    model = chain(sh.StructuralDamping(0.03))
    problem = sh.HarmonicBalance(model, FORCE, (1, 3))
    small = sh.condense(model, FORCE, (0.5, 2), (1, 3), places=[7])
    condensed = sh.HarmonicBalance(small, FORCE, (1, 3))
    whole, point = (sh.solve(each, 1.3) for each in (problem, condensed))
    difference = np.abs(point.coefficient - whole.coefficient.values[small.dofs]).max()
    assert difference < 1e-10 * np.abs(whole.coefficient).max()
    assert float(sh.datasets.recover(condensed, point).residual_norm) < 1e-12


def test_a_loss_factor_is_complex_stiffness():
    value, slope = chain(sh.StructuralDamping(0.03)).dynamic_stiffness(3, RAD)
    assert_allclose(value.imag, 0.03 * STIFFNESS.toarray(), atol=1e-12)
    assert not slope.imag.any()
    assert not chain(sh.StructuralDamping(0.03)).dynamic_stiffness(0, 0.0)[0].imag.any()


def sector(given, limit=None):
    stiffness = 1e4 * np.array([[3.0, -1, 0, -1], [-1, 3, -2, 0], [0, -2, 2.5, 0], [-1, 0, 0, 1]])
    model = sh.Model(np.diag([1.0, 0.5, 0.7, 0.0]), given, stiffness)
    return sh.Sector(model, left=[0], right=[3], n_sectors=6)


def test_the_ring_has_the_same_modal_damping(monkeypatch):
    disk = sector(sh.ModalDamping([0.01, 0.02]))
    force = sh.forces.EngineOrder(2, pattern={1: 1.0, 2: 0.5j})
    alone = sh.solve(sh.HarmonicBalance(disk, force, (1,)), 20.0)
    ring = sh.mistuned_ring(disk)
    whole = sh.solve(sh.HarmonicBalance(ring, force, (1,)), 20.0)
    assert_allclose(whole.coefficient[:3], alone.coefficient, atol=1e-12)
    monkeypatch.setattr(sys.modules["symhbm.model.reduction.mistuned_ring"], "DENSE_LIMIT", 1)
    factors = sh.mistuned_ring(disk).damping_matrix
    assert isinstance(factors, LowRankSum)
    assert_allclose(factors.toarray(), ring.damping_matrix.toarray(), atol=1e-10)


def test_natural_modes_know_all_forms(in_factors):
    frequencies = sh.natural_modes(in_factors, count=3).frequency.values
    squares = eigh(STIFFNESS.toarray(), eigvals_only=True)[:3]
    assert_allclose(frequencies, np.sqrt(squares) / (2 * np.pi), rtol=1e-9)


test_bad_damping_is_refused = refused([
    (lambda: sh.ModalDamping(-0.1), ValueError, "ratio"),
    (lambda: sh.ModalDamping([0.1, 0.2], modes=3), ValueError, "expected 2"),
    (lambda: sh.ModalDamping([[0.1]]), ValueError, "one value or one per mode"),
    (lambda: sh.RayleighDamping(-1.0), ValueError, "mass"),
    (lambda: sh.RayleighDamping(0.0, "much"), TypeError, "stiffness"),
    (lambda: sh.StructuralDamping(-0.1), ValueError, "loss_factor"),
    (lambda: chain(sh.ModalDamping(0.1, modes=N + 1)).damping_matrix, ValueError, f"at most {N}"),
    (lambda: sh.periodic_motion(sh.HarmonicBalance(chain(sh.StructuralDamping(0.03)), FORCE), 1.3),
     TypeError, "a loss factor is of forced responses alone"),
])  # fmt: skip


def test_many_degrees_of_freedom_need_a_number_of_modes(monkeypatch):
    monkeypatch.setattr(damping, "DENSE_LIMIT", 10)
    with pytest.raises(ValueError, match="number of damped modes for 40"):
        _ = chain(sh.ModalDamping(0.01)).damping_matrix
