"""Points checked at once are those evaluated one by one."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.balance import check_each
from tests.problems import problem


def sampled():
    base = problem("coulomb mistuned order 13")
    return sh.HarmonicBalance(base.model, base.excitation, base.harmonics, 64)


def of_one_sector():
    base = problem("coulomb ring order 13")
    return base.of_sector(base.equal_sectors)


CELLS = [
    "coulomb mistuned order 1", "coulomb mistuned order 13", "coulomb ring static 0123",
    "cubic mistuned order 1", "planar blade point 1", "varying chain point 0123",
    "stop blade point 0123", "coulomb condensed point 1",
]  # fmt: skip
PROBLEMS = {name: lambda name=name: problem(name) for name in CELLS}
PROBLEMS |= {"sampled": sampled, "sector": of_one_sector}


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("several", [False, True])
def test_points_at_once_are_those_one_by_one(name, several):
    """To the bit with the same events, of one problem and of several whose values differ."""
    base, rng, n = PROBLEMS[name](), np.random.default_rng(0), 40
    amplitudes = rng.uniform(0.5, 2, n) if several else np.ones(n)
    problems = [base] * n
    if several:
        problems = [base.with_parameters(force_amplitude=a) for a in amplitudes]
    unknowns = 10 ** rng.uniform(-5, -2, (n, 1)) * rng.normal(size=(n, base.n_unknowns))
    frequencies = 2 * np.pi * rng.uniform(15, 35, n)
    norm, located = check_each(problems, unknowns, frequencies)
    assert 0 < norm.min() < norm.max()
    states = located.split(n)
    for i, (one, x) in enumerate(zip(problems, unknowns, strict=True)):
        assert norm[i] == one.evaluate(x, frequencies[i], states=states[i]).norm
        alone = one.evaluate(x, frequencies[i])
        np.testing.assert_allclose(norm[i], alone.norm, rtol=1e-12)
        np.testing.assert_array_equal(states[i].switches, alone.states.switches)
        np.testing.assert_allclose(states[i].margins, alone.states.margins, rtol=1e-12, atol=1e-12)


def test_sizes_at_switches_are_those_of_their_contacts():
    contacts = problem("varying chain point 0123").contacts
    by_row = np.random.default_rng(0).uniform(size=(2, 3, contacts.layout.n_rows))
    [group] = contacts.groups
    of_contact = np.linalg.norm(by_row[..., group.rows], axis=-1)
    sizes = contacts.sizes_at_switches(by_row)
    np.testing.assert_array_equal(sizes, of_contact[..., contacts.of_switches])
