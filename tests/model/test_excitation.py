"""Forces evaluated in time against their formulas, and what they do to a linear structure."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import symhbm as sh
from symhbm.model import force_coefficients
from symhbm.numerics.fourier import FourierBasis

TAU = np.linspace(0, 2 * np.pi, 50)
BASIS = FourierBasis((0, 1, 2, 3))


def force(excitation, n_dof, basis=BASIS, tau=TAU):
    """Force on every degree of freedom at the angles omega t, (n_dof, n_times)."""
    shape = excitation.shape(n_dof, basis)
    assert shape.shape == (n_dof, basis.n_components)
    return force_coefficients(excitation, n_dof, basis) @ basis.values(tau).T


@pytest.mark.parametrize("n_blades", [3, 4, 13])
@pytest.mark.parametrize("order", [0, 1, 2, 6, -1, 20])
@pytest.mark.parametrize("harmonic", [1, 3])
def test_engine_order_is_a_travelling_wave(n_blades, order, harmonic):
    """F_i = f0 cos(omega t - 2 pi EO i / N), Eq. (12)."""
    found = force(sh.forces.EngineOrder(order, amplitude=2.5, harmonic=harmonic), n_blades)
    lag = 2 * np.pi * order * np.arange(n_blades) / n_blades
    expected = 2.5 * np.cos(harmonic * TAU - lag[:, None])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_engine_order_on_chosen_degrees_of_freedom():
    found = force(sh.forces.EngineOrder(1, places=(4, 0, 2)), 5)
    whole = force(sh.forces.EngineOrder(1), 3)
    np.testing.assert_array_equal(found[[4, 0, 2]], whole)
    assert not found[[1, 3]].any()


@given(
    n=st.integers(1, 40),
    order=st.integers(-1000, 1000),
    turns=st.integers(-1000, 1000) | st.sampled_from([10**17, 10**30, -(10**18)]),
)
def test_aliased_orders_are_the_same_force_to_the_bit(n, order, turns):
    wave, alias = (sh.forces.EngineOrder(eo).shape(n, BASIS) for eo in (order, order + turns * n))
    np.testing.assert_array_equal(wave, alias)


@given(n=st.integers(1, 40), order=st.integers(-1000, 1000))
def test_complementary_orders_mirror_the_blades(n, order):
    wave, mirrored = (sh.forces.EngineOrder(eo).shape(n, BASIS) for eo in (order, n - order))
    np.testing.assert_array_equal(mirrored, wave[-np.arange(n) % n])


@pytest.mark.parametrize("phase", [0.0, 0.7, np.pi / 2, -2.0])
@pytest.mark.parametrize("harmonic", [1, 2])
def test_point_force(phase, harmonic):
    found = force(sh.forces.PointForce(place=1, amplitude=3.0, phase=phase, harmonic=harmonic), 3)
    expected = 3.0 * np.cos(harmonic * TAU + phase)
    np.testing.assert_allclose(found[1], expected, rtol=0, atol=1e-14)
    assert not found[[0, 2]].any()


def test_harmonic_force():
    excitation = sh.forces.HarmonicForce(
        cosine={0: [1.0, 2.0], 2: [0.5, 0.0]}, sine={1: [0.0, 4.0]}, amplitude=10.0
    )
    found = force(excitation, 2)
    np.testing.assert_allclose(found[0], 10 * (1 + 0.5 * np.cos(2 * TAU)), atol=1e-13)
    np.testing.assert_allclose(found[1], 10 * (2 + 4 * np.sin(TAU)), atol=1e-13)


def test_harmonic_force_says_what_the_others_say():
    point = sh.forces.PointForce(place=0, phase=0.3)
    same = sh.forces.HarmonicForce(cosine={1: [np.cos(0.3), 0]}, sine={1: [-np.sin(0.3), 0]})
    np.testing.assert_array_equal(point.shape(2, BASIS), same.shape(2, BASIS))
    without_mean = force(point, 2, FourierBasis((1, 3)))
    np.testing.assert_allclose(without_mean, force(same, 2), atol=1e-15)
    alone = sh.forces.HarmonicForce(sine={1: 2.0}).shape(1, BASIS)
    assert alone.tolist() == [[0, 0, 2, 0, 0, 0, 0]]
