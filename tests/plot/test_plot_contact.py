"""Hysteresis loops, whose area is the dissipated energy, and maps of where contacts stick."""

import numpy as np
import pytest

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from tests.loops import loops_of

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
