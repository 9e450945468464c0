"""Events of dry friction by the compiled loop: against dense samples, closed forms, and itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from symhbm.model.contacts.coulomb.located import locate, stick_intervals
from symhbm.numerics.fourier import FourierBasis


@settings(max_examples=30)
@given(st.floats(-17, -0.01), st.floats(0, 2 * np.pi), st.sampled_from([(1, 3), (0, 1, 2)]))
def test_one_harmonic_among_others_has_its_closed_form(decades, phase, harmonics):
    """Down to stretches of stick that differences of displacements no longer resolve."""
    first, basis = FourierBasis((1,)), FourierBasis(harmonics)
    wave, motion = np.array([np.cos(phase), np.sin(phase)]), np.zeros(basis.n_components)
    part = slice(basis.component(1), basis.component(1) + 2)
    motion[part] = wave
    limit = np.array([10.0**decades])
    closed = locate(first, wave[None], np.ones(1), limit)
    found = locate(basis, motion[None], np.ones(1), limit)
    np.testing.assert_allclose(np.sin(found.theta_0 - closed.theta_0), 0, atol=1e-14)
    np.testing.assert_allclose(found.stick_fraction, closed.stick_fraction, rtol=1e-8, atol=3e-13)
    np.testing.assert_allclose(found.vector[:, part], closed.vector, atol=1e-12)
    np.testing.assert_allclose(found.matrix[:, part, part], closed.matrix, atol=1e-12)
    np.testing.assert_allclose(found.slip_margin, closed.slip_margin, rtol=1e-14)
    np.testing.assert_allclose(
        found.slip_margin_gradient[:, part], closed.slip_margin_gradient, atol=1e-14
    )


def test_short_stretches_of_stick_keep_their_digits():
    """A stiff contact sticks until its motion has gone ``2 g / k_d``."""
    basis, rng = FourierBasis((1, 2)), np.random.default_rng(3)
    waves, limit = rng.normal(size=(300, 4)), 10 ** rng.uniform(-9, -5, 300)
    contact, begin, end = stick_intervals(basis, waves, np.ones(300), limit)
    turn = basis.values((begin + end) / 2, 1)
    # Differences of waves as products, of the angles' difference.
    half = np.sin(np.outer((end - begin) / 2, basis.order)) * 2 / basis.order
    travel = (turn * half * waves[contact]).sum(axis=1)
    first = np.append(True, np.diff(contact) > 0)
    np.testing.assert_allclose(np.abs(travel[first]), 2 * limit, rtol=5e-9)


def test_a_mean_changes_nothing_and_too_small_a_motion_is_none():
    basis, wave = FourierBasis((0, 1, 2)), np.array([0.0, 1.0, 0.4, 0.3, 0.1])
    waves = np.stack([wave, wave + 1e6 * (basis.order == 0), wave * 1e-160])
    found = locate(basis, waves, np.ones(3), np.full(3, 0.3))
    assert found.slip_margin[0] == found.slip_margin[1]
    np.testing.assert_array_equal(found.matrix[0], found.matrix[1])
    assert found.reversals.tolist()[1:] == [2, 0]
    assert found.slip_margin[2] == -np.inf
    assert not found.slip_margin_gradient[2].any()


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
@pytest.mark.parametrize("component", [0, 2])
def test_motions_that_are_not_finite_are_refused(wrong, component):
    waves = np.ones((2, 5))
    waves[1, component] = wrong
    with pytest.raises(FloatingPointError, match="not finite"):
        stick_intervals(FourierBasis((0, 1, 2)), waves, np.ones(2), np.ones(2))
