"""The friction force with located angles against closed forms, quadrature and differences."""

import json
from pathlib import Path

import numpy as np
import pytest
from closed_forms import slider_coefficients
from hypothesis import assume, event, given, settings
from hypothesis import strategies as st

from symhbm.model.contacts.coulomb.located import locate, on_loop
from symhbm.model.contacts.coulomb.state import loops_near_limit
from symhbm.numerics.fourier import FourierBasis

EXACT = json.loads(
    (Path(__file__).parent.parent.parent / "data" / "reference" / "exact_values.json").read_text()
)
HARMONICS = [(1,), (0, 1), (1, 3), (1, 2, 3), (0, 1, 2, 3, 4), (1, 3, 5, 7), (2, 5, 10)]


def force(basis, coefficients, stiffness, limit, slip=None):
    """Force coefficients of one contact."""
    stiffness, limit = np.array([stiffness]), np.array([limit])
    found = locate(basis, coefficients[None], stiffness, limit, slip)
    return stiffness * found.matrix[0] @ coefficients + limit * found.vector[0], found


@pytest.mark.parametrize("harmonics", [(1,), (0, 1), (1, 3, 5)])
@pytest.mark.parametrize("row", EXACT["describing_function"]["rows"], ids=lambda row: row["A"])
def test_describing_function(row, harmonics):
    basis = FourierBasis(harmonics)
    coefficients = np.zeros(basis.n_components)
    coefficients[basis.component(1)] = float(row["A"])
    values, found = force(basis, coefficients, 1e4, 1.5)
    for n in (h for h in harmonics if h):
        # 1e-12 of the limit force: the tabulated digits.
        assert values[basis.component(n)] == pytest.approx(float(row[f"fc{n}"]), abs=1.5e-12)
        assert values[basis.component(n, True)] == pytest.approx(float(row[f"fs{n}"]), abs=1.5e-12)
    if row["theta_star"] is None:
        assert np.isnan(found.theta_star[0])
    else:
        assert found.theta_star[0] == pytest.approx(float(row["theta_star"]), rel=1e-12)
    assert found.theta_0[0] == pytest.approx(0.0, abs=1e-15)
    assert found.reversals[0] == 2


def test_minor_loop():
    case = EXACT["jenkins_minor_loop"]
    basis = FourierBasis(tuple(case["ks"]))
    wave = np.column_stack([case["y_a"], case["y_b"]]).ravel()
    expected = np.column_stack([case["f_a"], case["f_b"]]).ravel()
    values, found = force(basis, wave, case["kd"], case["muFn"])
    np.testing.assert_allclose(values, expected, rtol=1e-10)
    assert found.reversals[0] == case["reversals"]
    assert 1 - found.stick_fraction[0] == pytest.approx(case["slip_fraction"], abs=1e-12)


@settings(max_examples=100)
@given(
    seed=st.integers(0, 2**32 - 1),
    harmonics=st.sampled_from(HARMONICS),
    share=st.floats(0.01, 1.3),
    decay=st.floats(0.0, 2.0),
)
def test_force_agrees_with_quadrature(seed, harmonics, share, decay):
    basis, rng = FourierBasis(harmonics), np.random.default_rng(seed)
    wave = rng.normal(size=basis.n_components) / np.maximum(basis.order, 1) ** decay
    stiffness = float(10 ** rng.uniform(-1, 3))
    _, probe = force(basis, wave, stiffness, 1.0)
    limit = share * float(np.exp(probe.slip_margin[0]))
    values, found = force(basis, wave, stiffness, limit)
    expected, reversals, slip = slider_coefficients(
        basis.order, basis.is_sine, wave, stiffness, limit
    )
    event(f"{reversals} reversals, {'slip' if slip else 'stick'}")
    assume(abs(found.slip_margin[0]) > 1e-9)
    scale = np.abs(expected).max() + limit
    # Requirement: 1e-10 relative. The quadrature itself is good to about 1e-13.
    np.testing.assert_allclose(values, expected, rtol=0, atol=1e-10 * scale)
    assert found.reversals[0] == reversals
    assert 1 - found.stick_fraction[0] == pytest.approx(slip, abs=1e-7)
    assert found.slip[0] == (slip > 0)


@pytest.mark.parametrize(
    "harmonics", [(1, 3, 5), (0, 1, 2, 3), (1, 2, 3, 4), (2, 6, 10), (2, 4, 6)]
)
def test_contacts_held_on_their_loops(harmonics):
    """In the state that the law asks for it is the law; at the limit both states agree."""
    basis, rng = FourierBasis(harmonics), np.random.default_rng(21)
    kinds, at_limit = set(), 0
    for _ in range(60):
        wave = rng.normal(size=basis.n_components)
        limit = rng.uniform(0.05, 0.9)
        _, found = force(basis, wave, 1.0, limit)
        if not found.slip[0]:
            continue
        law = found.matrix[0], found.vector[0], found.stick[0, 1]
        for distance, loop in loops_near_limit(basis, wave, 0, 1.0, limit):
            begin, end = basis.values([loop.begin, loop.end]) @ wave
            trial = loop.sides[0] * limit + end - begin
            assert abs(abs(trial) / limit - 1) == pytest.approx(distance, abs=1e-12)
            slips = abs(trial) > limit
            held = on_loop(found, basis, wave, 1.0, limit, loop, slips)
            np.testing.assert_allclose(held.matrix[0], law[0], atol=1e-9)
            np.testing.assert_allclose(held.vector[0], law[1], atol=1e-9)
            ends = np.exp(1j * law[2][np.isfinite(law[2])])
            own = np.exp(1j * held.stick[0, 1][np.isfinite(held.stick[0, 1])])
            assert len(ends) == len(own)
            assert np.abs(ends[:, None] - own).min(axis=1).max() < 1e-7
            if loop.returns:
                continue
            # With as small a limit as its travel takes, the same loop just reaches the other side.
            exact = abs(end - begin) / 2
            near = min(loops_near_limit(basis, wave, 0, 1.0, exact), key=lambda each: each[0])
            located = force(basis, wave, 1.0, exact)[1]
            if near[0] > 1e-12 or near[1].begin != loop.begin or not located.slip_margin[0] > 1e-3:
                continue
            sides = [
                on_loop(located, basis, wave, 1.0, exact, near[1], side) for side in (False, True)
            ]
            stuck, slid = (side.matrix[0] @ wave + exact * side.vector[0] for side in sides)
            np.testing.assert_allclose(stuck, slid, atol=1e-9)
            # Their derivatives differ: the force has a corner there.
            assert np.abs(sides[0].matrix[0] - sides[1].matrix[0]).max() > 1e-3
            at_limit += 1
        kinds |= {each.returns for _, each in loops_near_limit(basis, wave, 0, 1.0, limit)}
    assert kinds == {True, False}
    assert at_limit > 3
