"""Random structures with contacts that rub, open, close and stiffen: whole paths, exact motions."""

import numpy as np
import pytest
from random_contacts import random_system

import symhbm as sh
from tests.quick import quick_first

FEW, EXACT, MANY = (1,), (0,), range(60)
TRUE = (
    sh.Status.REACHED_END,
    sh.Status.OTHER_SOLUTIONS,
    sh.Status.BRANCH_POINTS,
    sh.Status.TURNED_BACK,
)
"""How paths may end: the last one where the start of the band has several responses."""
pytestmark = pytest.mark.filterwarnings("ignore:the curve is incomplete", "ignore:.*curves are")


def check_path(seed):
    """The path reaches its end, and all peaks of a scan of the same branch are among its peaks."""
    problem, band = random_system(seed)
    response = sh.frf(problem, band)
    assert response.status.item() in TRUE, response.status.item()
    if response.status.item() == sh.Status.TURNED_BACK:
        return
    scan = sh.frf(problem, band, at=np.linspace(*band, 500), keep=["amplitude"])
    if "solution" in scan.dims:
        scan = scan.isel(frequency=scan.n_solutions.values == 1, solution=0)
    frequency, amplitude = scan.frequency.values, scan.amplitude.max("dof").values
    left, middle, right = amplitude[:-2], amplitude[1:-1], amplitude[2:]
    step = (band[1] - band[0]) / 499
    neighbours = np.diff(frequency) < 1.01 * step
    highest = (middle > left) & (middle >= right) & neighbours[1:] & neighbours[:-1]
    for k in np.flatnonzero(highest) + 1:
        near = np.abs(response.peak_frequency.values - frequency[k]) < 1.5 * step
        largest = response.peak_amplitude.values[near].max(initial=0)
        assert largest >= amplitude[k] * (1 - 1e-9), (frequency[k], amplitude[k])


def check_exact(seed):
    """At three points the exact motion near the balance is within three times its stated error."""
    problem, band = random_system(seed)
    for share in (0.2, 0.45, 0.8):
        frequency = band[0] + share * (band[1] - band[0])
        found = sh.solve(problem, frequency, accuracy=1e-4)
        assert found.converged.item(), found.status.item()
        compared = sh.verify(found, exact="all", progress=False)
        difference = compared.exact_difference.item()
        assert difference <= 3 * found.truncation_error.item() + 1e-9, frequency


@pytest.mark.slow
@pytest.mark.parametrize("seed", FEW)
def test_paths_are_whole(seed):
    check_path(seed)


@pytest.mark.parametrize("seed", EXACT)
def test_exact_motions_are_within_the_stated_error(seed):
    check_exact(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", MANY)
def test_many_random_structures(seed):
    check_path(seed)
    check_exact(seed)


@pytest.mark.parametrize("seed", quick_first([1, 14, 7, 8, 9, 16], 2))
def test_nothing_moves_without_a_force(seed):
    """Of any contacts, whose round-off was taken for motions, peaks and failures."""
    problem, band = random_system(seed)
    still = problem.with_parameters(force_amplitude=0.0)
    response = sh.frf(still, band, progress=False)
    assert response.status == sh.Status.REACHED_END
    assert response.converged.all()
    assert response.n_peaks == response.n_events == 0
    assert np.all(response.coefficient == 0)
    at = sh.frf(still, band, at=np.linspace(*band, 4), progress=False)
    assert np.all(at.coefficient == 0)
    assert at.converged.all()
    assert sh.solve(still, band[0]).converged


@pytest.mark.parametrize("seed", quick_first([4, 22, 14, 16, 23], 2))
def test_static_loads_alone_hold_a_structure_in_one_place(seed):
    problem, band = random_system(seed)
    load = sh.forces.StaticLoad(np.random.default_rng(seed).uniform(-5, 5, problem.n_dof))
    loaded = sh.HarmonicBalance(problem.model, problem.excitation + load, problem.harmonics)
    still = loaded.with_parameters(force_amplitude=0.0)
    response = sh.frf(still, band, progress=False)
    assert response.status == sh.Status.REACHED_END
    assert response.n_peaks == response.n_events == 0
    states = sh.static_states(loaded).static_displacement.values
    found = response.coefficient.sel(harmonic=0, component="cos").values
    for point in found:
        assert np.abs(states - point).max(axis=1).min() < 1e-9 * np.abs(states).max()
    assert np.all(response.coefficient.sel(harmonic=[1, 2, 3]) == 0)
