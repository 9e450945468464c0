"""Stability of smooth responses: Hill's exponents against closed forms and integrated motions."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import symhbm as sh

TURN = 2 * np.pi


def duffing(harmonics=(1,), **changes):
    model = sh.Model([[1.0]], [[0.05]], [[1.0]], contacts=[(0,)], cubic_stiffness=0.1)
    problem = sh.HarmonicBalance(model, sh.PointForce(amplitude=0.18), harmonics)
    return problem.with_parameters(**changes)


@pytest.mark.parametrize("band", [(0.5, 2.0), (2.0, 0.5)])
def test_the_branch_between_the_folds_is_unstable(band):
    curve = sh.frf(duffing(), (band[0] / TURN, band[1] / TURN), throw=True)
    folds = [int(np.flatnonzero(curve.frequency == f)[0]) for f in curve.event_frequency]
    assert len(folds) == 2
    expected = np.ones(curve.sizes["point"], dtype=int)
    expected[folds[0] + 1 : folds[1]] = 0
    # At the folds themselves the exponent is zero to round-off: not known, or by chance.
    others = np.delete(np.arange(len(expected)), folds)
    assert curve.stability.values[others].tolist() == expected[others].tolist()
    # Zero: the folds are solved to 1e-12, and the exponent goes with the root of the distance.
    assert np.all(np.abs(curve.growth_rate.values[folds]) < 1e-5)


def test_three_solutions():
    grid = sh.frf(duffing(), (0.5 / TURN, 2 / TURN), at=[1.2 / TURN])
    order = np.argsort(grid.amplitude.values.ravel())
    assert grid.stability.values.ravel()[order].tolist() == [1, 0, 1]


def test_linear_oscillator_has_its_decay_rate():
    point = sh.solve(sh.HarmonicBalance(duffing().model, sh.PointForce(amplitude=1e-9)), 0.3)
    # -c / (2 m); the cube of a motion of a nanometre is nothing.
    assert float(point.growth_rate) == pytest.approx(-0.025, rel=1e-9)
    assert int(point.stability) == 1


@pytest.mark.parametrize("omega", [0.8, 1.2, 1.5])
def test_against_the_integrated_variation(omega):
    """Multipliers of the motion of many harmonics, by a general integrator."""
    problem = duffing((1, 3, 5, 7, 9))
    grid = sh.frf(problem, (0.5 / TURN, 2 / TURN), at=[omega / TURN])
    for i in range(int(grid.n_solutions[0])):
        coefficient = grid.coefficient.values[0, i, 0]
        unknowns = coefficient.ravel()

        def rate(t, state, unknowns=unknowns):
            x = problem.basis.values(omega * t) @ unknowns
            stiffness = 1 + 0.3 * x**2
            y = state.reshape(2, 2)
            return np.array([y[1], -stiffness * y[0] - 0.05 * y[1]]).ravel()

        period = TURN / omega
        end = solve_ivp(rate, (0, period), np.eye(2).ravel(), rtol=1e-11, atol=1e-12).y[:, -1]
        largest = np.abs(np.linalg.eigvals(end.reshape(2, 2))).max()
        # The harmonics left out: the ninth is 1e-8 of the first here.
        growth = float(grid.growth_rate[0, i])
        assert np.exp(growth * period) == pytest.approx(largest, rel=1e-6)


def test_slip_is_not_known():
    model = sh.Model(
        [[1.0]],
        [[0.05]],
        [[1.0]],
        contacts=[(0,), (0,)],
        cubic_stiffness=[0.1, 0.0],
        contact_stiffness=[0.0, 1.0],
        friction_coefficient=0.5,
        normal_load=[0.0, 0.1],
    )
    curve = sh.frf(sh.HarmonicBalance(model, sh.PointForce(amplitude=0.18)), (0.05, 0.4))
    slips = curve.contact_state.values[:, 1] == 1
    assert slips.any()
    assert not slips.all()
    assert set(curve.stability.values[slips]) == {-1}
    assert np.isnan(curve.growth_rate.values[slips]).all()
    assert set(curve.stability.values[~slips]) == {1}
