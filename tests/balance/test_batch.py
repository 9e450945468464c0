"""Points checked at once are those evaluated one by one."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.balance import check_each

VALUES = dict(mass=1, stiffness=1e4, damping=0.5)
FRICTION = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3.0)
FORCE = sh.forces.HarmonicForce(cosine={1: [10, 5, 0, 0]}, sine={1: [0, 0, 10, -5]})


def ring(harmonics=(1,), samples=None, **more):
    disk = sh.bladed_disk(4, **VALUES, **FRICTION, **more)
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(1), harmonics, samples)


def of_one_sector():
    problem = ring((1, 3))
    return problem.of_sector(problem.equal_sectors)


def masses(contact, harmonics):
    matrices = np.eye(4), np.diag([2, 3, 2, 3]), np.diag([1e4, 2.25e4, 1.04e4, 2.3e4])
    return sh.HarmonicBalance(sh.Model(*matrices, contacts={"c": contact}), FORCE, harmonics)


def lifting():
    normal = dict(normal=(1, 3), normal_stiffness=2e4)
    return masses(sh.Friction(tangential=(0, 2), **normal, **FRICTION), range(3))


def condensed():
    stiffness = 1e4 * (2 * np.eye(6) - np.eye(6, k=1) - np.eye(6, k=-1))
    model = sh.Model(np.eye(6), 1e-4 * stiffness, stiffness, contacts=[(2,)], **FRICTION)
    force = sh.forces.PointForce(place=5)
    small = sh.condense(model, force, (5, 25), (1,), places=[5], progress=False)
    return sh.HarmonicBalance(small, force, (1,))


PROBLEMS = {
    "closed": ring,
    "cubic": lambda: ring(cubic_stiffness=1e8),
    "harmonics": lambda: ring((1, 3)),
    "mean": lambda: ring((0, 1, 2)),
    "sampled": lambda: ring((1, 3), 64),
    "sector": of_one_sector,
    "planar": lambda: masses(sh.Friction(tangential=(0, 2), across=(1, 3), **FRICTION), (1,)),
    "lifting": lifting,
    "gap": lambda: masses(sh.Gap(normal=(0, 1), normal_stiffness=1e4, normal_load=2.0), range(3)),
    "condensed": condensed,
}


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
    frequencies = 2 * np.pi * rng.uniform(10, 20, n)
    norm, located = check_each(problems, unknowns, frequencies)
    assert 0 < norm.min() < norm.max()
    states = located.split(n)
    for i, (problem, x) in enumerate(zip(problems, unknowns, strict=True)):
        assert norm[i] == problem.evaluate(x, frequencies[i], states=states[i]).norm
        alone = problem.evaluate(x, frequencies[i])
        np.testing.assert_allclose(norm[i], alone.norm, rtol=1e-12)
        np.testing.assert_array_equal(states[i].switches, alone.states.switches)
        np.testing.assert_allclose(states[i].margins, alone.states.margins, rtol=1e-12, atol=1e-12)
