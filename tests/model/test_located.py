"""Events of dry friction by the compiled loop: against dense samples, closed forms, and itself."""

from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from symhbm.model.contacts.coulomb.located import locate, stick_intervals
from symhbm.model.contacts.coulomb.state import ContactState
from symhbm.numerics import turning_points
from symhbm.numerics.fourier import FourierBasis

SETS = [(1, 3), (1, 3, 5), (1, 3, 5, 7, 9), (0, 1, 2, 3), (1, 2), (2, 5, 10), (3, 9), (0, 2, 4)]


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


def batch_of_all_kinds(basis, n=40):
    """Motions, some of them at rest, some tiny; stiffness and limits, some of them 0."""
    rng = np.random.default_rng(4)
    waves = rng.normal(size=(n, basis.n_components)) / np.maximum(basis.order, 1)
    waves[::7], waves[3::7] = 0.0, waves[3::7] * 1e-120
    stiffness, limit = 10 ** rng.uniform(-1, 1, n), rng.uniform(0.1, 3, n)
    stiffness[5::9], limit[6::9] = 0.0, 0.0
    return waves, stiffness, limit


@pytest.mark.parametrize("slip", [None, True, False])
@pytest.mark.parametrize("harmonics", SETS)
def test_a_batch_gives_what_each_motion_gives(harmonics, slip):
    basis = FourierBasis(harmonics)
    waves, stiffness, limit = batch_of_all_kinds(basis)
    imposed = None if slip is None else np.full(len(waves), slip)
    together = locate(basis, waves, stiffness, limit, imposed)
    for i in range(len(waves)):
        each = slice(i, i + 1)
        held = None if imposed is None else imposed[each]
        alone = locate(basis, waves[each], stiffness[each], limit[each], held)
        for field in fields(ContactState):
            mine, own = getattr(together, field.name)[i], getattr(alone, field.name)[0]
            if field.name == "stick":
                mine, own = mine[~np.isnan(mine)], own[~np.isnan(own)]
            np.testing.assert_array_equal(mine, own)


@pytest.mark.parametrize("harmonics", [(1, 2), (0, 1, 2), (1, 3)])
def test_a_contact_held_in_slip_short_of_its_limit(harmonics):
    """It is on +-g at the extremes of y, and never leaves its stretch of stick."""
    basis, wave = FourierBasis(harmonics), np.array([0.1, 1.0, 0.0, 0.1, 0.1])
    wave = wave[-basis.n_components :][None]
    free = locate(basis, wave, np.ones(1), np.full(1, 5.0))
    held = locate(basis, wave, np.ones(1), np.full(1, 5.0), np.array([True]))
    assert not free.slip[0]
    assert held.slip[0]
    assert held.stick_fraction[0] == pytest.approx(1, abs=1e-15)
    assert np.isnan(held.stick[:, 1]).all()
    high, low = turning_points(basis, wave).angle[0]
    moments = basis.moments(np.array([high, low, high + 2 * np.pi]))
    falls, rises = basis.integrals(moments)
    np.testing.assert_allclose(held.vector[0], falls - rises, atol=1e-14)
    matrix = basis.products(moments.sum(axis=0))
    matrix -= np.outer(falls, basis.values(high)) + np.outer(rises, basis.values(low))
    np.testing.assert_allclose(held.matrix[0], matrix, atol=1e-14)


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


def test_a_mean_alone_and_a_contact_without_a_spring_pull_nothing():
    waves = np.array([[7.0, 0.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.4, 0.3, 0.1]])
    stiffness, limit = np.array([2.0, 0.0]), np.full(2, 0.3)
    found = locate(FourierBasis((0, 1, 2)), waves, stiffness, limit)
    spring = stiffness[:, None] * np.einsum("cij,cj->ci", found.matrix, waves)
    assert not (spring + limit[:, None] * found.vector).any()


def test_motions_of_equal_periods_are_those_of_one():
    """Harmonics (3, 9) with the coefficients of (1, 3): the same force, three times as often."""
    rng = np.random.default_rng(2)
    waves, stiffness = rng.normal(size=(10, 4)), np.ones(10)
    limit = np.full(10, 0.4)
    once, thrice = (locate(FourierBasis(h), waves, stiffness, limit) for h in ((1, 3), (3, 9)))
    np.testing.assert_array_equal(once.matrix, thrice.matrix)
    np.testing.assert_array_equal(3 * once.reversals, thrice.reversals)
    contact_once, begin, end = once.stick_intervals
    contact_thrice, begin_thrice, end_thrice = thrice.stick_intervals
    np.testing.assert_array_equal(np.repeat(contact_once, 3), np.sort(contact_thrice))
    # Round-off of angles up to two turns.
    assert (end - begin).sum() == pytest.approx((end_thrice - begin_thrice).sum(), rel=1e-13)


def test_no_contact_has_no_event():
    found = locate(FourierBasis((1, 3)), np.empty((0, 4)), np.empty(0), np.empty(0))
    assert found.matrix.shape == (0, 4, 4)
    assert found.stick.shape[:2] == (0, 2)


def test_arguments_may_be_read_only_and_strided():
    basis, waves = FourierBasis((1, 3)), np.random.default_rng(1).normal(size=(4, 6))
    given = waves[:, 1:5]
    given.setflags(write=False)
    stiffness = np.broadcast_to(1.0, 6)[:6:2]
    found = locate(basis, given[:3], stiffness, np.full(3, 0.2))
    plain = locate(basis, given[:3].copy(), np.ones(3), np.full(3, 0.2))
    np.testing.assert_array_equal(found.matrix, plain.matrix)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
@pytest.mark.parametrize("component", [0, 2])
def test_motions_that_are_not_finite_are_refused(wrong, component):
    waves = np.ones((2, 5))
    waves[1, component] = wrong
    with pytest.raises(FloatingPointError, match="not finite"):
        stick_intervals(FourierBasis((0, 1, 2)), waves, np.ones(2), np.ones(2))
