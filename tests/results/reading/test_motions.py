"""Phases, amplitudes, velocities and accelerations, beside closed forms and exact motions."""

import numpy as np
import pytest

import symhbm as sh
from symhbm.results.reading import HISTORIES
from tests.problems import one_blade

MASS, DAMPING, STIFFNESS = 2.0, 3.0, 1e4
LINEAR = sh.HarmonicBalance(
    sh.Model([[MASS]], [[DAMPING]], [[STIFFNESS]]), sh.forces.PointForce(amplitude=5.0)
)
BLADE = one_blade()  # fmt: skip
ANGLE = np.linspace(0, 2 * np.pi, 4001)


@pytest.fixture(scope="module")
def sweep():
    problem = sh.HarmonicBalance(BLADE, sh.forces.PointForce(), (1, 3, 5))
    return sh.frf(problem, (10, 30), over={"normal_load": [1, 3]}, progress=False)


@pytest.mark.parametrize("frequency", [3.0, 11.0, 30.0])
def test_sign_conventions_by_the_closed_form_of_a_linear_blade(frequency):
    omega = 2 * np.pi * frequency
    found = sh.datasets.motion(sh.solve(LINEAR, frequency))
    expected = 5.0 / (STIFFNESS - MASS * omega**2 + 1j * omega * DAMPING)
    assert found.complex_amplitude.item() == pytest.approx(expected, rel=1e-12)
    lag = np.arctan2(omega * DAMPING, STIFFNESS - MASS * omega**2)
    assert 0 < lag < np.pi
    assert found.phase_lag.item() == pytest.approx(lag, rel=1e-12)
    assert found.harmonic_amplitude.item() == pytest.approx(abs(expected), rel=1e-12)
    assert found.peak_to_peak.item() == pytest.approx(2 * abs(expected), rel=1e-12)
    assert found.velocity_amplitude.item() == pytest.approx(omega * abs(expected), rel=1e-12)
    accelerated = omega**2 * abs(expected)
    assert found.acceleration_amplitude.item() == pytest.approx(accelerated, rel=1e-12)


def test_extremes_are_those_of_histories(sweep):
    found = sh.datasets.motion(sweep, angle=ANGLE)
    close = dict(rtol=1e-4, atol=0, equal_nan=True)
    top, bottom = found.displacement.max("angle"), found.displacement.min("angle")
    np.testing.assert_allclose(found.peak_to_peak, top - bottom, **close)
    for name in ("velocity", "acceleration"):
        largest = np.abs(found[name]).max("angle")
        np.testing.assert_allclose(found[f"{name}_amplitude"], largest, **close)
    np.testing.assert_allclose(sweep.amplitude, np.abs(found.displacement).max("angle"), **close)


def test_histories_are_sums_of_complex_amplitudes(sweep):
    found = sh.datasets.motion(sweep, angle=ANGLE[::100])
    turn = np.exp(1j * found.harmonic * found.angle)
    dims = found.displacement.dims
    speed = 2j * np.pi * found.frequency * found.harmonic
    for power, name in enumerate(HISTORIES):
        sums = (speed**power * found.complex_amplitude * turn).sum("harmonic", skipna=False).real
        scale = float(np.abs(found[name]).max())
        np.testing.assert_allclose(found[name], sums.transpose(*dims), atol=1e-13 * scale)


def test_motion_without_truncation_agrees():
    """The exact motion marches in time and knows nothing of coefficients."""
    frequency = 19.0
    problem = sh.HarmonicBalance(BLADE, sh.forces.PointForce(), range(1, 40, 2))
    exact = sh.periodic_motion(problem, frequency)
    found = sh.datasets.motion(sh.solve(problem, frequency), angle=exact.angle.values)
    for name in ("displacement", "velocity"):
        expected = exact[name].isel(dof=0).values
        error = np.abs(found[name].isel(dof=0) - expected).max() / np.abs(expected).max()
        assert error < 1e-4
    span = exact.displacement.max("angle") - exact.displacement.min("angle")
    assert sh.datasets.motion(exact).peak_to_peak.item() == pytest.approx(span.item(), rel=1e-4)


def test_a_mean_is_no_oscillation():
    force = sh.forces.PointForce() + sh.forces.StaticLoad([200.0])
    blade = sh.Model([[MASS]], [[DAMPING]], [[STIFFNESS]])
    point = sh.solve(sh.HarmonicBalance(blade, force, (0, 1)), 5.0)
    found = sh.datasets.motion(point)
    mean, first = found.harmonic_amplitude.values[0]
    assert mean == pytest.approx(200 / STIFFNESS)
    assert found.peak_to_peak.item() == pytest.approx(2 * first)
    assert found.phase_lag.sel(harmonic=0).item() == 0.0
    assert found.velocity_amplitude.item() == pytest.approx(2 * np.pi * 5 * first)


def test_a_curve_without_peaks():
    response = sh.frf(LINEAR, (6, 10), progress=False)
    assert response.n_peaks == 0
    found = sh.datasets.motion(response, "peaks", angle=[0.0])
    assert found.complex_amplitude.shape == (0, 1, 1)
    assert len(sh.datasets.table(response, "peaks")) == 0


def test_along_another_parameter_and_without_motion():
    problem = sh.HarmonicBalance(BLADE, sh.forces.PointForce())
    followed = sh.follow(problem, "normal_load", (1, 9), frequency=19, at=[1, 9], progress=False)
    found = sh.datasets.motion(followed)
    speed = 2 * np.pi * 19 * followed.amplitude
    np.testing.assert_allclose(found.velocity_amplitude, speed.transpose(..., "dof"), rtol=1e-12)
    still = sh.datasets.motion(
        sh.solve(sh.HarmonicBalance(BLADE, sh.forces.PointForce(amplitude=0.0)), 10.0)
    )
    assert still.peak_to_peak.item() == 0.0
    assert np.isnan(still.phase_lag.item())
