"""Hysteresis loops, whose area is the dissipated energy, and maps of where contacts stick."""

import numpy as np

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
