"""Periodic motions with cubic springs: closed forms, other integrators, balances, limits."""

from functools import cache

import numpy as np
import pytest

import symhbm as sh
from studies import fig03_single_blade as fig03
from symhbm.time_domain.motion import shoot
from tests.problems import duffing as of_problems
from tests.problems import rub
from tests.refusals import refused

TURN = 2 * np.pi
NINE = (1, 3, 5, 7, 9)


def duffing(harmonics=NINE, **values):
    return of_problems(harmonics, **values)


def chain(cubic=0.3, normal_load=0.3, harmonics=(0, 1, 2, 3)):
    """Two bodies, full matrices, a static and an even force; one contact never slips."""
    model = sh.Model(
        [[1.0, 0.1], [0.1, 2.0]],
        [[0.16, -0.05], [-0.02, 0.12]],
        [[1.5, -0.5], [-0.5, 1.5]],
        contacts=[(0,), (0, 1), (1,)],
        **rub([0.4, 0.3, 0.5], 0.5, np.array([1.0, 1.0, 60.0]) * normal_load),
        cubic_stiffness=[cubic, 0.0, -0.2 * cubic],
    )
    force = sh.forces.HarmonicForce(
        cosine={0: [0.1, 0.2], 1: [0.5, 0.0], 2: [0.0, 0.2]}, sine={3: [0.1, 0.0]}
    )
    return sh.HarmonicBalance(model, force, harmonics)


def blade(cubic, harmonics=(1, 3), **values):
    values = {"normal_load": 3, "cubic_stiffness": cubic} | values
    return fig03.problem(harmonics).with_parameters(**values)


CASES = {
    "duffing": (duffing, 1.2 / TURN),
    "chain": (chain, 0.12),
    "chain without friction": (lambda: chain(normal_load=0.0), 0.12),
    "blade": (lambda: blade(1e10, np.arange(1, 32, 2)), 19.5),
    "softening blade": (lambda: blade(-1e10), 19.5),
}
each_case = pytest.mark.parametrize("name", CASES)


@cache
def solved(name):
    build, frequency = CASES[name]
    problem = build()
    return problem, sh.periodic_motion(problem, frequency, harmonics=range(32), throw=True)


def multipliers(motion):
    return motion.multiplier_real.values + 1j * motion.multiplier_imag.values


@pytest.mark.parametrize("omega", [0.8, 1.2, 1.5])
def test_all_solutions_of_harmonic_balance(omega):
    """Amplitudes and exponents of nine harmonics, each motion from its own response."""
    grid = sh.frf(duffing(), (0.3 / TURN, 2 / TURN), at=[omega / TURN])
    count = int(grid.n_solutions[0])
    assert count == (3 if omega == 1.2 else 1)
    for i in range(count):
        response = grid.isel(frequency=0, solution=i)
        motion = sh.periodic_motion(duffing(), omega / TURN, start=response, throw=True)
        seventh, ninth = np.linalg.norm(response.coefficient.values[0, -2:], axis=1)
        # The eleventh harmonic, by a decay as from the seventh to the ninth, amplified tenfold
        # where the folds are near; and the integrator's tolerance per step.
        bound = 10 * ninth**2 / seventh + 1e-11
        assert bound < 1e-7
        np.testing.assert_allclose(motion.amplitude, response.amplitude, rtol=0, atol=bound)
        largest = np.abs(multipliers(motion)).max()
        growth = float(np.exp(response.growth_rate * TURN / omega))
        assert largest == pytest.approx(growth, abs=bound + 1e-10)
        assert (largest < 1) == bool(response.stability == 1)


@each_case
def test_periodic_and_energy_balanced(name):
    """What is done is lost, to 1e-9; an unstable motion grows from the integrator's tolerance."""
    problem, motion = solved(name)
    assert float(motion.integration_tolerance) == 1e-12
    assert float(motion.periodicity) < 1e-9
    lost = float(motion.dissipation.sum() + motion.viscous_dissipation)
    assert float(motion.work) == pytest.approx(lost, rel=1e-9)
    limit = problem.model.friction_coefficient * problem.model.normal_load
    assert np.all(np.abs(motion.friction_force) <= limit * (1 + 1e-12))
    # The largest of 512 samples misses a peak by (pi / 512)^2 n^2 / 2 of harmonic n at most.
    samples = np.abs(motion.displacement).max("angle")
    assert np.all(samples <= motion.amplitude * (1 + 1e-12))
    assert np.all(samples >= motion.amplitude * (1 - 1e-2))


def test_contact_that_never_slips_is_centred():
    _, motion = solved("chain")
    force = motion.friction_force.sel(contact=2)
    assert bool(motion.neutral[2])
    assert abs(float(force.mean())) > 1e-3 * float(force.max())
    # The largest of 512 samples misses a peak by (pi / 512)^2 n^2 / 2, n up to 5.
    assert float(force.max()) == pytest.approx(-float(force.min()), rel=1e-3)


@pytest.mark.slow
def test_a_start_that_escapes():
    """Far beyond the place where a softening spring gives way; more harmonics lead back."""
    problem = duffing(cubic=-0.1)
    response = sh.solve(problem, 1 / TURN)
    response["coefficient"] = 100 * response.coefficient
    lost = shoot(problem, response.coefficient.values.ravel(), 1.0)
    assert not lost.converged
    assert "grows without bound" in lost.status
    assert sh.periodic_motion(problem, 1 / TURN, start=response).converged


def test_undamped_resonance_is_bounded_by_a_spring():
    motion = sh.periodic_motion(duffing(damping=0.0, cubic=1.0), 1 / TURN, throw=True)
    # Without damping volume is kept, and work is nothing: to the integrator's tolerance.
    assert np.prod(multipliers(motion)) == pytest.approx(1, rel=1e-10)
    assert abs(float(motion.work)) < 1e-10 * 0.18 * float(motion.amplitude[0])


GRID = sh.frf(duffing(harmonics=(1,)), (0.3 / TURN, 2 / TURN), at=[0.8 / TURN])
ONE = GRID.isel(frequency=0, solution=0)


SINGULAR = sh.Model(np.ones((2, 2)), np.eye(2), np.eye(2), contacts=[(0,)], cubic_stiffness=1.0)
BAD = [
    ("response", TypeError, "start='response': expected an xarray Dataset"),
    (GRID, ValueError, "start: expected one point"),
    (ONE.drop_vars("coefficient"), ValueError, "start: .* without .*coefficient"),
    (ONE.drop_vars("harmonic"), ValueError, "start: .* without .*harmonic"),
    (ONE.isel(component=[0]), ValueError, "start: expected .*'component': 2"),
    (ONE.isel(dof=[0, 0]), ValueError, "start: expected .*'dof': 1"),
    (ONE.assign(coefficient=ONE.coefficient * np.nan), ValueError, "start.coefficient="),
    (ONE.assign_coords(harmonic=[-1]), ValueError, "harmonic of start=-1"),
    (ONE.assign_coords(harmonic=[1.5]), ValueError, "harmonic of start=1.5"),
    (ONE.isel(harmonic=[0, 0]), ValueError, "start: expected .*'harmonic': 1"),
]
test_bad_starts_and_masses_are_refused = refused([
    *((lambda a=start, b=cubic: sh.periodic_motion(duffing((1,), cubic=b), 0.8 / TURN, start=a),
       error, words) for start, error, words in BAD for cubic in (0.1, 0.0)),
    (lambda: sh.periodic_motion(sh.HarmonicBalance(SINGULAR, sh.forces.PointForce()), 1.0,
                                start=sh.solve(duffing(), 1.0).isel(dof=[0, 0])),
     ValueError, "mass_matrix"),
])  # fmt: skip
