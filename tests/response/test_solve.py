"""Single points without a guess: the paper's problems at any frequency, and reported failures."""

import sys

import numpy as np
import pytest

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from symhbm.continuation import start


def test_growing_the_force_reaches_the_same_point(monkeypatch):
    """The fall-back of a cold start against Newton's method, on a mistuned ring."""
    rng = np.random.default_rng(3)
    problem = fig08.problem().with_parameters(normal_load=rng.uniform(5, 15, 13), engine_order=3)
    omega = 2 * np.pi * 205.0
    direct = start.solve_point(problem, omega)
    begun, path = [], start.Path
    monkeypatch.setattr(start, "Path", lambda *given: begun.append(given) or path(*given))
    grown = start._grow_force(problem, start.linear_response(problem, omega), omega)
    [(_, small, amplitude, _)] = begun  # from where all contacts stick
    weaker = problem.with_parameters(force_amplitude=amplitude)
    assert weaker.locate(small, omega).margins.max() == pytest.approx(-np.log(2))
    # Both residuals are below 1e-12, amplified by the resonance (quality about 2700).
    np.testing.assert_allclose(grown, direct.unknowns, rtol=0, atol=1e-8 * np.abs(grown).max())


def test_undamped_resonance_fails_honestly():
    blade = sh.Model([[1.0]], [[0.0]], [[1.0]])
    problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    solution = sh.solve(problem, 1 / (2 * np.pi))
    assert not solution.converged
    assert np.isnan(solution.amplitude).all()
    assert "undamped resonance" in str(solution.status.values)
    with pytest.raises(sh.SolveError, match="unbounded") as caught:
        sh.solve(problem, 1 / (2 * np.pi), throw=True)
    assert not caught.value.result.converged


def test_failure_of_every_start_is_reported(monkeypatch):
    monkeypatch.setattr(sys.modules["symhbm.continuation.newton"], "MAX_ITERATIONS", 0)
    monkeypatch.setattr(start, "_grow_force", lambda *_: None)
    solution = sh.solve(fig03.problem().with_parameters(normal_load=3), 20.0)
    assert not solution.converged
    assert np.isnan(solution.coefficient).all()
    assert "did not converge" in str(solution.status.values)
    assert (solution.contact_state == -1).all()


def test_friction_diagnostics_of_the_describing_function():
    """Dissipation is 4 g (A - g/k_d), theta_star - theta_0 = acos(1 - 2 g/(k_d A))."""
    solution = sh.solve(fig03.problem().with_parameters(normal_load=3), 20.0)
    amplitude, g, kd = float(solution.amplitude[0]), 1.5, 1e4
    assert float(solution.dissipation[0]) == pytest.approx(4 * g * (amplitude - g / kd), rel=1e-12)
    angle = np.arccos(1 - 2 * g / (kd * amplitude))
    assert float(solution.theta_star[0] - solution.theta_0[0]) == pytest.approx(angle, rel=1e-12)
    assert float(solution.stick_fraction[0]) == pytest.approx(angle / np.pi, rel=1e-12)
    # Energy: the work of the force is pi f0 b_1, viscous dissipation pi c omega A^2.
    work = np.pi * float(solution.coefficient.sel(component="sin").item())
    viscous = np.pi * 0.5 * 2 * np.pi * 20.0 * amplitude**2
    assert work == pytest.approx(viscous + float(solution.dissipation[0]), rel=1e-10)
