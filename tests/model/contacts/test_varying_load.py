"""Friction whose normal load varies with the motion: forces, derivatives, margins, limits."""

from functools import partial

import numpy as np
import pytest

import symhbm as sh
from symhbm.model.contacts.varying_load.march import APART, BEGIN, END, KIND, march, walls
from symhbm.numerics import FourierBasis
from tests.law_slopes import OneContact, figures_of, force_of, returned
from tests.law_slopes import values_of as values_of_law
from tests.quick import quick_first
from tests.reference import STATED

LAW = sh.laws.VariableLoadFriction()
values_of = partial(values_of_law, LAW)


def located(basis, motion, values):
    return force_of(LAW, basis, motion, values)[1]


def force(basis, motion, values):
    """Coefficients of one contact's force, with the whole normal force."""
    whole = force_of(LAW, basis, motion, values)[0].ravel()
    whole[len(whole) // 2] += max(float(LAW.load(1.0, values)[0]), 0)
    return whole


CASES = STATED["explicit_motions"]
"""Motions with all digits of two independent programs: values, u, v, T, N, dT_c1 by u, v, N0."""


@pytest.mark.parametrize("case", CASES)
def test_forces_and_slopes_are_those_of_explicit_motions(case):
    numbers, u, v, tangential, normal, slopes = CASES[case]
    basis, motion = FourierBasis((0, 1, 2)), np.array([*u, *v], float)
    found = force(basis, motion, values_of(*numbers))
    np.testing.assert_allclose(found[:5], tangential, atol=2e-12)
    if normal:
        np.testing.assert_allclose(found[5:], normal, atol=2e-12)
    at = np.concatenate([motion, _in_order(values_of(*numbers))])
    row = OneContact(LAW, basis, at).slope[1]
    by_load = row[10 + [*LAW.parameters].index("normal_load")]
    np.testing.assert_allclose([row[1], row[6], by_load], slopes, atol=2e-12)


def test_events_of_a_contact_that_sticks_at_contact():
    numbers, u, v, *_ = CASES["opens, sticks at contact"]
    periods = located(FourierBasis((0, 1, 2)), [*u, *v], values_of(*numbers)).details
    begins = periods.pieces[0, : periods.counts[0], 1]
    np.testing.assert_allclose(begins, [3.399862536, 5.882149750, 8.838462927], atol=1e-9)


@pytest.mark.parametrize("seed", quick_first(range(6), 3))
def test_a_march_over_samples_agrees_within_its_error(seed):
    rng = np.random.default_rng(seed)
    basis = FourierBasis((0, 1, 2, 3, 5))
    size = basis.n_components
    motion = rng.normal(size=2 * size) / (1 + np.tile(basis.order, 2))
    numbers = rng.uniform([0.5, 0.5, 0.3, -0.5], [2, 2, 0.9, 1.0])
    at = located(basis, motion, values_of(*numbers))
    assert at.states[0, 0]
    expected = returned(LAW, basis, motion, values_of(*numbers), 200_000).ravel()
    np.testing.assert_allclose(
        force(basis, motion, values_of(*numbers)), expected, atol=3e-4 * np.abs(expected).max()
    )


LIMITS = {
    "no friction": (1, 1, 0, 0.3),
    "no tangential spring": (0, 1, 0.5, 0.3),
    "no normal spring": (1, 0, 0.5, 0.3),
    "no normal spring, no load": (1, 0, 0.5, 0),
    "never touches": (1, 1, 0.5, -50),
    "never opens": (1, 1, 0.5, 50),
    "touches with no preload": (1, 1, 0.5, 0),
}


@pytest.mark.parametrize("limit", LIMITS)
@pytest.mark.parametrize("moves", ["both", "tangential", "normal", "not", "inclined"])
def test_limits_are_exact(limit, moves):
    basis, rng = FourierBasis((0, 1, 2, 3)), np.random.default_rng(2)
    size = basis.n_components
    motion = rng.normal(size=2 * size) / (1 + np.tile(basis.order, 2))
    if moves == "inclined":
        motion[size:] = motion[:size]
    motion[:size] *= moves != "normal" and moves != "not"
    motion[size:] *= moves != "tangential" and moves != "not"
    k_t, k_n, mu, load = LIMITS[limit]
    values = values_of(k_t, k_n, mu, load)
    at = located(basis, motion, values)
    found = force(basis, motion, values)
    assert np.isfinite(found).all()
    assert not np.isnan(at.margins).any()
    assert np.isfinite(OneContact(LAW, basis, np.array([*motion, *_in_order(values)])).slope).all()
    results = figures_of(LAW, basis, motion, values)
    assert np.isfinite([*results.values()]).all()
    tau = 2 * np.pi * np.arange(60_000) / 60_000
    history = load + k_n * (basis.values(tau) @ motion[size:])
    expected = np.maximum(history, 0) @ (basis.values(tau) * basis.norm) * 2 * np.pi / 60_000
    np.testing.assert_allclose(found[size:], expected, atol=1e-7)
    if limit in ("no friction", "no tangential spring", "no normal spring, no load"):
        np.testing.assert_allclose(found[:size], 0, atol=1e-14)
    if limit == "never touches":
        np.testing.assert_allclose(found, 0, atol=1e-14)
        assert results["contact_state"] == 3
    if limit == "never opens":
        assert not at.states[0, 1]
        assert results["open_fraction"] == 0


def _in_order(values):
    return [values[name][0] for name in LAW.parameters]


def test_a_contact_that_touches_by_round_off_is_apart():
    """``-(1 - cos(t - a)) (1 + cos(t - b) / 2)`` is 0 at its maximum alone, but for round-off."""
    random = np.random.default_rng(28)
    for _ in range(400):
        a, b = random.uniform(0, 2 * np.pi, 2)
        mean = -1 + np.cos(a - b) / 4
        first = np.exp(1j * a) - np.exp(1j * b) / 2
        second = np.exp(1j * (a + b)) / 4
        load = np.array([mean, first, second]) * (1 + 1e-15 * random.normal(size=3))
        move = random.normal(size=(2, 3))
        cosine, sine = np.stack([move[0], load.real]), np.stack([move[1], load.imag])
        waves, pieces = np.empty((4, 2, 3)), np.empty((60, 6))
        noise = walls(cosine, sine, np.array([10.0, 1.0, 0.5, 0.0]), waves)
        count = march(waves, noise, -1, pieces, np.empty((4, 2)))
        apart = pieces[:count][pieces[:count, KIND] == APART]
        assert np.sum(apart[:, END] - apart[:, BEGIN]) == pytest.approx(2 * np.pi, abs=1e-3)


def test_second_derivatives_without_friction_are_those_of_a_constant_load():
    """By motion and friction coefficient: the force turns its sign where the motion turns."""
    basis, rng, coulomb = FourierBasis((0, 1, 2, 3)), np.random.default_rng(4), sh.laws.Coulomb()
    size, n = basis.n_components, 2 * basis.n_components
    motion, weights = rng.normal(size=n), rng.normal(size=n)
    values = values_of(1.3, 0.0, 0.0, 0.7)
    at = np.array([*motion, *_in_order(values)])
    of_constant = np.array([*motion[:size], *(values[name][0] for name in coulomb.parameters)])
    found = OneContact(LAW, basis, at).bend(weights)
    expected = OneContact(coulomb, basis, of_constant).bend(weights[:size])
    found = found[n + [*LAW.parameters].index("friction_coefficient"), :size]
    expected = expected[size + [*coulomb.parameters].index("friction_coefficient"), :size]
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())
    assert np.abs(expected).max() > 0.1
