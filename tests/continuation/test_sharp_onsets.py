"""Paths through limits of slip where they turn sharply: planar friction under a light preload."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.continuation import FrequencyProblem, Status
from symhbm.continuation.path import Path
from symhbm.continuation.start import solve_point
from tests.problems import problem as problem_of

LIMITS = {"onset of slip", "end of slip"}
BODIES = {
    # The tangents of stick and slip are at more than a right angle.
    "turns back": (
        [[29400, 8120, 13570], [8120, 16950, -1030], [13570, -1030, 34060]],
        [[0.7, 0.12, 0.17], [0.12, 0.54, -0.03], [0.17, -0.03, 0.77]],
        dict(contact_stiffness=4640, normal_stiffness=7660, friction_coefficient=0.17),
        (4.3, [0.08, -0.119, 0.25], [-0.212, -0.104, 0.103]),
        (36, 37.5),
    ),
    # Beside the limit the path turns within a margin of 1e-4, and is a fold there.
    "folds beside": (
        [[47420, 1410, 580], [1410, 51910, 1950], [580, 1950, 50670]],
        [[2.2, 0.03, 0.01], [0.03, 2.3, 0.04], [0.01, 0.04, 2.27]],
        dict(contact_stiffness=34940, normal_stiffness=38530, friction_coefficient=0.27),
        (4.6, [-0.089, 0.28, 0.079], [0.303, -0.091, -0.022]),
        (48, 50),
    ),
}


@pytest.mark.parametrize("name", BODIES)
def test_slip_begins_and_ends_where_paths_turn(name):
    stiffness, damping, contact, (load, cosine, sine), band = BODIES[name]
    pad = sh.Friction(tangential=(0,), across=(1,), normal=(2,), normal_load=load, **contact)
    model = sh.Model(np.eye(3), damping, stiffness, contacts={"pad": pad})
    wave = sh.forces.HarmonicForce(cosine={1: cosine}, sine={1: sine})
    problem, limits = sh.HarmonicBalance(model, wave, (0, 1)), []
    for start, end in (band, band[::-1]):
        solution = solve_point(problem, 2 * np.pi * start)
        curve = FrequencyProblem(problem)
        path = Path(curve, solution.unknowns, 2 * np.pi * start, 2 * np.pi * end)
        points = list(path)
        assert path.status == Status.REACHED_END
        for point in points:
            assert curve.evaluate(point.unknowns, point.value).norm < 1e-11
        limits.append([p for p in points if LIMITS & {event.kind for event in p.events}])
    upwards, downwards = [np.array([point.state for point in found]) for found in limits]
    assert len(upwards)
    np.testing.assert_allclose(upwards, downwards[::-1], rtol=1e-8, atol=1e-14)


def test_a_path_goes_on_beyond_an_onset_at_which_slip_is_small():
    """A unique response, whose tangent at the onset says little of the slip beyond."""
    problem, limits = problem_of("planar chain point 0123"), []
    for start, end in 2 * np.pi * np.array([(18.5, 19.3), (19.3, 18.5)]):
        path = Path(FrequencyProblem(problem), solve_point(problem, start).unknowns, start, end)
        limits.append([(point.value, point.events[0].kind) for point in path if point.events])
        assert path.status == Status.REACHED_END
    (at, kinds), (again, _) = (zip(*found, strict=True) for found in limits)
    assert kinds == ("onset of slip", "end of slip", "onset of slip")
    np.testing.assert_allclose(at, again[::-1], rtol=1e-9)
