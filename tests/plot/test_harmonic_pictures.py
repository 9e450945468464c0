"""Bode and Nyquist plots, phase portraits, transmissibility, backbones, against closed forms."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.plot.lines import curved
from tests.problems import duffing, one_blade

LINEAR = sh.HarmonicBalance(sh.Model([[1.0]], [[5.0]], [[1e4]]), sh.forces.PointForce())
BLADE = sh.HarmonicBalance(one_blade(), sh.forces.PointForce(), (1, 3))


@pytest.fixture(scope="module")
def linear():
    return sh.frf(LINEAR, (5, 40), progress=False)


def receptance(frequency):
    omega = 2 * np.pi * np.asarray(frequency)
    return 1 / (1e4 - omega**2 + 5j * omega)


def test_nyquist_plot_is_the_receptance(linear):
    [ax] = sh.plot.nyquist(linear, unit="mm").axes
    x, y = ax.lines[0].get_data()
    expected = 1e3 * receptance(linear.frequency)
    for z in expected:  # all points are on the line
        assert np.hypot(x - z.real, y - z.imag).min() < 1e-9 * abs(expected).max()
    # Between them it stays near the curve, which is nearly a circle.
    fine = 1e3 * receptance(np.linspace(5, 40, 200_000))
    off = [np.abs(fine - z).min() for z in x + 1j * y]
    # Straight lines are 1.3 % off, some pixels of a figure.
    assert max(off) < 8e-3 * abs(expected).max()


def test_bode_plot_has_amplitude_over_phase(linear):
    figure = sh.plot.bode(linear)
    above, below = figure.axes[0].child_axes
    assert above.get_ylabel() == "amplitude [dB re 1 m]"
    x, y = above.lines[0].get_data()
    np.testing.assert_allclose(y, 20 * np.log10(abs(receptance(x))), atol=0.2)
    x, y = below.lines[0].get_data()
    np.testing.assert_allclose(y, -np.degrees(np.angle(receptance(x))), atol=3.0)


@pytest.mark.parametrize("motion", [False, True])
def test_phase_portrait_of_a_linear_motion_is_an_ellipse(motion):
    hertz = 15.0
    point = sh.periodic_motion(LINEAR, hertz) if motion else sh.solve(LINEAR, hertz)
    [ax] = sh.plot.phase_portrait(point).axes
    x, v = ax.lines[0].get_data()
    size = abs(receptance(hertz)) * {"µm": 1e6, "mm": 1e3}[ax.get_xlabel()[-3:-1]]
    np.testing.assert_allclose(
        (x / size) ** 2 + (v / (2 * np.pi * hertz * size)) ** 2, 1, rtol=1e-6
    )
    assert ax.get_title() == "15 Hz"


def test_transmissibility_of_an_isolator_is_the_textbook_one():
    isolator = sh.Model([[1.0]], [[10.0]], [[1e4]])
    problem = sh.HarmonicBalance(isolator, sh.forces.BaseMotion(displacement=1e-3))
    result = sh.frf(problem, (5, 60), progress=False)
    [ax] = sh.plot.transmissibility(result, scale="log").axes
    x, y = ax.lines[0].get_data()
    at = np.isin(x, result.frequency.values)
    omega = 2 * np.pi * x[at]
    expected = abs((1e4 + 10j * omega) / (1e4 - omega**2 + 10j * omega))
    np.testing.assert_allclose(y[at], expected, rtol=1e-9)
    assert at.sum() == result.n_points.item()


def test_the_backbone_of_a_hardening_spring_is_where_resonances_are():
    """One harmonic: omega^2 = k + 3/4 gamma a^2, on which phase resonances lie."""
    problem = duffing()
    stiffness, cubic = 1.0, float(np.max(problem.model.cubic_stiffness))
    modes = sh.nonlinear_modes(problem, band=(0.1, 4.0), progress=False)
    [ax] = sh.plot.backbone(modes, scale="linear").axes
    assert ax.get_xlabel() == "frequency $f$ [Hz]"  # over responses, too
    frequency, amplitude = ax.lines[0].get_data()
    expected = np.sqrt(stiffness + 0.75 * cubic * np.asarray(amplitude) ** 2) / (2 * np.pi)
    np.testing.assert_allclose(frequency, expected, rtol=2e-3)
    forces = {"force_amplitude": [0.05, 0.1, 0.18]}
    sweep = sh.frf(problem, (0.08, 0.32), over=forces, phase_resonances=True, progress=False)
    [ax] = sh.plot.backbone(sweep, scale="linear").axes
    marks = next(line for line in ax.lines if line.get_marker() == "<")
    found, size = marks.get_data()
    assert len(found) == 3
    expected = np.sqrt(stiffness + 0.75 * cubic * np.asarray(size) ** 2) / (2 * np.pi)
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    [ax] = sh.plot.backbone(sweep.isel(force_amplitude=1), scale="linear").axes
    [mark] = [line for line in ax.lines if line.get_marker() == "<"]
    np.testing.assert_array_equal(mark.get_data(), [found[1:2], size[1:2]])
    # Without them these are the peaks, a little above.
    [ax] = sh.plot.backbone(sweep.drop_vars("event_kind"), scale="linear").axes
    tops = sh.datasets.at(sweep, "peak")
    marks = next(line for line in ax.lines if line.get_marker() == "<")
    np.testing.assert_allclose(marks.get_xdata(), tops.frequency)


def test_modes_over_their_energy():
    modes = sh.nonlinear_modes(BLADE, progress=False)
    figure = sh.plot.nonlinear_modes(modes, over="energy")
    above, below = figure.axes[0].child_axes
    assert below.get_xlabel() == "energy [J]"
    x = above.lines[0].get_xdata()
    omega = 2 * np.pi * modes.frequency.values
    sizes = (modes.coefficient**2).sum("component").isel(dof=0)
    energy = omega**2 / 2 * (sizes.sel(harmonic=1) + 9 * sizes.sel(harmonic=3)).values
    assert x[0] == pytest.approx(energy[0])
    assert x[-1] == pytest.approx(energy[-1])
    # Small motions stick: all energy is that of the springs, too.
    amplitude = modes.amplitude.values[0]
    assert energy[0] == pytest.approx((1e4 + 1e4) / 2 * amplitude**2, rel=1e-9)


def test_curves_go_through_their_points_and_do_not_overshoot():
    x, y = np.array([0.0, 1, 2, 3, 4, 5]), np.array([0.0, 0, 1, np.nan, 1, 1])
    at, level = curved(x, y)
    known = np.isfinite(y)
    for a, b in zip(x[known], y[known], strict=True):
        assert np.hypot(at - a, level - b)[np.isfinite(at)].min() < 1e-12
    assert np.isnan(level).sum() == 1
    assert np.nanmax(level) <= 1
    assert np.nanmin(level) >= 0
    decades, _ = curved(10.0 ** np.arange(5), np.arange(5), (True, False))
    np.testing.assert_allclose(np.diff(np.log10(decades)), 1 / 8, rtol=1e-9)
