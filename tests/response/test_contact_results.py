"""Stored contact results against the exact periodic motion."""

import numpy as np
import pytest

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from symhbm.time_domain.exact_motion import exact_motion
from tests.problems import one_blade, ring_of_blades
from tests.quick import quick_first

RNG = np.random.default_rng(11)
HALF_STUCK = sh.HarmonicBalance(
    ring_of_blades(
        6,
        mass=RNG.uniform(0.9, 1.1, 6),
        contact_stiffness=RNG.uniform(0.8e5, 1.2e5, 6),
        normal_load=[2.0, 500.0, 4.0, 1e4, 0.0, 3.0],
    ),
    sh.forces.EngineOrder(1, amplitude=1.0),
)
EVEN = sh.HarmonicBalance(
    one_blade(normal_load=2.0),
    sh.forces.HarmonicForce(cosine={0: [0.3], 1: [1.0], 2: [0.8]}, sine={3: [0.7]}),
    (0, 1, 2, 3),
)
CASES = {
    "blade": (fig03.problem().with_parameters(normal_load=1), 15.0),
    "stuck blade": (fig03.problem().with_parameters(normal_load=300), 15.0),
    "blade with minor loops": (EVEN, 9.0),
    "ring, 6 reversals": (fig08.problem().with_parameters(engine_order=1, normal_load=10), 63.0),
    "ring at its peak": (fig08.problem().with_parameters(engine_order=3), 211.4),
    "mistuned ring, some stick": (HALF_STUCK, 40.0),
}


@pytest.mark.parametrize("name", quick_first(CASES, 3))
def test_state_reversals_stick_and_dissipation(name):
    problem, hertz = CASES[name]
    harmonics = range(24) if 0 in problem.harmonics else range(1, 32, 2)
    many = sh.HarmonicBalance(problem.model, problem.excitation, harmonics)
    response = sh.solve(many, hertz, throw=True)
    motion = exact_motion(problem, 2 * np.pi * hertz)
    assert motion.converged
    assert bool(response.contact_model_valid)
    never = np.zeros(problem.model.n_contacts, dtype=bool)
    never[motion.neutral_contacts] = True
    limit = problem.model.friction_coefficient * problem.model.normal_load
    slips = ~never | (limit == 0)
    np.testing.assert_array_equal(response.contact_state == 1, slips)
    np.testing.assert_array_equal(response.reversals, motion.reversals)
    # Angles converge with the square of the highest harmonic, energies with its cube.
    np.testing.assert_allclose(response.stick_fraction, motion.stick_fraction, atol=2e-3)
    # Next to the work of the force, which round-off of a contact that sticks is relative to.
    atol = 2e-4 * motion.friction_loss.max() + 1e-14 * motion.work
    np.testing.assert_allclose(response.dissipation, motion.friction_loss, atol=atol)


def test_what_one_harmonic_gets_wrong():
    """The figures tell the motions apart: with one harmonic the same contacts reverse twice."""
    problem, hertz = CASES["ring, 6 reversals"]
    assert sh.solve(problem, hertz).reversals.values.tolist() == [2] * 13
    assert exact_motion(problem, 2 * np.pi * hertz).reversals.tolist() == [6] * 13
