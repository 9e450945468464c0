"""Exact motions with normal loads that move: reference values, the law itself, limits, derivatives.

Reference values are of other programs, to the digits that are given.
"""

from functools import cache, partial

import numpy as np
import pytest

import symhbm as sh
from symhbm.time_domain.active_contacts import APART, STICK
from symhbm.time_domain.event_march import march
from symhbm.time_domain.linear_motion import LinearMotion
from tests.pressed_contact import (
    CASES,
    TURN,
    inclined,
    random_structure,
    reference,
    solved,
    structure,
    two_blades,
    two_way,
)
from tests.reference import STATED

SYSTEMS = {
    "two-way, 16 Hz": (two_way, 16.0),
    "two-way, 18 Hz": (two_way, 18.0),
    "two-way, 24 Hz": (two_way, 24.0),
    "two-way, 27 Hz": (two_way, 27.0),
    "inclined, 18 Hz": (inclined, 18.0),
    "two blades, 24 Hz": (two_blades, 24.0),
    **{name: (partial(reference, case), case["f"]) for name, case in CASES.items()},
}


@cache
def found(name):
    build, hertz = SYSTEMS[name]
    return build(), solved(build(), hertz)


def sizes(motion, highest=3):
    """Means and sizes of harmonics by degree of freedom, (n_dof, highest + 1)."""
    wave = motion.coefficients(range(highest + 1))[0]
    return np.column_stack([wave[:, 0], np.hypot(wave[:, 1::2], wave[:, 2::2])])


def is_as_given(value, text):
    """Within 1e-9, or half of the last of the digits of a number."""
    digits, _, exponent = text.partition("e")
    last = 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))
    return abs(value - float(text)) <= max(1e-9 * abs(float(text)), last / 2)


GIVEN = {
    "two_way": (two_way, [(0, 0), (0, 1), (0, 2), (0, 3), (1, 1)], lambda hertz: hertz > 16),
    "inclined": (inclined, [(0, 0), (0, 1), (0, 2), (0, 3)], lambda hertz: hertz < 27),
    "two_blades": (two_blades, [(0, 1), (1, 1), (2, 1), (3, 1)], lambda hertz: hertz != 18),
}
"""Problems, their degrees of freedom and harmonics that are stated, and where contacts open.

The normal displacement of an inclined contact is a multiple of the tangential one: zeros of both
coincide.
"""


@pytest.mark.parametrize(
    ("name", "hertz"), [(name, hertz) for name in GIVEN for hertz in STATED[name]]
)
def test_stated_motions(name, hertz):
    build, places, opens = GIVEN[name]
    motion = solved(build(), float(hertz))
    assert (motion.open_fraction[0] > 0) == opens(float(hertz))
    values = sizes(motion)
    for place, text in zip(places, STATED[name][hertz].split(), strict=True):
        assert is_as_given(values[place], text), (place, text)


def test_events_of_the_inclined_contact():
    motion = solved(inclined(), 18.0)
    assert motion.event_kind.tolist() == ["slip", "stick", "slip", "apart"]
    assert motion.event_slip.tolist() == [1, 0, -1, 0]
    assert motion.states(0.0).tolist() == ["apart"]
    given = "0.892536 2.413766 3.365541 3.973915"
    for value, text in zip(motion.event_angle, given.split(), strict=True):
        assert is_as_given(value, text)


@pytest.mark.parametrize("name", CASES)
def test_reference_motions(name):
    """Fifteen digits of coefficients, the round-off of two programs; states, loss and size."""
    case, (_, motion) = CASES[name], found(name)
    given = np.array([case["exact"][str(n)] for n in range(10)])
    wave = motion.coefficients(range(10))[0]
    ours = np.zeros_like(given)
    ours[0, :, 0] = wave[:, 0]
    ours[1:, :, 0], ours[1:, :, 1] = wave[:, 1::2].T, -wave[:, 2::2].T
    np.testing.assert_allclose(ours, given, rtol=1e-9, atol=2e-13 * np.abs(given).max())
    assert motion.friction_loss.sum() == pytest.approx(case["dissipation"], rel=1e-12)
    x = motion.at(np.linspace(0, TURN, 4001))[0]
    # Samples of both are off by a curvature times the square of half a step.
    np.testing.assert_allclose(np.ptp(x, axis=0) / 2, case["amplitude"], rtol=3e-6)


@pytest.mark.parametrize("name", CASES)
def test_reference_states(name):
    case, (_, motion) = CASES[name], found(name)
    for j, given in enumerate(case["states"]):
        angles, words = zip(*given, strict=True)
        middle = (np.array(angles) + np.append(angles[1:], TURN)) / 2
        assert [word.rstrip("+-") for word in words] == motion.states(middle)[:, j].tolist()
        side = np.sign(motion.at(middle)[2][:, j])
        for word, of_force in zip(words, side, strict=True):
            assert not word.startswith("slip") or word == ("slip+" if of_force > 0 else "slip-")
    events = {round(angle, 12) for given in case["states"] for angle, _ in given if angle}
    # Half of the last digit, and what 2 pi moves it.
    np.testing.assert_allclose(np.unique(motion.event_angle), sorted(events), rtol=0, atol=1e-11)


def marched(u, v, stiffness, normal_stiffness, friction, load):
    """Friction and normal force of samples of two periods by the law alone, sample by sample."""
    normal = np.maximum(load + normal_stiffness * v, 0.0)
    position, forces = 0.0, np.zeros(len(u))
    for i in range(2 * len(u)):
        k = i % len(u)
        reach = friction * normal[k]
        position = min(max(position, stiffness * u[k] - reach), stiffness * u[k] + reach)
        forces[k] = stiffness * u[k] - position
    return forces, normal


def check_forces(problem, motion, count=20000):
    """Compare with a slider between walls, off by what a wall moves within a sample."""
    tau = np.linspace(0, TURN, count, endpoint=False)
    x, _, friction = motion.at(tau)
    pressing, states = motion.normal_force(tau), motion.states(tau)
    displacement = problem.model.directions.toarray() @ x.T
    for group in problem.model.groups:
        sliders = group.law.spring_sliders(motion.frequency, group.values)
        names = group.law.directions
        for j, rows, values in zip(
            group.contacts, group.rows, zip(*sliders, strict=True), strict=True
        ):
            stiffness, normal_stiffness, coefficient, load, _ = values
            u, v = displacement[rows[0]], displacement[rows[-1]] * ("normal" in names)
            slider, normal = marched(u, v, stiffness, normal_stiffness, coefficient, load)
            # The static force of a contact that never slips is free.
            free = friction[:, j].mean() - slider.mean() if j in motion.neutral_contacts else 0.0
            step = stiffness * np.abs(np.diff(u)).max()
            step += coefficient * np.abs(np.diff(normal)).max()
            atol = 1.5 * step + 1e-12 * np.abs(slider).max() + 1e-15
            np.testing.assert_allclose(friction[:, j], slider + free, rtol=0, atol=atol)
            if "normal" not in names:
                continue
            size = 1e-11 * (abs(load) + normal_stiffness * np.abs(v).max())
            np.testing.assert_allclose(pressing[:, j], normal, rtol=0, atol=size)
            np.testing.assert_array_equal((states[:, j] == "apart")[normal > size], False)
            of_samples = normal.mean(), normal.min(), normal.max(), np.mean(normal == 0)
            exact = (
                motion.mean_normal_force[j],
                motion.least_normal_force[j],
                motion.largest_normal_force[j],
                motion.open_fraction[j] * max(normal.max(), 1.0),
            )
            moved = np.abs(np.diff(normal)).max() + 10 * max(normal.max(), 1.0) / count
            scale = np.array([1, 1, 1, max(normal.max(), 1.0)])
            np.testing.assert_allclose(exact, scale * of_samples, rtol=0, atol=moved + size)


@pytest.mark.parametrize(
    "seeds",
    [range(3), (186, 228), pytest.param(range(3, 200), marks=pytest.mark.slow)],
    ids=["few", "hard to find or at an edge", "many"],
)
def test_random_structures(seeds):
    """Contacts of all laws, of both preloads, in one direction or two, near and off resonance."""
    opened = 0
    for seed in seeds:
        problem, hertz = random_structure(seed)
        motion = solved(problem, hertz)
        lost = motion.friction_loss.sum() + motion.damping_loss
        assert motion.work == pytest.approx(lost, rel=1e-10), seed
        assert motion.friction_loss.min() > -1e-12
        assert motion.periodicity < 1e-11
        check_forces(problem, motion)
        opened += bool(np.any((motion.open_fraction > 0) & (motion.open_fraction < 1)))
    assert opened > len(seeds) / 2


KINDS = {
    "two-way, 18 Hz": {(STICK, 1), (1, STICK), (STICK, -1), (-1, APART), (APART, -1)},
    "two-way, 24 Hz": {(APART, STICK), (STICK, 1), (-1, APART)},
    "two-way, 27 Hz": {(APART, STICK)},
    "two blades, 24 Hz": {(APART, -1), (STICK, -1)},
    "two blades out of phase": {(STICK, 1), (-1, STICK), (1, STICK)},
}


@pytest.mark.parametrize("name", KINDS)
def test_derivative_of_the_march(name):
    """Central differences: 1e-6 of a state, error its square times higher derivatives."""
    problem, motion = found(name)
    linear, n = LinearMotion(problem, motion.frequency), problem.model.n_dof
    rng = np.random.default_rng(5)
    size = np.concatenate([motion.amplitude, motion.amplitude, linear.limits(motion.amplitude) + 1])
    seen = set()
    for _ in range(8):
        state = motion.state + 0.005 * size * rng.uniform(-1, 1, len(size))
        reach = 0.9 * linear.limits(state[:n])
        state[2 * n :] = np.clip(state[2 * n :], -reach, reach)
        run = march(linear, state, 0.99 * TURN)
        before = run.cells.state[0].copy()
        for j, after in zip(run.events[:, 1].astype(int), run.events[:, 2], strict=True):
            seen.add((before[j], after))
            before[j] = after
        step = 1e-6 * size * rng.uniform(-1, 1, len(size))
        ends = [march(linear, state + s * step, 0.99 * TURN).end for s in (1, -1)]
        np.testing.assert_allclose(
            (ends[0] - ends[1]) / 2 / size, run.jacobian @ step / size, rtol=0, atol=1e-10
        )
    assert KINDS[name] <= seen


def test_never_slipping_contact_is_centred():
    """Its static force is half-way between where it would begin to slip on either side."""
    force = sh.forces.HarmonicForce(cosine={1: [1, 0.5], 2: [0, 0.7]}, sine={1: [0.3, 1]})
    stiffness = np.array([[1e4, 3e3], [3e3, 2e4]])
    values = dict(contact_stiffness=1e4, normal_stiffness=1.5e4, friction_coefficient=0.5)
    parts = np.eye(2), np.diag([0.7, 0.9]), stiffness, force, [(0,)], [(1,)]
    problem = structure(*parts, **values, normal_load=20.0)
    motion = solved(problem, 16.0)
    assert motion.neutral_contacts.tolist() == [0]
    assert len(motion.event_angle) == 0
    assert motion.stick_fraction.tolist() == [1.0]
    assert len(motion.multipliers) == 4
    tau = np.linspace(0, TURN, 20001)
    friction, reach = motion.at(tau)[2][:, 0], 0.5 * motion.normal_force(tau)[:, 0]
    # Extremes of samples are off by the square of half a step.
    assert (reach - friction).min() == pytest.approx((reach + friction).min(), rel=1e-6)
    assert motion.friction_loss[0] == 0
    # A perturbation of the stuck, linear structure: its own damped frequencies.
    whole = stiffness + np.diag([1e4, 1.5e4])
    companion = np.block([[np.zeros((2, 2)), np.eye(2)], [-whole, -np.diag([0.7, 0.9])]])
    expected = np.exp(np.linalg.eigvals(companion) * TURN / motion.frequency)
    np.testing.assert_allclose(
        np.sort_complex(motion.multipliers), np.sort_complex(expected), rtol=1e-10
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_limit_that_moves_with_the_slider(sign):
    """Inclined so that ``k_t cos = mu k_n sin``: one limit never moves off the force."""
    cos, sin = np.cos(np.pi / 6), 0.5
    model = inclined(contact_stiffness=1e4, normal_stiffness=1e4, friction_coefficient=cos / sin)
    motion = solved(model, 18.0)
    near = solved(inclined(friction_coefficient=cos / sin * (1 + sign * 1e-7)), 18.0)
    np.testing.assert_allclose(sizes(motion), sizes(near), rtol=1e-4, atol=1e-9)
    assert motion.work == pytest.approx(motion.friction_loss[0] + motion.damping_loss, rel=1e-12)
