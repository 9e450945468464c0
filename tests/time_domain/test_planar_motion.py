"""Exact motions beside planar friction: many harmonics, one direction, closed form, derivatives."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.numerics import RADIANS
from symhbm.time_domain.active_contacts import APART
from symhbm.time_domain.motion import exact_motion_of
from symhbm.time_domain.periodic_orbit import shot, with_centres
from symhbm.time_domain.planar_march import planar_march, planar_middle
from symhbm.time_domain.planar_motion import PlanarMotion

MATRICES = np.eye(3), np.diag([2.0, 2.5, 3.0]), np.diag([1e4, 1.21e4, 2.25e4])
ELLIPSE = sh.forces.HarmonicForce(cosine={1: [10, 0, 6]}, sine={1: [0, 7, 0]})
LINE = sh.forces.HarmonicForce(cosine={1: [10, 0, 6]}, sine={1: [0, 0, 2]})


def pad(normal_load, across=True, **values):
    given = dict(tangential=(0,), contact_stiffness=1e4, friction_coefficient=0.3)
    given |= dict(across=(1,)) if across else {}
    return sh.Friction(**given | dict(normal_load=normal_load) | values)


def pressed(normal_load, across=True, **values):
    return pad(normal_load, across, normal=(2,), normal_stiffness=1e4, **values)


def problem_of(contacts, force=ELLIPSE, harmonics=range(6)):
    return sh.HarmonicBalance(sh.Model(*MATRICES, contacts=contacts), force, harmonics)


@pytest.mark.parametrize(
    ("load", "hertz", "build"), [(20.0, 18.5, pad), (9.0, 24.0, pressed), (3.0, 18.5, pressed)]
)
def test_a_motion_along_a_line_is_that_of_one_direction(load, hertz, build):
    one, two = (
        exact_motion_of(problem_of(dict(pad=build(load, across)), LINE), RADIANS * hertz)
        for across in (False, True)
    )
    np.testing.assert_array_equal(one.event_kind, two.event_kind)
    np.testing.assert_allclose(one.event_angle, two.event_angle, atol=1e-9)
    first, second = (motion.coefficients(range(9))[0] for motion in (one, two))
    np.testing.assert_allclose(first, second, rtol=0, atol=1e-10 * np.abs(first).max())
    for name in ("friction_loss", "amplitude", "stick_fraction", "open_fraction"):
        np.testing.assert_allclose(getattr(one, name), getattr(two, name), rtol=1e-8, atol=1e-12)
    # Those of motions along the line, among those of all.
    distance = np.abs(one.multipliers[:, None] - two.multipliers).min(axis=1)
    own = np.abs(one.multipliers) > 1e-6
    still = np.abs(np.abs(one.multipliers) - np.exp(-2.5 / 2 / hertz)) < 1e-6
    assert distance[own & ~still].max() < 1e-8


def test_a_circle_in_closed_form():
    stiffness, limit, omega = 1e4, 3.0, RADIANS * 18
    contact = sh.Friction(
        tangential=(0,), across=(1,), contact_stiffness=stiffness, friction_coefficient=0.5,
        normal_load=2 * limit,
    )  # fmt: skip
    body = sh.Model(np.eye(2), 2 * np.eye(2), 1e4 * np.eye(2), contacts=dict(pad=contact))
    force = sh.forces.HarmonicForce(cosine={1: [10, 0]}, sine={1: [0, 10]})
    motion = exact_motion_of(sh.HarmonicBalance(body, force, (1,)), omega)
    wave, friction = motion.coefficients((1,))
    radius = motion.amplitude[0]
    displaced, pulled = wave[0] @ [1, -1j], friction[0] @ [1, -1j]
    ratio = limit / (stiffness * radius)
    expected = limit * (ratio + 1j * np.sqrt(1 - ratio**2)) * displaced / radius
    assert pulled == pytest.approx(expected, rel=1e-10)
    dynamic = (1e4 - omega**2 + 2j * omega) * displaced + pulled
    assert dynamic == pytest.approx(10, rel=1e-10)
    loss = 2 * np.pi * radius * limit * np.sqrt(1 - ratio**2)
    assert motion.friction_loss[0] == pytest.approx(loss, rel=1e-10)


@pytest.mark.parametrize(("load", "hertz", "build"), [(8.0, 16.0, pad), (3.0, 18.5, pressed)])
def test_derivative_of_the_march(load, hertz, build):
    problem = problem_of(dict(pad=build(load)))
    linear = PlanarMotion(problem, RADIANS * hertz, 0.02)
    state = np.array([4e-3, -6e-3, 1e-3, 5e-3, 8e-3, 2e-3, 0.4, -0.2])
    jacobian = planar_march(linear, state, 4.0).jacobian
    unit = np.array([1e-2] * 6 + [1.0] * 2)
    for way in unit * np.random.default_rng(0).normal(size=(2, 8)):
        ends = [planar_march(linear, state + step * way, 4.0).end for step in (-1e-5, 1e-5)]
        slope = (ends[1] - ends[0]) / 2e-5
        np.testing.assert_allclose(jacobian @ way, slope, rtol=0, atol=1e-5)


def test_a_contact_that_is_apart_begins_without_friction():
    """Whatever a guess says: a limit of friction is none of how far it is apart."""
    linear = PlanarMotion(problem_of(dict(pad=pressed(3.0))), RADIANS * 24, 0.02)
    state = np.array([4e-3, -6e-3, -2e-3, 5e-3, 8e-3, 2e-3, 0.0, 0.0])
    assert linear.pressure(state[:3]) < -10
    guessed, bare = (
        with_centres(linear, shot(linear, state + guess, planar_march), planar_middle)
        for guess in (np.array([0.0] * 6 + [0.4, -0.2]), 0.0)
    )
    assert (guessed.run.cells.state[0] == APART).all()
    np.testing.assert_array_equal(guessed.state, bare.state)
    np.testing.assert_allclose(guessed.residual, bare.residual, rtol=0, atol=1e-9)
