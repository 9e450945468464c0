"""The labelled exact motion: what it holds, what it balances, and how it fails."""

import numpy as np
import pytest

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from tests.problems import duffing
from tests.refusals import refused

TURN = 2 * np.pi


@pytest.fixture(scope="module")
def ring():
    """Three reversals per half period: the point where one harmonic is a third off."""
    problem = fig08.problem((1, 3)).with_parameters(normal_load=10)
    return problem, sh.periodic_motion(problem, 63.0, harmonics=(1, 3, 5), throw=True)


def test_motion_over_the_period(ring):
    problem, motion = ring
    assert dict(motion.displacement.sizes) == {"angle": 512, "dof": 13}
    assert motion.harmonic.values.tolist() == [1, 3, 5]
    limit = problem.model.friction_coefficient * problem.model.normal_load
    # Locating an event leaves round-off of the force.
    assert np.all(np.abs(motion.friction_force) <= limit * (1 + 1e-12))
    assert np.all(motion.amplitude >= np.abs(motion.displacement).max("angle") * (1 - 1e-12))
    # The sum over samples is the coefficient but for harmonics of the number of samples.
    first = 2 * (motion.displacement * np.cos(motion.angle)).mean("angle")
    scale = float(motion.amplitude.max())
    cosine = motion.coefficient.sel(harmonic=1, component="cos")
    np.testing.assert_allclose(first, cosine, rtol=0, atol=1e-9 * scale)
    force = 2 * (motion.friction_force * np.sin(motion.angle)).mean("angle")
    sine = motion.friction_force_coefficient.sel(harmonic=1, component="sin")
    # Kinks make the coefficients of the force fall with the square of the order, 512 here.
    np.testing.assert_allclose(force, sine, rtol=0, atol=1e-4 * float(limit.max()))


def test_contacts_that_never_slip_are_neutral():
    motion = sh.periodic_motion(fig03.problem().with_parameters(normal_load=500), 20.0, throw=True)
    assert bool(motion.neutral[0])
    assert int(motion.contact_state[0]) == 0
    assert motion.sizes["event"] == 0
    linear = sh.solve(fig03.problem().with_parameters(normal_load=500), 20.0)
    # Both are the linear response.
    assert float(motion.amplitude[0]) == pytest.approx(float(linear.amplitude[0]), rel=1e-11)


NEVER = {
    "blade without friction": (
        fig03.problem().with_parameters(damping=0, normal_load=0),
        100 / TURN,
    ),
    "spring too weak to bound it": (duffing(damping=0.0, cubic=1e-30), 1 / TURN),
}


@pytest.mark.parametrize("name", NEVER)
def test_no_periodic_motion(name):
    """An undamped resonance: NaN, and a sentence."""
    problem, frequency = NEVER[name]
    motion = sh.periodic_motion(problem, frequency)
    assert not bool(motion.converged)
    assert np.isnan(motion.amplitude).all()
    assert np.isnan(motion.displacement).all()
    assert str(motion.status.values) != "success"
    with pytest.raises(sh.SolveError, match=rf"frequency={frequency:.3g}"):
        sh.periodic_motion(problem, frequency, throw=True)


test_bad_input = refused([
    (lambda: sh.periodic_motion(fig03.problem(), -1), ValueError, "frequency=-1"),
    (lambda: sh.periodic_motion(fig03.problem(), 20, n_angles=0), ValueError, "n_angles=0"),
    (lambda: sh.periodic_motion(fig03.problem(), 20, harmonics=()), ValueError, "harmonics="),
    (lambda: sh.periodic_motion(fig03.problem().model, 20.0), TypeError, "problem="),
])  # fmt: skip


def test_start_from_a_response_nearby(ring):
    """Friction alone makes one motion: the start decides how soon it is found."""
    problem, motion = ring
    for start in (motion, sh.solve(problem, 63.0), sh.solve(problem, 62.0)):
        again = sh.periodic_motion(problem, 63.0, harmonics=(1, 3, 5), start=start, throw=True)
        # A Newton step from 1e-11 of the motion, times ten for the weakest motion of the ring.
        size = float(motion.amplitude.max())
        np.testing.assert_allclose(again.amplitude, motion.amplitude, rtol=0, atol=1e-10 * size)
