"""Hysteresis loops, whose area is the dissipated energy, and maps of where contacts stick."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from tests.loops import loops_of
from tests.paper import texts
from tests.problems import duffing

EVEN = sh.HarmonicBalance(
    fig03.problem().model.with_parameters(normal_load=2.0),
    sh.forces.HarmonicForce(cosine={0: [0.3], 1: [1.0], 2: [0.8]}, sine={3: [0.7]}),
    (0, 1, 2, 3),
)
RING = fig08.problem((1, 3, 5)).with_parameters(engine_order=1, normal_load=10)
POINTS = {
    "one harmonic": (fig03.problem().with_parameters(normal_load=1), 15.0),
    "never slips": (fig03.problem((1, 3)).with_parameters(normal_load=300), 15.0),
    "no limit": (fig03.problem((1, 3)).with_parameters(normal_load=0), 15.0),
    "no motion of the contact": (fig08.problem().with_parameters(engine_order=0), 15.0),
    "minor loops": (EVEN, 9.0),
    "ring, 6 reversals": (RING, 63.0),
}


def one_loop(dataset, contact=0):
    loops, _, dims = loops_of(dataset, contact)
    assert dims == []
    return loops[()]


@pytest.mark.parametrize("name", POINTS)
def test_area_of_the_loop_is_the_dissipation(name):
    problem, hertz = POINTS[name]
    point = sh.solve(problem, hertz, throw=True)
    last = problem.model.n_contacts - 1
    for contact in {0, last}:
        loop = one_loop(point, contact)
        limit = float(point.friction_coefficient[contact] * point.normal_load[contact])
        # Round-off, next to the energy of the spring and of the limit over the travel.
        scale = max(limit, np.abs(loop.force).max()) * np.ptp(loop.displacement) + 1e-30
        lost = float(point.dissipation[contact])
        assert loop.area == pytest.approx(lost, rel=1e-9, abs=1e-12 * scale)
        assert np.all(np.abs(loop.force) <= limit * (1 + 1e-9) + 1e-12)
        assert len(loop.onset) == len(loop.end)
        # Between points it moves by the spring at most: no jump at any event.
        step = float(point.contact_stiffness[contact]) * np.abs(np.diff(loop.displacement))
        assert np.all(np.abs(np.diff(loop.force)) <= step + 1e-9 * (limit + 1e-9))
        assert np.all(np.diff(loop.angle) >= 0)


@pytest.mark.parametrize(
    "name", ["one harmonic", "never slips", "minor loops", "ring, 6 reversals"]
)
def test_exact_motions(name):
    problem, hertz = POINTS[name]
    motion = sh.periodic_motion(problem, hertz, throw=True)
    loop = one_loop(motion)
    lost = float(motion.dissipation[0])
    scale = float(np.abs(loop.force).max() * np.ptp(loop.displacement))
    # Round-off: straight between events, at which the motion is of fourth order over 512 angles.
    assert loop.area == pytest.approx(lost, rel=1e-7, abs=1e-9 * scale)
    kinds = motion.event_kind.values[motion.event_contact.values == 0]
    assert len(loop.onset) == np.sum(kinds == "onset of slip")
    assert len(loop.end) == np.sum(kinds == "end of slip")
    limit = float(motion.friction_coefficient[0] * motion.normal_load[0])
    np.testing.assert_array_equal(np.abs(loop.force[loop.onset]), limit)


def test_marched_force_of_many_harmonics_is_that_of_the_exact_motion():
    problem, hertz = POINTS["minor loops"]
    many = sh.HarmonicBalance(problem.model, problem.excitation, range(24))
    marched = one_loop(sh.solve(many, hertz, throw=True))
    exact = sh.periodic_motion(problem, hertz, throw=True)
    turned = marched.angle % (2 * np.pi)
    force = np.interp(exact.angle, turned[np.argsort(turned)], marched.force[np.argsort(turned)])
    # Left out harmonics, and lines between 512 angles.
    np.testing.assert_allclose(force, exact.friction_force[:, 0], rtol=0, atol=2e-3)


def test_loop_of_one_point_is_drawn():
    point = sh.solve(*POINTS["one harmonic"])
    figure = sh.plot.hysteresis(point)
    (ax,) = figure.axes
    loop = one_loop(point)
    x, y = ax.lines[0].get_data()
    assert ax.get_xlabel() == "relative displacement [µm]"
    np.testing.assert_allclose(np.asarray(x) * 1e-6, loop.displacement, rtol=1e-14)
    np.testing.assert_array_equal(y, loop.force)
    # Two onsets at both limits, at the angle of the dataset.
    onset = np.asarray(ax.lines[1].get_data())
    np.testing.assert_allclose(np.sort(onset[1]), [-0.5, 0.5])
    star = float(point.theta_star[0])
    at = (loop.angle[loop.onset] - star) % (2 * np.pi)
    assert np.minimum(at, 2 * np.pi - at).min() < 1e-12
    assert f"{1e6 * float(point.dissipation[0]):.4g} µJ per cycle" in ax.get_title()


def test_families():
    grid = sh.frf(fig03.problem(), (10, 30), at=[12, 15, 20], over={"normal_load": [1, 3]})
    loops, _, dims = loops_of(grid)
    assert dims == ["normal_load", "frequency"]
    areas = np.array([loop.area for loop in loops.values()]).reshape(2, 3)
    np.testing.assert_allclose(areas, grid.dissipation[..., 0], rtol=1e-9, atol=1e-15)
    (ax,) = sh.plot.hysteresis(grid).axes
    assert texts(ax)[1] == "$F_n$ = 1 N, $f$ = 15 Hz"
    missing = grid.assign(coefficient=grid.coefficient.where(grid.frequency != 15))
    (ax,) = sh.plot.hysteresis(missing).axes
    assert ax.get_title() == "left out, not converged: 2 of 6 points"
    with pytest.raises(ValueError, match="converged"):
        sh.plot.hysteresis(missing.sel(frequency=15))


def test_paths_and_followed_parameters():
    paths = sh.frf(fig03.problem(), (14, 18), over={"normal_load": [1, 100]})
    loops, _, _ = loops_of(paths)
    # What only pads the shorter path is no point.
    assert len(loops) == int(np.isfinite(paths.frequency).sum()) < paths.frequency.size
    assert None not in loops.values()
    ring = fig08.problem().with_parameters(engine_order=3)
    followed = sh.follow(ring, "normal_load[2]", (1, 50), frequency=211.4)
    for contact in (2, 3):
        loops, shown, dims = loops_of(followed, contact)
        assert dims == ["normal_load"]
        area = [loop.area for loop in loops.values()]
        expected = followed.dissipation.isel(contact=contact)
        np.testing.assert_allclose(area, expected, rtol=1e-8, atol=1e-12)
        assert shown.normal_load.size == len(area)
    # Of so many points that at the largest response is drawn alone.
    (ax,) = sh.plot.hysteresis(followed, contact=2).axes
    assert len(loops) > 14
    assert ", largest point" in ax.get_title()


def test_a_motion_that_did_not_converge():
    blade = fig03.problem().model.with_parameters(damping=0, normal_load=0)
    motion = sh.periodic_motion(
        sh.HarmonicBalance(blade, sh.forces.PointForce()), 100 / (2 * np.pi)
    )
    with pytest.raises(ValueError, match="converged"):
        sh.plot.hysteresis(motion)
    assert plt.get_fignums() == []


LOADS = [100.0, 1.0, 3.0, 10.0]


@pytest.fixture(scope="module")
def grid():
    at = np.array([10, 14, 15, 16, 20, 21, 23, 30.0])
    return sh.frf(fig03.problem(), (10, 30), at=at, over={"normal_load": LOADS})


def test_cells_of_a_map(grid):
    ax, bar = sh.plot.stick_map(grid).axes
    mesh = ax.collections[0]
    expected = grid.stick_fraction.isel(contact=0).sortby("normal_load")
    np.testing.assert_array_equal(mesh.get_array(), expected)
    corners = mesh.get_coordinates()
    np.testing.assert_allclose(corners[0, :, 0], [8, 12, 14.5, 15.5, 18, 20.5, 22, 26.5, 33.5])
    # Half-way in logarithms, and as far beyond the first and the last.
    edges = [3**-0.5, 3**0.5, 30**0.5, 1000**0.5, 1000**1.5 / 100]
    np.testing.assert_allclose(corners[:, 0, 1], np.array([*edges[:4], 1e4 / 1000**0.5]))
    assert ax.get_yscale() == "log"
    assert ax.get_xscale() == "linear"
    assert mesh.get_clim() == (0, 1)
    assert "sticks" in bar.get_ylabel()


def test_line_between_stick_and_slip(grid):
    ax, _ = sh.plot.stick_map(grid).axes
    mesh, line = ax.collections[0], ax.collections[-1]
    slips = np.asarray(mesh.get_array()) < 1
    # As many pieces as neighbours of different states.
    count = np.sum(slips[1:] != slips[:-1]) + np.sum(slips[:, 1:] != slips[:, :-1])
    assert len(line.get_segments()) == count > 4


@pytest.mark.slow
def test_mean_and_least_of_the_contacts():
    loads = xr.DataArray(np.random.default_rng(2).uniform(2, 20, (3, 13)), dims=("draw", "contact"))
    ring = fig08.problem().with_parameters(engine_order=3)
    one_free = ring.with_parameters(contact_stiffness=[*[1e6] * 12, 0.0])
    dataset = sh.frf(one_free, (190, 230), at=[195, 200, 210], over={"normal_load": loads})
    rubbing = dataset.stick_fraction.isel(contact=slice(12))
    for word, expected in (("mean", rubbing.mean("contact")), ("least", rubbing.min("contact"))):
        ax, _ = sh.plot.stick_map(dataset, contact=word, over="draw").axes
        np.testing.assert_allclose(ax.collections[0].get_array(), expected, rtol=1e-14)
        assert ax.get_ylabel() == "draw"
    with pytest.raises(ValueError, match="dimension case as well"):
        sh.plot.stick_map(dataset.expand_dims(case=2), over="draw")
    assert len(plt.get_fignums()) == 2


def test_holes_are_hatched(grid):
    holed = grid.assign(
        stick_fraction=grid.stick_fraction.where((grid.frequency != 20) | (grid.normal_load != 3))
    )
    ax, _ = sh.plot.stick_map(holed).axes
    assert np.argwhere(ax.collections[0].get_array().mask).tolist() == [[1, 4]]
    assert ax.patch.get_hatch()
    assert "hatched: 3.1 % without values" in ax.get_title()


def test_maps_of_paths_change_at_the_events():
    loads = [1.0, 2.0, 3.0]
    paths = sh.frf(fig03.problem(), (30, 10), over={"normal_load": loads})
    ax, _ = sh.plot.stick_map(paths).axes
    table, centre = ax.collections[0].get_array(), np.linspace(10, 30, 600)
    for row, load in enumerate(loads):
        one = paths.sel(normal_load=load)
        for hertz in one.event_frequency.dropna("event").values:
            cell = np.searchsorted(centre, hertz)
            near = np.asarray(table[row, cell - 1 : cell + 1])
            # At its limit a contact sticks but for the root of round-off.
            assert (near < 1 - 1e-6).tolist() in ([True, False], [False, True])
    paths.stick_fraction[1, 5] = np.nan
    ax, _ = sh.plot.stick_map(paths).axes
    table = ax.collections[0].get_array()
    hole = np.sort(paths.frequency.values[1, [4, 6]])
    inside = (centre > hole[0]) & (centre < hole[1])
    np.testing.assert_array_equal(table.mask[1], inside)
    assert not table.mask[[0, 2]].any()


def test_maps_that_cannot_be(grid):
    with pytest.raises(ValueError, match="this is one"):
        sh.plot.stick_map(grid.isel(normal_load=0))
    with pytest.raises(ValueError, match="twice"):
        sh.plot.stick_map(grid.isel(normal_load=[0, 1, 1]))
    folded = sh.frf(duffing(), (0.08, 0.32), over={"cubic_stiffness": [0.1, 0.11]})
    with pytest.raises(ValueError, match="do not fold"):
        sh.plot.stick_map(folded)
    assert plt.get_fignums() == []
