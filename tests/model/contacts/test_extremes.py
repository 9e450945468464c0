"""Contacts at the ends of what their parameters may be, and side by side."""

import numpy as np
import pytest

import symhbm as sh
from tests.pressed_contact import shroud


@pytest.mark.parametrize(
    "contact",
    [
        shroud(normal_load=3.0),
        pytest.param(shroud(normal_load=3.0, across=(2,)), marks=pytest.mark.slow),
        sh.Gap(normal=(1,), normal_stiffness=2e4, normal_load=5.0),
    ],
    ids=["line", "plane", "stop"],
)
def test_a_small_force_has_the_response_of_a_larger_one(contact):
    """Neither slips nor opens. Round-off of loads of 3 and 5 N, which are held, moved it."""
    stiffness = np.array([[1e4, 5e2, 0], [5e2, 1.6e4, 0], [0, 0, 1.2e4]])
    model = sh.Model(np.eye(3), np.diag([2.0, 3.0, 2.0]), stiffness, contacts={"pad": contact})
    found = []
    for size in (1e-12, 1e-3):
        wave = sh.forces.HarmonicForce(cosine={1: [5, 0, 1]}, sine={1: [0, 8, 2]}, amplitude=size)
        problem = sh.HarmonicBalance(model, wave, range(4))
        response = sh.frf(problem, (15, 35), at=[17.0, 23.0, 29.0], progress=False)
        assert response.status.item() == sh.Status.REACHED_END
        found.append(response.amplitude.values / size)
    np.testing.assert_allclose(*found, rtol=1e-9)


@pytest.mark.parametrize("harmonics", [(1,), (1, 3)], ids=["closed", "located"])
def test_round_off_of_a_stiff_contact_stops_no_path(harmonics):
    """Its limit of slip is 1e-12 of a metre: one digit of a motion moves the margin by 1e-8."""
    peaks = []
    for stiffness in (1e9, 1e12):
        joint = sh.Friction(
            tangential=((0, 1),),
            contact_stiffness=stiffness, friction_coefficient=0.4, normal_load=3.0,
        )  # fmt: skip
        matrices = np.eye(2), np.diag([2.0, 3.0]), [[3e4, -1e4], [-1e4, 4e4]]
        model = sh.Model(*matrices, contacts={"joint": joint})
        problem = sh.HarmonicBalance(model, sh.forces.HarmonicForce({1: [10, 0]}), harmonics)
        response = sh.frf(problem, (15, 45), max_points=200, progress=False)
        assert response.status.item() == sh.Status.REACHED_END
        assert response.rejected_steps.item() < 80
        peaks.append(response.peak_amplitude.max().item())
    assert peaks[1] == pytest.approx(peaks[0], rel=1e-5)


def test_a_static_displacement_takes_no_digits_of_planar_friction():
    """The slider moves with it: motions of 1e-12 m beside one of 1e-8 m, at the onset of slip."""
    joint = sh.Friction(
        tangential=(0,), across=(1,),
        contact_stiffness=1e12, friction_coefficient=0.5, normal_load=2.0,
    )  # fmt: skip
    model = sh.Model(np.eye(2), np.eye(2), 1e4 * np.eye(2), contacts={"joint": joint})
    problem = sh.HarmonicBalance(model, sh.forces.HarmonicForce({1: [1, 0]}), (0, 1, 2, 3))
    rng, size = np.random.default_rng(0), problem.n_unknowns // 2
    for _ in range(20):
        motion, offset = 1e-12 * rng.normal(size=(2, size)), np.zeros((2, size))
        motion[:, 0], offset[:, 0] = 0.0, 1e-8
        margin = problem.evaluate(motion.ravel(), 100.0).states.margins[0]
        motion *= np.exp(-margin) * (1 + 10.0 ** rng.uniform(-9, -1))
        near, beside = (problem.evaluate((motion + of).ravel(), 100.0) for of in (0, offset))
        assert beside.states.margins == pytest.approx(near.states.margins, abs=1e-14)
        force = beside.residual - 1e4 * offset.ravel()
        assert force == pytest.approx(near.residual, abs=1e-11)


def problem_of(**changes):
    """Two degrees of freedom, the directions of a contact to the ground."""
    matrices = np.eye(2), np.diag([2.0, 3.0]), [[1e4, 5e2], [5e2, 1.6e4]]
    model = sh.Model(*matrices, contacts={"shroud": shroud(**(dict(normal_load=3.0) | changes))})
    wave = sh.forces.HarmonicForce(cosine={1: [5, 0]}, sine={1: [0, 8]})
    return sh.HarmonicBalance(model, wave, range(8))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hertz", "changes"), [(9.9, dict(normal=(0,))), (10.0, dict(friction_coefficient=100.0))]
)
def test_cold_starts_come_from_frequencies_beside(hertz, changes):
    problem = problem_of(**changes)
    point = sh.solve(problem, hertz)
    assert point.status.item() == sh.Status.SUCCESS
    motion = sh.periodic_motion(problem, hertz, start=point)
    np.testing.assert_allclose(point.amplitude, motion.amplitude, rtol=5e-3)
