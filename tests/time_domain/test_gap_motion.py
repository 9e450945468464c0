"""Exact motions of contacts without friction that open: three at one frequency, and limits."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.continuation import Status
from symhbm.time_domain.exact_motion import exact_motion
from tests.pressed_contact import TURN, gap_stop, solved, stop
from tests.reference import STATED

MOTIONS = STATED["gap_stop"]
each_motion = pytest.mark.parametrize("name", MOTIONS)


def motion_of(name):
    return solved(gap_stop(), 21.5, [MOTIONS[name][0], 0.0, 0.0])


@each_motion
def test_three_motions(name):
    """Values of another program, to half of the last of ten digits."""
    _, mean, size, given = MOTIONS[name]
    motion = motion_of(name)
    wave = motion.coefficients((0, 1))[0][0]
    assert wave[0] == pytest.approx(mean, rel=1e-9, abs=1e-17)
    assert np.hypot(*wave[1:]) == pytest.approx(size, rel=1e-9)
    np.testing.assert_allclose(np.abs(motion.multipliers), given, rtol=0, atol=5e-5)
    assert np.isreal(motion.multipliers).all() == (name == "saddle")
    # Volumes shrink as damping tells, whatever opens: the product is exp(-c T).
    loss = np.exp(-2.0 / 21.5)
    assert np.prod(motion.multipliers) == pytest.approx(loss, rel=1e-12)


@each_motion
def test_events_and_energy(name):
    motion = motion_of(name)
    assert len(motion.event_kind) == (0 if name == "closed" else 2)
    assert set(motion.event_kind) <= {"stick", "apart"}
    assert motion.friction_loss.tolist() == [0.0]
    assert len(motion.neutral_contacts) == 0
    assert motion.work == pytest.approx(motion.damping_loss, rel=1e-12)
    x = motion.at(motion.event_angle)[0][:, 0]
    np.testing.assert_allclose(x, -10 / 2e4, rtol=1e-12)
    tau = np.linspace(0, TURN, 5001)
    force = np.maximum(10 + 2e4 * motion.at(tau)[0][:, 0], 0)
    np.testing.assert_allclose(motion.normal_force(tau)[:, 0], force, rtol=0, atol=1e-12)
    assert motion.mean_normal_force[0] == pytest.approx(force[1:].mean(), rel=1e-5)
    assert motion.stick_fraction[0] + motion.open_fraction[0] == 1


def test_the_closed_form_of_opening():
    """The closed motion is linear and opens where its amplitude is the gap: ``|X| = N0 / k_n``."""
    for opens in (31.82780472, 22.51015948):
        omega = TURN * opens
        assert abs(5 / (3e4 - omega**2 + 2j * omega)) == pytest.approx(5e-4, rel=1e-8)
        closed = [
            exact_motion(gap_stop(), TURN * opens * (1 + s), [0.0, 0.0, 0.0]).open_fraction[0] == 0
            for s in (-1e-6, 1e-6)
        ]
        # The resonance of the closed contact is at 27.6 Hz.
        assert closed == [opens < 27, opens > 27]


def test_a_free_body_that_nothing_holds():
    """Without a spring and never touching it stays where it is, and drifts under a static force."""
    force = sh.forces.HarmonicForce(cosine={1: [5]})
    motion = exact_motion(stop(1, 2, 0, force, 2e4, gap=0.5), 100.0, [0.0, 0.0, 0.0])
    assert motion.converged
    assert motion.open_fraction[0] == 1
    assert motion.coefficients((1,))[0][0, 0] == pytest.approx(-5e-4 / (1 + 4e-4), rel=1e-10)
    away, towards = (sh.forces.HarmonicForce(cosine={0: [mean], 1: [5]}) for mean in (-1, 1))
    lost = exact_motion(stop(1, 2, 0, away, 2e4, gap=5e-5), 100.0)
    assert lost.status == Status.NOT_HELD
    held = solved(stop(1, 2, 0, towards, 2e4, gap=5e-5), 100.0 / TURN)
    assert held.mean_normal_force[0] == pytest.approx(1.0, rel=1e-10)
