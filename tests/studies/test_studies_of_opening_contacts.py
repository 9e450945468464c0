"""Studies of contacts that open, against motions marched in time and against other digits."""

import numpy as np
import pytest

import symhbm as sh
from studies import gap_stop, shroud_opening
from studies import underplatform_damper as damper
from studies.landmark import unmet


@pytest.fixture(scope="module")
def stop():
    return gap_stop.compute(progress=False)


@pytest.mark.slow
def test_exact_motions_of_a_stop_have_known_multipliers(stop):
    """One closed and two that open at 21.5 Hz, the middle one a saddle; given to four digits."""
    found = gap_stop.exact_solutions(stop)
    assert found[0][0] == 0
    np.testing.assert_allclose([size for _, size in found], [0.9546, 1.3550, 0.9546], atol=5e-5)


def test_exact_motions_of_a_stop_end_at_the_opening():
    """The motion that hardly opens has the force of the closed one that is about to open."""
    for frequency in gap_stop.openings():
        assert abs(gap_stop.excess(2 * np.pi * frequency, 1e-4)) < 1e-3
    # Elsewhere it does not.
    assert abs(gap_stop.excess(2 * np.pi * 21.5, 1e-4)) > 0.1


def test_a_fold_of_a_stop_is_where_two_exact_motions_meet(stop):
    """Within the folds there are two motions next to it, and none beyond."""
    for found, share in gap_stop.folds(stop):
        exact = gap_stop.exact_fold(found, share)
        inside = np.sign(gap_stop.SEVERAL - exact)
        near = share + np.linspace(-0.02, 0.02, 401)
        for side, crossings in ((inside, 2), (-inside, 0)):
            omega = 2 * np.pi * (exact + 1e-4 * side)
            signs = np.sign([gap_stop.excess(omega, one) for one in near])
            assert np.count_nonzero(np.diff(signs)) == crossings
        assert found == pytest.approx(exact, rel=gap_stop.FOLD_ERROR)


def test_landmarks_of_a_stop_can_be_missed(stop):
    assert unmet(gap_stop.landmarks(stop)) == []
    moved = stop.assign(event_frequency=stop.event_frequency * (1 + 1e-6))
    assert len(unmet(gap_stop.landmarks(moved))) == 4


def test_openings_of_a_shroud_are_those_of_linear_blades():
    """Below and above each of them the parting force is on either side of the preload."""
    for preload in shroud_opening.PRELOADS:
        for frequency in shroud_opening.openings(preload):
            sides = [shroud_opening.parting(frequency + s) > preload for s in (-1e-6, 1e-6)]
            assert sorted(sides) == [False, True]
    # The same linear blades by the library, with a preload that holds and no friction.
    problem = shroud_opening.problem(1, preload=1e4).with_parameters(friction_coefficient=0.0)
    found = sh.solve(problem, 25.0, throw=True)
    swing = float((found.largest_normal_force - found.mean_normal_force).item())
    assert swing == pytest.approx(shroud_opening.parting(25.0), rel=1e-9)


def marched(mass, start, frequency, periods, steps):
    """Largest displacement of the blade [m] over the last period of a motion marched in time.

    Velocities and displacements take turns; sliders move as little as their limits make them.
    """
    cosine, sine, slope = np.cos(damper.ANGLE), np.sin(damper.ANGLE), damper.PLATFORM
    k, mu, loss = damper.CONTACT_STIFFNESS, damper.FRICTION, damper.LOSS
    omega, step = 2 * np.pi * frequency, 1 / (frequency * steps)
    pull = mass * damper.RADIUS * damper.SPEED**2
    steady = slope * sine * damper.load(mass)
    (x, z, s), (x_speed, z_speed, s_speed) = start
    first, second, largest = 0.0, 0.0, 0.0
    for i in range(periods * steps):
        u = slope * x
        rubs, presses = sine * z + cosine * (s - u), cosine * z - sine * (s - u)
        other, pushes = sine * z - cosine * s, cosine * z + sine * s
        normal, wall = k * max(presses, 0.0), k * max(pushes, 0.0)
        first = min(max(first, k * rubs - mu * normal), k * rubs + mu * normal)
        second = min(max(second, k * other - mu * wall), k * other + mu * wall)
        friction, of_wall = k * rubs - first, k * other - second
        outwards = pull - sine * (friction + of_wall) - cosine * (normal + wall)
        sideways = -cosine * (friction - of_wall) + sine * (normal - wall)
        on_blade = slope * (cosine * friction - sine * normal) + steady
        on_blade += damper.FORCE * np.cos(omega * i * step) - damper.BLADE_STIFFNESS * x
        x_speed += step * (on_blade - damper.BLADE_DAMPING * x_speed) / damper.BLADE_MASS
        z_speed += step * (outwards / mass - loss * z_speed)
        s_speed += step * (sideways / mass - loss * s_speed)
        x, z, s = x + step * x_speed, z + step * z_speed, s + step * s_speed
        if i >= (periods - 1) * steps:
            largest = max(largest, abs(x))
    return largest


MOTIONS = {1.4e-3: (398.9357, 300), 5.7e-3: (445.0, 30), 1.6e-2: (487.0, 60)}
"""Frequencies [Hz], and periods until a motion from the balance has settled, by mass [kg]."""


@pytest.mark.parametrize("mass", MOTIONS)
def test_a_damper_marched_in_time(mass):
    """It lifts off, is next to the best, is too heavy: few harmonics are near, exact ones agree."""
    frequency, periods = MOTIONS[mass]
    problem = damper.problem(mass)
    found = sh.solve(problem, frequency, throw=True)
    pairs = found.coefficient.values.reshape(3, -1)
    motion = np.delete(pairs, 1, axis=1)  # harmonic 0 has no sine
    start = [motion @ problem.basis.values(0.0, d) * (2 * np.pi * frequency) ** d for d in (0, 1)]
    largest = marched(mass, start, frequency, periods, 1000)
    assert float(found.amplitude[0]) == pytest.approx(largest, rel=damper.TRUNCATION)
    if mass > damper.SEARCHED[0]:
        exact = sh.periodic_motion(problem, frequency, throw=True)
        assert float(exact.amplitude[0]) == pytest.approx(largest, rel=2e-3)
