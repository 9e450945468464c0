"""Responses synthesised from one nonlinear mode, beside the true ones."""

import numpy as np
import pytest

import symhbm as sh
from tests.problems import BLADE


def modes(problem, **options):
    return sh.nonlinear_modes(problem, **dict(progress=False) | options)


@pytest.mark.parametrize("amplitude", [0.3, 3.0])
def test_one_degree_of_freedom_and_one_harmonic_is_exact(amplitude):
    problem = sh.HarmonicBalance(
        sh.single_blade(**BLADE), sh.forces.PointForce(amplitude=amplitude, phase=0.4)
    )
    found = modes(problem, band=(1e-6, 1e-1))
    near = sh.datasets.synthesised_response(found)
    assert np.nanmax(near.synthesis_error) < 1e-11
    assert near.peak_synthesis_error.max() < 1e-11
    response = sh.frf(problem, (5, 60), progress=False)
    np.testing.assert_allclose(near.peak_amplitude, response.peak_amplitude, rtol=1e-10)
    np.testing.assert_allclose(near.peak_frequency, response.peak_frequency, rtol=1e-8)
    both = np.isfinite(near.frequency).all("side")
    assert (near.frequency[0, both.values] <= near.frequency[1, both.values]).all()
    # One point by hand, with its phase.
    k = int(np.flatnonzero(both)[-1])
    point = sh.solve(problem, near.frequency[1, k].item())
    np.testing.assert_allclose(near.coefficient[1, k], point.coefficient, rtol=1e-9)


def test_force_of_its_own_and_grids():
    blade = sh.single_blade(**BLADE)
    found = modes(sh.HarmonicBalance(blade), at=[1e-4, 2e-4, 3e-4])
    force = sh.forces.PointForce(amplitude=1.0)
    near = sh.datasets.synthesised_response(found, force, errors=False)
    assert near.frequency.dims == ("side", "amplitude", "solution")
    assert "synthesis_error" not in near
    problem = sh.HarmonicBalance(blade, force)
    for amplitude in (1e-4, 2e-4, 3e-4):
        for side in ("below", "above"):
            frequency = near.frequency.sel(side=side, amplitude=amplitude).item()
            point = sh.solve(problem, frequency)
            assert point.amplitude.item() == pytest.approx(amplitude, rel=1e-10)


@pytest.mark.parametrize("harmonics", [(1,), (1, 3, 5)])
def test_error_of_a_ring_is_told(harmonics):
    ring = sh.bladed_disk(13, **BLADE)
    problem = sh.HarmonicBalance(ring, sh.forces.EngineOrder(3), harmonics)
    near = sh.datasets.synthesised_response(modes(problem, nodal_diameter=3))
    response = sh.frf(problem, (5, 60), progress=False)
    difference = near.peak_amplitude.item() / response.peak_amplitude.item() - 1
    assert abs(difference) < (1e-11 if harmonics == (1,) else 5e-3)
    assert near.peak_synthesis_error.item() < (1e-11 if harmonics == (1,) else 2e-2)
    k = int(np.nanargmax(near.synthesis_error[1]))
    point = sh.solve(problem, near.frequency[1, k].item())
    away = near.coefficient[1, k].values - point.coefficient.values
    error = np.linalg.norm(away) / np.linalg.norm(point.coefficient)
    assert near.synthesis_error[1, k].item() == pytest.approx(error, rel=1e-6, abs=1e-11)
