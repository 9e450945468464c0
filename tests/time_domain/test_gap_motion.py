"""Exact motions of contacts without friction that open: three at one frequency, and limits."""

from functools import partial

import numpy as np
import pytest

import symhbm as sh
from symhbm.continuation import Status, newton
from symhbm.time_domain.exact_motion import exact_motion
from symhbm.time_domain.stability import growth
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


@pytest.mark.parametrize("gap", [0.0, 1e-9, 5e-4, 3e-3])
def test_gaps(gap):
    """A stop with a gap: its force is zero up to there, and the limit of a far one is no stop."""
    motion = solved(gap_stop(gap=gap), 14.0)
    tau = np.linspace(0, TURN, 4001)
    x, force = motion.at(tau)[0][:, 0], motion.normal_force(tau)[:, 0]
    np.testing.assert_allclose(force, 2e4 * np.maximum(x - gap, 0), rtol=0, atol=1e-12)
    assert motion.largest_normal_force[0] == pytest.approx(
        force.max(), abs=1e-5 * (1 + force.max())
    )
    touches = x.max() > gap
    assert touches == (gap < 3e-3)
    assert (motion.open_fraction[0] < 1) == touches
    if not touches:
        omega = TURN * 14
        free = abs(5 / (1e4 - omega**2 + 2j * omega))
        assert motion.amplitude[0] == pytest.approx(free, rel=1e-12)


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


@pytest.mark.parametrize("highest", [1, 3, 9])
@each_motion
def test_stability_of_balances(name, highest):
    """Exact multipliers at a truncated solution: those of the motion, but for the truncation."""
    motion = motion_of(name)
    balance = gap_stop().with_harmonics(range(highest + 1))
    start = motion.coefficients(balance.harmonics)[0].ravel()
    found = newton(partial(balance.evaluate, frequency=motion.frequency), start)
    assert found.converged
    evaluation = balance.evaluate(found.unknowns, motion.frequency)
    rate = growth(balance, motion.frequency, evaluation, found.unknowns).rate
    expected = np.log(np.abs(motion.multipliers[0])) * 21.5
    # One harmonic is a fifth off in the motion of the saddle.
    assert rate == pytest.approx(expected, rel=1e-3 if highest == 9 else 0.3)
