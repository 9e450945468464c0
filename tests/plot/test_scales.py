"""Responses in decibels, on linear and on logarithmic axes, and their phases."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.plot.curves import drawn
from symhbm.plot.drawing import Scale
from symhbm.plot.lines import Line
from tests.paper import level
from tests.problems import one_blade, ring_of_blades

BLADE = one_blade()
PROBLEM = sh.HarmonicBalance(BLADE, sh.forces.PointForce(), (1, 3))
LINEAR = sh.HarmonicBalance(sh.Model([[1.0]], [[2.0]], [[1e4]]), sh.forces.PointForce())
FACTOR = {"m": 1.0, "mm": 1e3, "um": 1e6}


@pytest.fixture(scope="module")
def sweep():
    return sh.frf(PROBLEM, (10, 30), over={"normal_load": [1, 3]}, progress=False)


def lines_of(figure):
    """Values and heights of the lines, and those of the marks."""
    lines = [line.get_data() for line in figure.axes[0].lines]
    return [line for line in lines if len(line[0]) > 1], [one for one in lines if len(one[0]) == 1]


@pytest.mark.parametrize("unit", FACTOR)
@pytest.mark.parametrize("scale", ["decibel", "linear", "log"])
def test_points_and_peaks_are_on_the_line(sweep, scale, unit):
    figure = sh.plot.response(sweep, scale=scale, unit=unit)
    lines, marks = lines_of(figure)
    word = unit.replace("um", "µm")
    label = f"[dB re 1 {word}]" if scale == "decibel" else f"[{word}]"
    assert figure.axes[0].get_ylabel().endswith(label)
    assert figure.axes[0].get_yscale() == ("log" if scale == "log" else "linear")
    for i, (value, height) in enumerate(lines):
        curve = sh.datasets.trimmed(sweep.isel(normal_load=i))
        for at, amplitude in ((curve.frequency, curve.amplitude), (curve.peak_frequency, None)):
            expected = curve.peak_amplitude if amplitude is None else amplitude.max("dof")
            expected = FACTOR[unit] * expected.values
            expected = level(expected) if scale == "decibel" else expected
            found = height[np.searchsorted(value, at.values)]
            np.testing.assert_allclose(found, expected, rtol=1e-12)
            if amplitude is None:
                assert marks[i][1][0] == pytest.approx(expected[0], rel=1e-12)


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


def test_envelopes_have_the_same_scales():
    drawn = sh.mistuning.uniform(PROBLEM, 4, seed=1, normal_load=0.3)
    ensemble = sh.frf(PROBLEM, (10, 30), over=drawn, at=[15.0, 19.0, 20.0], progress=False)
    tuned = sh.frf(PROBLEM, (10, 30), progress=False)
    ax = sh.plot.envelope(ensemble, tuned=tuned, scale="linear", unit="mm").axes[0]
    lines = {line.get_label(): line for line in ax.lines}
    median, reference = lines["median"], lines["tuned"]
    expected = 1e3 * ensemble.amplitude.max("dof").median("sample")
    np.testing.assert_allclose(median.get_ydata(), expected, rtol=1e-12)
    top = 1e3 * tuned.peak_amplitude.item()
    assert np.max(reference.get_ydata()) == pytest.approx(top, rel=1e-9)


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


def test_phase_of_higher_harmonics_runs_on(sweep):
    ax = sh.plot.phase(sweep, harmonic=3, unit="rad").axes[0]
    for line in ax.lines:
        lag = line.get_ydata()
        assert np.nanmax(np.abs(np.diff(lag[np.isfinite(lag)]))) <= np.pi
    assert len(ax.lines) == 2
    assert ax.get_legend() is not None


BAD = {
    "scale": (lambda ds: sh.plot.response(ds, scale="db"), "scale='db'"),
    "unit": (lambda ds: sh.plot.response(ds, unit="inch"), "unit='inch'"),
    "harmonic": (lambda ds: sh.plot.phase(ds, harmonic=2), "harmonic=2"),
    "dof": (lambda ds: sh.plot.phase(ds, place=4), "place=4"),
    "phase unit": (lambda ds: sh.plot.phase(ds, unit="mm"), "unit='mm'"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_arguments(sweep, name):
    call, words = BAD[name]
    with pytest.raises(ValueError, match=words):
        call(sweep)


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
