"""Responses in decibels, on linear and on logarithmic axes, and their phases."""

import numpy as np

import symhbm as sh
from symhbm.plot.curves import drawn
from symhbm.plot.drawing import Scale
from symhbm.plot.lines import Line
from tests.paper import level
from tests.problems import ring_of_blades

LINEAR = sh.HarmonicBalance(sh.Model([[1.0]], [[2.0]], [[1e4]]), sh.forces.PointForce())


def test_a_linear_axis_has_lines_that_are_straight_on_it():
    """A slope that is straight in decibels is bent there."""
    rise = np.log(1000)
    amplitude = 1e-6 * np.array([[1.0], [1000.0]])
    stable = np.zeros(2, dtype=bool)
    line = Line(np.array([0.0, 1.0]), amplitude, rise * amplitude, rise * amplitude, stable)
    for scale in (Scale("decibel"), Scale("linear"), Scale("log")):
        value, shown, _ = drawn(line, scale)
        exact = scale.of(line.read((value[1:] + value[:-1]) / 2))
        if scale.kind == "log":
            shown, exact = np.log(shown), np.log(exact)
        distance = np.abs((shown[1:] + shown[:-1]) / 2 - exact).max()
        assert distance < 3e-4 * np.ptp(shown)


def test_phase_by_the_closed_form():
    response = sh.frf(LINEAR, (5, 30), progress=False)
    ax = sh.plot.phase(response).axes[0]
    ((value, lag),) = [line.get_data() for line in ax.lines]
    omega = 2 * np.pi * value
    exact = np.degrees(np.arctan2(2 * omega, 1e4 - omega**2))
    computed = np.isin(value, response.frequency.values)
    assert computed.sum() == response.n_points.item()
    np.testing.assert_allclose(lag[computed], exact[computed], rtol=1e-9)
    # Between the points it is a curve; straight lines are off by more than a degree.
    straight = np.interp(value, value[computed], lag[computed])
    assert np.abs(lag - exact).max() < 0.15 < 1 < np.abs(straight - exact).max()
    assert "deg" in ax.get_ylabel()


def test_lines_on_a_grid_invent_no_peaks():
    """Between points of a coarse grid slopes may promise a peak that is not located there."""
    slopes = np.array([[30.0], [-30.0], [-0.1], [np.nan]])
    amplitude = np.array([[1.0], [1.0], [0.5], [0.4]])
    line = Line(np.arange(4.0), amplitude, slopes, slopes, np.zeros(4, dtype=bool))
    value, level, _ = line.polyline()
    assert level.max() > 20
    held = line.held(line.value, amplitude[:, 0])
    at, told, _ = held.polyline()
    assert told.max() == 0.0
    np.testing.assert_allclose(told[at < 1], 0.0, atol=1e-12)
    after = value >= 1
    np.testing.assert_allclose(np.interp(value[after], at, told), level[after], atol=1e-2)
    # A located peak as high keeps the curve as its slopes tell it.
    peak = 10 ** (level.max() / 20)
    both = line.held(np.append(line.value, 0.5), np.append(amplitude[:, 0], peak))
    assert not both.straight.any()


def test_a_coarse_grid_of_a_ring_is_drawn_below_its_peaks():
    """13 blades at steps of 5 Hz: slopes beside two resonances promise 0.7 dB too much."""
    disk = ring_of_blades(13, contact_stiffness=1e6, normal_load=10)
    draws = sh.mistuning.uniform(disk, 4, seed=1, contact_stiffness=0.1).isel(sample=[3])
    problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(3))
    grid = np.arange(50.0, 351, 5)
    curve = sh.frf(problem, (50, 350), at=grid, over=draws, progress=False).isel(sample=0)
    lines = sh.plot.response(curve).axes[0].lines
    top = level(float(curve.peak_amplitude.max()))
    assert max(np.max(line.get_ydata(), initial=-np.inf) for line in lines) <= top + 1e-9


def test_straight_lines_of_what_rests_are_whole():
    """Between points of which one degree of freedom does not move, as those across a force."""
    amplitude = np.array([[0.0, 1.0], [0.0, 4.0]])
    slopes = np.array([[0.0, 30.0], [0.0, -30.0]])
    line = Line(np.arange(2.0), amplitude, slopes, slopes, np.zeros(2, dtype=bool))
    held = line.held(np.arange(2.0), amplitude[:, 1])
    assert held.straight.all()
    np.testing.assert_allclose(held.read(np.array([0, 0.5, 1])), [1, 2, 4], rtol=1e-12)
