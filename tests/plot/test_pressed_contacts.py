"""Pictures of contacts whose load varies: loops, normal forces, states over the band."""

import matplotlib as mpl
import numpy as np
import pytest

import symhbm as sh
from symhbm.model.contacts import Behaviour
from symhbm.plot.contact import contact_of, histories
from symhbm.plot.contact.states import _runs
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


def strips(ax):
    """Ends and colours of the strips of states, and of what fills rows."""
    boxes = [collection.get_paths()[0].get_extents() for collection in ax.collections]
    colors = [mpl.colors.to_hex(each.get_facecolor()[0]) for each in ax.collections]
    return list(zip(boxes, colors, strict=True))


@pytest.mark.slow
def test_states_of_stops_and_folded_paths():
    curve = sh.frf(stopped(), (10, 35))
    (ax,) = sh.plot.states(curve).axes
    (closing,) = curve.event_frequency.values[curve.event_kind.values == "end of contact"]
    grey = [box for box, color in strips(ax)[3:] if color == "#d9d9d9"]
    assert min(box.x0 for box in grey) == pytest.approx(closing, abs=1e-12)
    # A stiffening blade that folds: up, back and up again.
    folded = sh.frf(stopped(gap=2e-3, force=4.0, highest=5), (12, 30))
    assert np.sum(folded.event_kind.values == "fold") == 2
    parameter = sh.plot.drawing.moving(folded)
    runs = _runs(folded.isel(contact=0), parameter)
    assert [np.sign(run.value[-1] - run.value[0]) for run in runs] == [1, -1, 1]
    turns = np.array([runs[0].value[-1], runs[1].value[-1]])
    folds = folded.event_frequency.values[folded.event_kind.values == "fold"]
    np.testing.assert_allclose(np.sort(turns), np.sort(folds), rtol=1e-6)
    (ax,) = sh.plot.states(folded).axes
    rows = {round(box.y0, 9) for box, _ in strips(ax)}
    assert len(rows) > 6


def planar(normal_load):
    pad = sh.Friction(
        tangential=(0,), across=(1,), normal=(2,), contact_stiffness=1e4, normal_stiffness=1e4,
        friction_coefficient=0.3, normal_load=normal_load,
    )  # fmt: skip
    matrices = np.eye(3), np.diag([2.0, 2.5, 3.0]), np.diag([1e4, 1.21e4, 2.25e4])
    force = sh.forces.HarmonicForce(cosine={1: [10, 0, 6]}, sine={1: [0, 7, 0]})
    return sh.HarmonicBalance(sh.Model(*matrices, contacts=dict(pad=pad)), force, range(4))


@pytest.mark.parametrize("normal_load", [3.0, 20.0, 500.0])
@pytest.mark.slow
def test_histories_of_planar_friction(normal_load):
    response = sh.solve(planar(normal_load), 18.5)
    contact = contact_of(response, 0)
    (history,) = histories(response, contact).of.values()
    size = np.hypot(*history.force[:2])
    assert (size <= history.limit + 1e-9).all()
    slips = history.state == Behaviour.SLIPS
    np.testing.assert_allclose(size[slips], history.limit[slips], atol=1e-9)
    np.testing.assert_allclose(history.force[:, 0], history.force[:, -1], atol=1e-9)
    middle = (history.force[:2, 1:] + history.force[:2, :-1]) / 2
    work = (middle * np.diff(history.displacement[:2])).sum()
    assert work == pytest.approx(response.dissipation.item(), rel=1e-3, abs=1e-12)
    opened = (np.diff(history.angle) * (history.state[:-1] == Behaviour.OPENS)).sum()
    assert opened == pytest.approx(2 * np.pi * response.open_fraction.item(), abs=1e-9)
    sh.plot.hysteresis(response)
    sh.plot.normal_force(response)


@pytest.mark.slow
def test_a_law_without_memory_has_a_loop():
    law = sh.laws.SmoothLaw(
        lambda y, v, p: p["k"] * y**3 + p["c"] * v,
        parameters={"k": (1e7, "N/m^3"), "c": (5.0, "N s/m")},
        directions=[(0,)],
    )
    model = sh.Model([[1.0]], [[2.0]], [[1e4]], contacts={"own": law})
    problem = sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=10.0), (1, 3, 5))
    response = sh.solve(problem, 17)
    for dataset in (response, sh.periodic_motion(problem, 17)):
        (history,) = histories(dataset, contact_of(dataset, 0)).of.values()
        middle = (history.force[0, 1:] + history.force[0, :-1]) / 2
        area = (middle * np.diff(history.displacement[0])).sum()
        assert area == pytest.approx(dataset.dissipation.item(), rel=1e-3)
        sh.plot.hysteresis(dataset)
