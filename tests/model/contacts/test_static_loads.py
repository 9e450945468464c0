"""Contacts that static loads alone press: where a structure stands, and responses from there."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.continuation.start import position_at_rest

SLOPE = np.radians(35)
COSINE, SINE = np.cos(SLOPE), np.sin(SLOPE)
STIFFNESS, MASS, PUSH = 1e5, 0.01, 30.0


def wedge(friction=0.3, amplitude=2.0, push=PUSH, **load):
    """A blade and a body that nothing but its contacts with the blade and a wall holds."""
    contacts = sh.Friction(
        tangential=[{0: -COSINE, 1: SINE, 2: COSINE}, {1: SINE, 2: -COSINE}],
        normal=[{0: SINE, 1: COSINE, 2: -SINE}, {1: COSINE, 2: SINE}],
        contact_stiffness=STIFFNESS,
        normal_stiffness=STIFFNESS,
        friction_coefficient=friction,
        preload="coupled",
        **(load or dict(normal_load=0.0)),
    )
    matrices = np.diag([1.0, MASS, MASS]), np.diag([2.0, 1.0, 1.0]), np.diag([2e4, 0, 0])
    model = sh.Model(*matrices, contacts={"damper": contacts})
    force = sh.forces.PointForce(0, amplitude=amplitude) + sh.forces.StaticLoad({1: push})
    return sh.HarmonicBalance(model, force, (0, 1, 2, 3))


@pytest.mark.parametrize("load", [dict(normal_load=0.0), dict(gap=1e-5)])
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_bodies_without_springs_of_their_own_are_held(friction, load):
    """By equilibrium each contact carries half of the push over the cosine."""
    problem = wedge(friction, **load)
    at_rest = position_at_rest(problem, 60.0)
    normal = np.array([[SINE, COSINE, -SINE], [0, COSINE, SINE]])
    place = problem.layout.coefficients(at_rest)[:, 0]
    expected = PUSH / (2 * COSINE)
    carried = STIFFNESS * (normal @ place - load.get("gap", 0.0))
    # The blade gives way where friction does not help to hold it.
    np.testing.assert_allclose(carried, expected, rtol=1e-9)
    assert 2e4 * place[0] == pytest.approx(-SINE * expected, rel=1e-9)
    # Nothing else moves.
    np.testing.assert_allclose(problem.layout.coefficients(at_rest)[:, 1:], 0, atol=1e-15)


@pytest.mark.parametrize("frequency", [10.0, 22.0, 26.0])
@pytest.mark.parametrize("load", [dict(normal_load=0.0), dict(gap=1e-5)])
def test_responses_start_where_loads_hold_contacts(frequency, load):
    found = sh.solve(wedge(**load), frequency)
    assert found.status.item().startswith("success")
    assert (found.mean_normal_force > 0).all()


def test_contacts_without_friction_keep_their_mean_load():
    found = sh.solve(wedge(friction=0.0), 10.0, throw=True)
    np.testing.assert_allclose(found.mean_normal_force, PUSH / (2 * COSINE), rtol=1e-9)


def test_a_load_that_pulls_apart_closes_nothing():
    """The body flies off: no equilibrium is made up, and the blade moves alone."""
    found = sh.solve(wedge(push=-PUSH), 10.0)
    assert not found.status.item().startswith("success")


def test_problems_without_static_loads_start_from_rest():
    contact = sh.Gap(normal=(0,), normal_stiffness=2e4, normal_load=10.0)
    blade = sh.Model([[1.0]], [[2.0]], [[1e4]], contacts={"stop": contact})
    problem = sh.HarmonicBalance(blade, sh.forces.PointForce(amplitude=5.0), (0, 1, 2))
    assert not position_at_rest(problem, 100.0).any()
