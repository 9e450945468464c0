"""The corrector whose system is one function against the one that builds it step by step."""

from itertools import pairwise

import numpy as np
import pytest

import symhbm as sh
from symhbm.continuation import FrequencyProblem, follow_branch
from symhbm.continuation.correctors import AtLimit, Hyperplane, StepwiseCorrector, corrector_of
from symhbm.continuation.correctors.compiled import LocatedCorrector

TURN = 2 * np.pi


def blade(**given):
    return sh.single_blade(mass=1, stiffness=1e4, damping=0.5, **given)


def rubbing():
    """Friction with the mean, odd and even harmonics."""
    model = blade(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=200)
    force = sh.forces.PointForce(amplitude=100.0) + sh.forces.StaticLoad((20.0,))
    return sh.HarmonicBalance(model, force, (0, 1, 2, 3)), (12, 30)


def mistuned():
    disk = sh.bladed_disk(
        4,
        mass=1,
        stiffness=np.array([1.0, 1.1, 0.9, 1.05]) * 1e4,
        damping=0.5,
        contact_stiffness=1e5,
        friction_coefficient=0.5,
        normal_load=10,
    )
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(1, amplitude=4.0), (1, 3)), (14, 60)


def stiffening():
    """Closed forms of contacts, and several responses at one frequency."""
    model = blade(
        cubic_stiffness=1e6, contact_stiffness=1e3, friction_coefficient=0.5, normal_load=10
    )
    return sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=20.0), (1,)), (6, 40)


def opening():
    """Contacts that open, and two displacements of one contact."""
    law = sh.Friction(
        tangential=[(0,)], normal=[(1,)], contact_stiffness=1e4, normal_stiffness=2e4,
        friction_coefficient=0.4, normal_load=4.0, centrifugal_load=1e-3, engine_order=2,
    )  # fmt: skip
    matrices = np.eye(2), np.diag([2.0, 3.0]), np.array([[1e4, 1e3], [1e3, 2.25e4]])
    model = sh.Model(*matrices, contacts={"shroud": law})
    force = sh.forces.HarmonicForce(cosine={1: [1.0, 1.0]}, amplitude=15.0)
    return sh.HarmonicBalance(model, force, (0, 1, 2, 3)), (15, 45)


CASES = dict(rubbing=rubbing, mistuned=mistuned, stiffening=stiffening, opening=opening)


def same(found, other) -> None:
    assert (found is None) == (other is None)
    if found is None:
        return
    size = np.linalg.norm(other.point[:-1])
    np.testing.assert_allclose(found.point[:-1], other.point[:-1], rtol=0, atol=1e-10 * size)
    assert found.point[-1] == pytest.approx(other.point[-1], rel=1e-11)
    np.testing.assert_allclose(found.direction, other.direction, rtol=0, atol=1e-7)
    np.testing.assert_allclose(found.margins, other.margins, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(found.rate, other.rate, rtol=1e-5, atol=1e-6)
    assert found.amplification == pytest.approx(other.amplification, rel=1e-8)
    assert found.error == pytest.approx(other.error, rel=1e-6, abs=1e-10)
    assert (found.sign, found.crosses) == (other.sign, other.crosses)
    assert found.resonances_below == other.resonances_below


@pytest.mark.parametrize("name", CASES)
def test_both_correct_alike(name):
    """From guesses beside all points of a branch, onto planes and onto limits."""
    problem, band = CASES[name]()
    curve = FrequencyProblem(problem)
    branch = follow_branch(curve, (band[0] * TURN, band[1] * TURN), 5000, False)
    fast, slow = corrector_of(curve), StepwiseCorrector(curve)
    if not isinstance(fast, LocatedCorrector):
        fast = LocatedCorrector(curve)
    rng, limits = np.random.default_rng(1), 0
    for point in branch.points:
        scale = point.scale
        guess = point.state + 0.01 * scale * rng.normal(size=len(scale)) / len(scale) ** 0.5
        plane = Hyperplane(guess, scale, point.after / scale)
        both = [c.correct(guess, scale, plane, point.switches) for c in (fast, slow)]
        same(*both)
        row = point.after / scale
        tangents = [c.tangent(point.state, scale, row, point.switches) for c in (fast, slow)]
        same(*tangents)
    for left, right in pairwise(branch.points):
        for contact in np.flatnonzero(left.switches != right.switches).tolist():
            guess = right.state + 1e-3 * right.scale * rng.normal(size=len(right.scale))
            limit = AtLimit(curve, contact, right.scale)
            given = guess, right.scale, limit, left.switches, 1e-8
            both = [c.correct(*given) for c in (fast, slow)]
            same(*both)
            limits += both[0] is not None
    assert limits > 0
    assert fast.solves == pytest.approx(slow.solves, rel=0.02)


def test_a_force_that_is_no_number_is_told():
    problem, _ = rubbing()
    curve = FrequencyProblem(problem)
    corrector = corrector_of(curve)
    assert isinstance(corrector, LocatedCorrector)
    guess = np.full(problem.n_unknowns + 1, np.nan)
    scale = np.ones(len(guess))
    held = np.zeros(problem.n_contacts, dtype=bool)
    assert corrector.correct(guess, scale, Hyperplane(guess, scale, scale), held) is None
