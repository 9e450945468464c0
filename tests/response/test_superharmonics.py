"""Forces and modes of truncated harmonics."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.model.contacts.coulomb.located import locate
from symhbm.numerics.fourier import FourierBasis
from symhbm.response.accuracy.superharmonics import friction_beyond
from tests.quick import quick_first


@pytest.mark.parametrize("harmonics", [(1,), (3,), (1, 3, 5), (0, 1, 2, 3), (0, 2)])
def test_forces_are_those_of_a_larger_basis(harmonics):
    rng = np.random.default_rng(7)
    basis, wide = FourierBasis(harmonics), FourierBasis(tuple(range(20)))
    coefficients = rng.normal(size=(9, basis.n_components)) / (1 + basis.order) ** 2
    stiffness, limit = 10 ** rng.uniform(-1, 1, 9), rng.uniform(0, 0.5, 9)
    limit[:2], stiffness[2], limit[3] = [0.0, 1e-3], 0.0, 50.0
    beyond = np.array([n for n in range(1, 20) if n not in harmonics])
    embedded = np.zeros((9, wide.n_components))
    for n in harmonics:
        embedded[:, wide.order == n] = coefficients[:, basis.order == n]
    law = locate(wide, embedded, stiffness, limit)
    force = stiffness[:, None] * np.einsum("cij,cj->ci", law.matrix, embedded)
    force += limit[:, None] * law.vector
    forces, share = friction_beyond(basis, coefficients, stiffness, limit, beyond)
    for n, column in zip(beyond, forces.T, strict=True):
        cosine, sine = (force[:, wide.component(int(n), s)] for s in (False, True))
        # Round-off of forces of size one.
        np.testing.assert_allclose(column, cosine - 1j * sine, atol=1e-12)
    diagonal = np.einsum("cii->ci", law.matrix)
    for n, column in zip(beyond, share.T, strict=True):
        pair = [wide.component(int(n), s) for s in (False, True)]
        moving = stiffness > 0
        np.testing.assert_allclose(
            column[moving], diagonal[moving][:, pair].mean(axis=1), atol=1e-9
        )


def blade_and_mode(ratio, damping_ratio, normal_load):
    """One blade on a contact, and a light mass on it whose mode has ``ratio`` times 20 Hz."""
    light, turn = 0.05, 2 * np.pi * 20.0 * ratio
    spring, damper = light * turn**2, 2 * damping_ratio * light * turn
    couple = np.array([[1.0, -1.0], [-1.0, 1.0]])
    return sh.HarmonicBalance(
        sh.Model(
            np.diag([1.0, light]),
            np.diag([0.5, 0.0]) + damper * couple,
            np.diag([1e4, 0.0]) + spring * couple,
            contacts=[(0,)],
            contact_stiffness=1e4,
            friction_coefficient=0.5,
            normal_load=normal_load,
        ),
        sh.forces.PointForce(amplitude=1.0),
    )


@pytest.mark.parametrize(
    ("ratio", "damping_ratio"),
    quick_first([(3, 1e-5), (15, 1e-3), (3, 1e-3), (7, 1e-3), (7, 1e-5), (15, 1e-5)], 2),
)
def test_narrow_resonances_of_any_harmonic_are_found(ratio, damping_ratio):
    """Every peak of many harmonics is there, though one harmonic suffices around it."""
    problem = blade_and_mode(ratio, damping_ratio, normal_load=6.0)
    band = (18.5, 24.0)
    many = sh.HarmonicBalance(problem.model, problem.excitation, range(1, 28, 2))
    expected = sh.frf(many, band, peaks="each")
    accuracy = 0.01
    response = sh.frf(problem, band, peaks="each", accuracy=accuracy)
    assert response.status.item() == sh.Status.REACHED_END
    assert response.highest_harmonic.min() == 1
    others = list(zip(response.peak_dof.values, response.peak_frequency.values, strict=True))
    n_checked = 0
    for dof, hertz, top in zip(
        expected.peak_dof.values,
        expected.peak_frequency.values,
        expected.peak_amplitude.values,
        strict=True,
    ):
        near = np.argmin([abs(f - hertz) + 100 * (d != dof) for d, f in others])
        assert response.peak_amplitude.values[near] == pytest.approx(top, rel=accuracy)
        n_checked += 1
    assert n_checked >= 1
