"""Pictures of contacts whose load varies: loops, normal forces, states over the band."""

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

import symhbm as sh
from symhbm.cli import main
from symhbm.model.contacts import Behaviour
from symhbm.plot.contact import contact_of, histories
from symhbm.plot.contact.states import _runs
from tests.loops import loops_of
from tests.paper import texts

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


def test_a_loop_with_its_moving_limit_and_events():
    point = sh.solve(*POINTS["opens"], throw=True)
    (ax,) = sh.plot.hysteresis(point).axes
    loop, history = loops_of(point)[0][()], history_of(point)
    closed, open_part, *marks, upper, lower = ax.lines
    x, y = closed.get_data()
    np.testing.assert_allclose(np.asarray(x) * 1e-6, loop.displacement, rtol=1e-14)
    broken = ~np.isfinite(y)
    np.testing.assert_array_equal(np.asarray(y)[~broken], loop.force[~broken])
    # Open stretches are lines of their own, at no force.
    apart = np.asarray(open_part.get_ydata())
    assert np.all(np.isfinite(apart[broken]))
    assert np.nanmax(np.abs(apart)) == 0
    assert np.diff(history.angle)[broken[:-1]].sum() / (2 * np.pi) == pytest.approx(
        float(point.open_fraction[0]), abs=0.01
    )
    v = point.coefficient.values.reshape(2, -1, 2)[1]
    turns = np.outer(history.angle, point.harmonic.values)
    press = 5.0 + 1e4 * (np.cos(turns) @ v[:, 0] + np.sin(turns) @ v[:, 1])
    limit = 0.3 * np.maximum(press, 0)
    np.testing.assert_allclose(lower.get_ydata(), limit, atol=1e-11)
    np.testing.assert_allclose(upper.get_ydata(), -limit, atol=1e-11)
    count = [len(line.get_xdata()) for line in marks]
    assert count == [1, 0, 1, 1]  # onset of slip, its end, opening, closing
    assert texts(ax) == ["limit $\\pm\\mu N$", "open", "onset of slip", "opening", "closing"]
    opening = np.asarray(marks[2].get_data())[:, 0]
    assert abs(opening[1]) < 1e-12


def test_normal_forces_over_the_period():
    point = sh.solve(*POINTS["opens"], throw=True)
    (ax,) = sh.plot.normal_force(point).axes
    angle, force = map(np.asarray, ax.lines[0].get_data())
    v = point.coefficient.values.reshape(2, -1, 2)[1]
    turns = np.outer(angle, point.harmonic.values)
    press = 5.0 + 1e4 * (np.cos(turns) @ v[:, 0] + np.sin(turns) @ v[:, 1])
    shown = np.isfinite(force)
    np.testing.assert_allclose(force[shown], np.maximum(press, 0)[shown], atol=1e-10)
    np.testing.assert_array_less(press[~shown], 1e-10)
    assert ax.get_xlim() == (0, 2 * np.pi)
    assert angle[0] <= 0
    assert angle[-1] >= 2 * np.pi
    assert np.nanmax(force) == pytest.approx(float(point.largest_normal_force[0]), rel=1e-3)
    (ax,) = sh.plot.normal_force(point, over="displacement").axes
    x, force = (np.asarray(part)[np.isfinite(part)] for part in ax.lines[0].get_data())
    x = np.asarray(ax.lines[0].get_xdata())[np.isfinite(ax.lines[0].get_ydata())]
    np.testing.assert_allclose(force, 5.0 + 1e4 * 1e-3 * x, atol=1e-10)


@pytest.mark.slow
def test_loops_of_archives_weights_and_gaps(tmp_path):
    """The same contact between weighted places, from an archive, with its load given as a gap."""
    plain = loops_of(sh.solve(*POINTS["opens"], throw=True))[0][()]
    by_weight = pressed(directions=({0: 1.0}, {1: 0.5}))
    twice = by_weight.with_parameters(normal_load=5.0)
    halved = loops_of(sh.solve(twice, 27.0, throw=True))[0][()]
    assert halved.area != pytest.approx(plain.area, rel=1e-3)
    by_gap = sh.solve(pressed(gap=-5e-4), 27.0, throw=True)
    sh.save(by_gap, tmp_path / "gap.nc")
    loop = loops_of(sh.load(tmp_path / "gap.nc"))[0][()]
    assert loop.area == pytest.approx(plain.area, rel=1e-9)
    np.testing.assert_allclose(np.ptp(loop.force), np.ptp(plain.force), rtol=1e-6)
    arguments = ["plot", str(tmp_path / "gap.nc"), "--kind", "normal-force", "--contact", "0"]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output


def test_families_of_loops():
    grid = sh.frf(pressed(), (15, 28), at=[16, 22, 27], over={"normal_load": [5.0, 10.0]})
    area = [loop.area for loop in loops_of(grid)[0].values()]
    np.testing.assert_allclose(area, grid.dissipation.values.ravel(), rtol=1e-3)
    (ax,) = sh.plot.hysteresis(grid).axes
    assert len(texts(ax)) == 6
    (ax,) = sh.plot.normal_force(grid).axes
    assert texts(ax)[0] == "$F_n$ = 5 N, $f$ = 16 Hz"


def test_pictures_that_cannot_be():
    point = sh.solve(*POINTS["stop"], throw=True)
    with pytest.raises(ValueError, match=r"contact=0: expected one with friction.*normal_force"):
        sh.plot.hysteresis(point)
    with pytest.raises(ValueError, match="over='time'"):
        sh.plot.normal_force(point, over="time")
    root = sh.Friction(
        tangential=(0,), contact_stiffness=1e4, friction_coefficient=0.3, normal_load=3
    )
    blade = sh.Model([[1.0]], [[2.0]], [[1e4]], contacts={"root": root})
    constant = sh.solve(sh.HarmonicBalance(blade, sh.forces.PointForce()), 15.0)
    with pytest.raises(ValueError, match=r"expected one with a normal direction.*Coulomb.*'root'"):
        sh.plot.normal_force(constant)
    assert plt.get_fignums() == []


@pytest.fixture(scope="module")
def band():
    return sh.frf(pressed(), (14, 34))


def strips(ax):
    """Ends and colours of the strips of states, and of what fills rows."""
    boxes = [collection.get_paths()[0].get_extents() for collection in ax.collections]
    colors = [mpl.colors.to_hex(each.get_facecolor()[0]) for each in ax.collections]
    return list(zip(boxes, colors, strict=True))


@pytest.mark.slow
def test_states_change_at_the_events(band):
    (ax,) = sh.plot.states(band).axes
    found = [(box.x0, box.x1, color) for box, color in strips(ax)[3:]]
    slips = [each for each in found if each[2] == "#f0a030"]
    opens = [each for each in found if each[2] == "#b03a5b"]
    onset = float(band.event_frequency.values[band.event_kind.values == "onset of opening"][0])
    assert max(end for _, end, _ in slips) == pytest.approx(onset, abs=1e-12)
    assert min(begin for begin, _, _ in opens) == pytest.approx(onset, abs=1e-12)
    assert texts(ax) == ["sticks", "slips", "opens", "open; never touches"]
    assert [label.get_text() for label in ax.get_yticklabels()] == ["contact 0"]
    # Heights are shares of the period.
    stuck = ax.collections[0].get_paths()[0].vertices
    top = {x: y for x, y in stuck if y > stuck[:, 1].min()}
    bottom, height = stuck[:, 1].min(), 0.75 * 0.94 * 0.8
    for i in (3, 20, -3):
        share = (top[float(band.frequency[i])] - bottom) / height
        assert share == pytest.approx(float(band.stick_fraction[i, 0]), abs=1e-12)


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


@pytest.mark.slow
def test_states_of_a_sweep_and_several_contacts(tmp_path):
    contacts = {
        "shroud": sh.Friction(tangential=(0,), normal=(1,), **FRICTION, normal_load=5.0),
        "stop": sh.Gap(normal=(2,), normal_stiffness=2e4, gap=2e-3),
        "root": sh.Friction(
            tangential=(2, 0), contact_stiffness=3e3, friction_coefficient=0.3, normal_load=2.0
        ),
    }
    matrices = np.eye(3), np.diag([2.0, 3.0, 2.0]), np.diag([1.5e4, 2.25e4, 1.2e4])
    force = sh.forces.HarmonicForce(cosine={1: [10, 0, 4]}, sine={1: [0, 10, 0]})
    problem = sh.HarmonicBalance(sh.Model(*matrices, contacts=contacts), force, range(4))
    at = np.linspace(14, 34, 9)
    swept = sh.frf(problem, (14, 34), at=at, over={"shroud.normal_load": [1.0, 20.0]})
    (ax,) = sh.plot.states(swept).axes
    labels = [label.get_text() for label in ax.get_yticklabels()]
    assert labels[-1] == "$F_n$ of shroud = 1 N, contact 0"
    assert len(labels) == 6
    (ax,) = sh.plot.states(swept, contact=2).axes
    labels = [label.get_text() for label in ax.get_yticklabels()]
    assert labels == ["$F_n$ of shroud = 20 N", "$F_n$ of shroud = 1 N"]
    many = xr.concat([swept] * 20, "shroud.normal_load", data_vars="minimal")
    with pytest.raises(ValueError, match="at most 40 rows, got 120"):
        sh.plot.states(many)
    with pytest.raises(ValueError, match="contact=3"):
        sh.plot.states(swept, contact=3)
    nothing = swept.assign(contact_state=xr.full_like(swept.contact_state, -1))
    with pytest.raises(ValueError, match="converged point"):
        sh.plot.states(nothing)
    # A map of the share that sticks is of those contacts that tell it.
    one = swept.isel(solution=0)
    (ax, _) = sh.plot.stick_map(one, contact="mean").axes
    shown = one.stick_fraction.isel(contact=[0, 2]).mean("contact")
    np.testing.assert_allclose(ax.collections[0].get_array(), shown, rtol=1e-14)
    sh.save(swept, tmp_path / "swept.nc")
    result = CliRunner().invoke(main, ["plot", str(tmp_path / "swept.nc"), "--kind", "states"])
    assert result.exit_code == 0, result.output
    said = CliRunner().invoke(main, ["info", str(tmp_path / "swept.nc")]).output
    assert "opening somewhere: 0" in said
    about = swept.contact_state.attrs
    assert about["flag_values"].tolist() == [-1, 0, 1, 2, 3]
    assert about["flag_meanings"] == "none stick slip open apart"


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
def test_planar_motions_in_time_have_the_history_of_their_balance():
    drawn = []
    for dataset in (sh.solve(planar(3.0), 18.5), sh.periodic_motion(planar(3.0), 18.5)):
        (history,) = histories(dataset, contact_of(dataset, 0)).of.values()
        order = np.argsort(history.angle[:-1] % (2 * np.pi))
        at = np.linspace(0.1, 6.1, 50)
        angle = history.angle[:-1][order] % (2 * np.pi)
        drawn.append([np.interp(at, angle, part[:-1][order]) for part in history.force])
    np.testing.assert_allclose(*drawn, atol=1e-2)


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
