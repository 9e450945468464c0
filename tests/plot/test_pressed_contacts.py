"""Pictures of contacts whose load varies: loops, normal forces, states over the band."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.model.contacts import Behaviour
from symhbm.plot.contact import contact_of, histories
from tests.loops import loops_of

FRICTION = dict(contact_stiffness=1e4, normal_stiffness=1e4, friction_coefficient=0.3)
TURNING = sh.forces.HarmonicForce(cosine={1: [10, 0]}, sine={1: [0, 10]})


def pressed(load=5.0, directions=((0,), (1,)), highest=5, **changes):
    """A contact to the ground that presses and rubs."""
    tangential, normal = directions
    given = FRICTION | (changes or dict(normal_load=load))
    contact = sh.Friction(tangential=tangential, normal=normal, **given)
    matrices = np.eye(2), np.diag([2.0, 3.0]), np.diag([1e4, 2.25e4])
    model = sh.Model(*matrices, contacts={"shroud": contact})
    return sh.HarmonicBalance(model, TURNING, range(highest + 1))


def stopped(gap=1e-3, force=15.0, highest=3):
    """A blade behind a gap."""
    stop = sh.Gap(normal=(0,), normal_stiffness=2e4, gap=gap)
    blade = sh.Model([[1.0]], [[2.0]], [[1e4]], contacts={"stop": stop})
    return sh.HarmonicBalance(blade, sh.forces.PointForce(amplitude=force), range(highest + 1))


POINTS = {
    "slips": (pressed(), 16.0),
    "opens": (pressed(), 27.0),
    "gap and friction": (pressed(gap=2e-4), 22.0),
    "sticks": (pressed(load=500.0), 12.0),
    "stop": (stopped(), 17.0),
    "pressed stop": (stopped(gap=-1e-3), 17.0),
    "never touches": (stopped(gap=1.0), 17.0),
}


def history_of(dataset, contact=0):
    (history,) = histories(dataset, contact_of(dataset, contact)).of.values()
    return history


@pytest.mark.parametrize("name", POINTS)
def test_histories_have_the_forces_and_shares_of_the_law(name):
    problem, hertz = POINTS[name]
    point = sh.solve(problem, hertz, throw=True)
    history, basis = history_of(point), problem.basis
    group, omega = problem.groups[0], 2 * np.pi * hertz
    relative = problem.layout.relative(
        point.coefficient.values.reshape(problem.n_dof, -1)[
            :, np.r_[0, 2 : 2 * basis.highest + 2]
        ].ravel()
    )
    at = problem.contacts.at(group, relative, omega)
    expected = group.law.forces(at, group.law.locate(at)).reshape(len(history.force), -1)
    load = max(float(group.law.load(omega, at.values)[0]), 0.0)
    expected[-1, 0] += load
    # The trapezoidal rule over 512 points or more.
    middle, width = (history.angle[1:] + history.angle[:-1]) / 2, np.diff(history.angle)
    force = (history.force[:, 1:] + history.force[:, :-1]) / 2
    found = (force * width) @ basis.values(middle) * basis.norm
    size = np.abs(history.force).max() + 1e-12
    np.testing.assert_allclose(found, expected, rtol=0, atol=3e-4 * size)
    share = [width[history.state[:-1] == state].sum() / (2 * np.pi) for state in range(3)]
    assert share[Behaviour.OPENS] == pytest.approx(float(point.open_fraction[0]), abs=1e-12)
    np.testing.assert_array_equal(history.force[:, history.state == Behaviour.OPENS], 0.0)
    if len(history.force) == 2:
        assert share[Behaviour.STICKS] == pytest.approx(float(point.stick_fraction[0]), abs=1e-12)
        assert np.all(np.abs(history.force[0]) <= history.limit * (1 + 1e-9) + 1e-12)
        slips = history.state == Behaviour.SLIPS
        pull = np.abs(history.force[0, slips])
        np.testing.assert_allclose(pull, history.limit[slips], atol=1e-12)
        lost = float(point.dissipation[0])
        assert loops_of(point)[0][()].area == pytest.approx(lost, rel=1e-3, abs=1e-9)
