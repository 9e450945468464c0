"""Corners of a path where the normal load of friction varies: it lands on them and turns."""

import numpy as np
import pytest
import scipy

import symhbm as sh
from symhbm.continuation.path import Path
from symhbm.continuation.point import EventKind
from symhbm.continuation.problem import FrequencyProblem
from symhbm.continuation.start import solve_point
from symhbm.continuation.status import Status
from tests.pressed_contact import TURN, structure
from tests.quick import quick_first


def mass(stiffness, damping, cosine, sine, normal_stiffness, friction, load):
    """One mass of 1 kg on inclined springs, pressed to the ground; forces in both directions."""
    first, both, second = stiffness
    force = sh.forces.HarmonicForce(cosine={1: cosine}, sine={1: sine})
    parts = np.eye(2), damping * np.eye(2), np.array([[first, both], [both, second]])
    values = dict(contact_stiffness=1e4, normal_stiffness=normal_stiffness)
    values |= dict(friction_coefficient=friction, normal_load=load)
    return structure(*parts, force, [(0,)], [(1,)], "balanced", **values)


def followed(problem, band):
    """The path over a band [Hz] and its points."""
    start, end = (TURN * edge for edge in band)
    path = Path(FrequencyProblem(problem), solve_point(problem, start).unknowns, start, end)
    return path, list(path)


def kinds(point):
    return [event.kind for event in point.events]


def directions_around(problem, point, radius=1e-4):
    """Unit vectors to all solutions at a small distance from a point, from random starts."""
    curve, rng, found = FrequencyProblem(problem), np.random.default_rng(1), []
    force = curve.evaluate(point.unknowns, point.value).magnitude

    def equations(way):
        state = point.state + radius * way * point.scale
        residual = curve.evaluate(state[:-1], state[-1]).residual / (radius * force)
        return np.append(residual, way @ way - 1)

    for _ in range(30):
        start = rng.normal(size=len(point.state))
        guess = start / np.linalg.norm(start)
        way, about, _, _ = scipy.optimize.fsolve(equations, guess, full_output=True)
        solves = np.abs(about["fvec"]).max() < 1e-9
        if solves and not any(np.linalg.norm(way - other) < 0.01 for other in found):
            found.append(way)
    return found


def assert_turns_as_solutions_do(problem, point):
    """Two solutions are next to a corner: one before it and one beyond."""
    found = directions_around(problem, point)
    assert len(found) == 2
    before, after = (way / point.scale for way in (-point.before, point.after))
    for way in (before, after):
        closest = max(float(way @ other) for other in found)
        assert closest / np.linalg.norm(way) == pytest.approx(1, abs=0.02)


@pytest.mark.parametrize("load", quick_first(np.linspace(9, 10, 6), 2))
def test_onsets_of_slip_at_acute_corners_are_passed(load):
    """Whether round-off puts the motion on the limit short of it or beyond."""
    parts = (1.3e4, 3.7e3, 1.5e4), 0.031, [0.00027, 0.0048], [0.011, 0.02]
    problem = mass(*parts, normal_stiffness=1e4, friction=0.5, load=load)
    path, points = followed(problem, (22, 24))
    assert path.status == Status.REACHED_END
    events = [point for point in points if point.events]
    assert [kinds(point) for point in events] == [["onset of slip"], ["end of slip"]]
    assert_turns_as_solutions_do(problem, events[0])


def test_a_path_does_not_walk_back_through_a_sharp_turn():
    parts = (1e4, -110, 1.2e4), 0.0048, [-0.0023, 0.013], [-0.021, 0.016]
    problem = mass(*parts, normal_stiffness=2e4, friction=0.3, load=9.8)
    path, points = followed(problem, (20, 30))
    assert path.status == Status.REACHED_END
    places = np.array([point.state for point in points if point.events])
    apart = np.linalg.norm((places[1:] - places[:-1]) / points[0].scale, axis=1)
    assert apart.min() > 1e-6


@pytest.mark.parametrize(
    ("parts", "normal_stiffness", "friction", "load", "band", "turns"),
    [
        ([(1.2e4, -9.9e3, 5.5e4), 0.0082, [-0.36, -0.8], [0.49, 1.3]], 2e4, 0.3, 7.7, (21, 26), 0),
        ([(3.5e4, -2.2e4, 3e4), 0.042, [-1.5, -0.21], [0.8, 0.18]], 1e4, 0.5, 6.1, (18, 25), 1),
    ],
)
def test_acute_corners_by_slip_within_the_period(
    parts, normal_stiffness, friction, load, band, turns
):
    """A wall that begins to push turns the path by more than a right angle, no switch tells."""
    problem = mass(*parts, normal_stiffness=normal_stiffness, friction=friction, load=load)
    path, points = followed(problem, band)
    assert path.status == Status.REACHED_END
    corners = [point for point in points if EventKind.CORNER in kinds(point)]
    assert corners
    for corner in corners:
        assert np.dot(corner.before / corner.scale, corner.after / corner.scale) < 0
        assert (EventKind.FOLD in kinds(corner)) == (corner.before[-1] * corner.after[-1] < 0)
        assert_turns_as_solutions_do(problem, corner)
    assert sum(EventKind.FOLD in kinds(corner) for corner in corners) == turns
