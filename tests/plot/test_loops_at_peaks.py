"""Loops, states and maps at chosen points of curves, and groups of contacts as one."""

import numpy as np
import pytest

import symhbm as sh
from tests.problems import ring_of_blades

SLIDERS = dict(contact_stiffness=[4e3, 3e3, 2e3, 1e3], normal_load=[1.0, 2.0, 3.0, 4.0])


@pytest.fixture(scope="module")
def sliders():
    """Four sliders in parallel on one mass, Iwan's model."""
    model = sh.Model(
        [[1.0]], [[0.5]], [[1e4]], contacts=[(0,)] * 4, friction_coefficient=0.5, **SLIDERS
    )
    problem = sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=3.0), (1, 3, 5))
    return sh.frf(problem, (14, 22), progress=False)


def test_sliders_on_one_mass_are_one_loop_of_their_energy(sliders):
    top = sh.datasets.at(sliders, "peak")
    figure = sh.plot.hysteresis(sliders, contact="friction")
    [ax] = figure.axes
    x, force = ax.lines[0].get_data()
    total = float(top.dissipation.sum())
    assert np.trapezoid(force, x) * 1e-3 == pytest.approx(total, rel=1e-4)
    # All slide at the limit, and the slope of its first branch is that of all springs.
    limit = 0.5 * sum(SLIDERS["normal_load"])
    assert np.abs(force).max() == pytest.approx(limit, rel=1e-9)
    assert np.nanmax(np.diff(force) / np.diff(x)) * 1e3 == pytest.approx(1e4, rel=1e-6)
    assert ax.get_title().startswith(f"all of friction: {1e3 * total:.4g} mJ per cycle\n")


def test_contacts_that_move_apart_are_told():
    ring = sh.HarmonicBalance(ring_of_blades(7, normal_load=2), sh.forces.EngineOrder(2))
    result = sh.frf(ring, (20, 60), progress=False)
    title = sh.plot.hysteresis(result, contact="friction").axes[0].get_title()
    assert "contacts move apart" in title


@pytest.mark.parametrize("motion", [False, True])
def test_onsets_of_planar_slip_are_on_the_loops(motion):
    pad = sh.Friction(
        tangential=[(0,)], across=[(1,)], normal=[(2,)], contact_stiffness=1e4,
        normal_stiffness=1e4, friction_coefficient=0.5, normal_load=8.0,
    )  # fmt: skip
    model = sh.Model(np.eye(3), 2 * np.eye(3), np.diag([1e4, 1.3e4, 2e4]), contacts={"pad": pad})
    force = sh.forces.HarmonicForce(cosine={1: [8.0, 0, 1.0]}, sine={1: [0, 6.0, 0]})
    problem = sh.HarmonicBalance(model, force, (0, 1, 2, 3))
    result = sh.periodic_motion(problem, 17.0) if motion else sh.solve(problem, 17.0)
    [ax] = sh.plot.hysteresis(result).axes
    loops = [line for line in ax.lines if len(line.get_xdata()) > 100][:2]
    marks = [line for line in ax.lines if line.get_marker() in "^o" and len(line.get_xdata())]
    assert len(marks) == 4
    for number, mark in enumerate(marks):
        loop = loops[number // 2].get_xydata()
        for point in mark.get_xydata():
            assert np.abs(loop - point).max(axis=1).min() < 1e-9
    # An onset ends a straight part of both loops: before it force follows displacement.
    x, force = loops[0].get_data()
    onset = np.flatnonzero((x == marks[0].get_xdata()[0]) & (force == marks[0].get_ydata()[0]))[0]
    before = np.arange(onset - 6, onset + 1) % (len(x) - 1)
    slope = np.diff(force[before]) / np.diff(x[before]) * 1e3
    np.testing.assert_allclose(slope, 1e4, rtol=1e-6)
