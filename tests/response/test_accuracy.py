"""Accuracy as an input: errors against the exact periodic motion stay within it."""

import warnings
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import symhbm as sh
from studies import fig03_single_blade as fig03
from symhbm.numerics import FourierBasis, unknowns_of
from symhbm.response.accuracy.harmonic_sets import HarmonicSets
from symhbm.response.accuracy.truncation import SMALLEST, _Search
from symhbm.time_domain.exact_motion import exact_motion
from tests.pressed_contact import two_way
from tests.problems import duffing
from tests.quick import quick_first

TURN = 2 * np.pi
ACCURACIES = (1e-2, 1e-3, 1e-4)
LOADS = (1, 5, 0.5, 2, 3, 18)


@cache
def blade(load):
    return fig03.problem().with_parameters(normal_load=load)


@cache
def exact_amplitudes(problem, frequencies):
    """Exact amplitudes (n, n_dof) [m], each motion from the neighbour's."""
    amplitudes, state = [], None
    for hertz in frequencies:
        motion = exact_motion(problem, TURN * hertz, state)
        assert motion.converged
        state = motion.state
        amplitudes.append(motion.amplitude)
    return np.array(amplitudes)


def errors(problem, response):
    """True error at each point as `truncation_error` measures it."""
    exact = exact_amplitudes(problem, tuple(response.frequency.values.tolist()))
    level = np.maximum(exact, SMALLEST * exact.max(axis=1, keepdims=True))
    return np.max(np.abs(response.amplitude.values - exact) / level, axis=1)


def assert_kept(problem, band, at, accuracy):
    response = sh.frf(problem, band, at=at, accuracy=accuracy)
    assert response.status.item() == sh.Status.REACHED_END
    true, expected = errors(problem, response), response.truncation_error.values
    assert np.all(expected <= accuracy)
    assert true.max() <= accuracy
    # An estimate: what is beyond the larger set was never more than half of it.
    assert np.all(true <= 2 * expected + 1e-8)
    return response


@pytest.mark.slow
@pytest.mark.parametrize("load", quick_first(LOADS, 1))
def test_blades(load):
    at = np.linspace(10.1, 29.9, 29)
    problem = blade(load)
    sets = [assert_kept(problem, (10, 30), at, accuracy) for accuracy in ACCURACIES]
    highest = [response.highest_harmonic.values for response in sets]
    assert np.all(highest[2] >= highest[0])
    assert len(np.unique(highest[2])) > 1


def test_the_path_is_one_curve():
    """Parts with different harmonics meet without a gap, peaks and events are told once."""
    problem, accuracy = blade(1), 1e-3
    path = sh.frf(problem, (10, 30), accuracy=accuracy)
    many = sh.frf(sh.HarmonicBalance(problem.model, problem.excitation, range(1, 34, 2)), (10, 30))
    assert np.all(np.diff(path.frequency) > 0)
    assert path.frequency[0] == 10
    assert path.frequency[-1] == 30
    assert path.event_kind.values.tolist() == many.event_kind.values.tolist()
    assert path.sizes["peak"] == many.sizes["peak"]
    np.testing.assert_allclose(path.peak_amplitude, many.peak_amplitude, rtol=accuracy)
    assert float(path.peak_truncation_error.max()) <= accuracy
    assert errors(problem, path.isel(point=slice(None, None, 4))).max() <= accuracy
    down = sh.frf(problem, (30, 10), accuracy=accuracy)
    assert np.all(np.diff(down.frequency) < 0)
    np.testing.assert_allclose(down.peak_amplitude, path.peak_amplitude, rtol=2 * accuracy)


@pytest.mark.slow
def test_more_than_can_be_had_is_said():
    point = sh.solve(blade(1), 15.0, accuracy=1e-8)
    assert point.status.item() == sh.Status.ACCURACY_NOT_REACHED
    assert bool(point.converged)
    assert 1e-8 < float(point.truncation_error) < 1e-6
    with pytest.raises(sh.SolveError, match="truncation_error"):
        sh.solve(blade(1), 15.0, accuracy=1e-8, throw=True)


def test_errors_between_the_points_of_the_path_are_reported(monkeypatch):
    """Values asked for may be less accurate than every point of a path with the same harmonics."""
    monkeypatch.setattr("symhbm.response.accuracy.harmonic_sets.HIGHEST", 9)
    problem, band, at = blade(1), (10, 13), np.linspace(10, 13, 41)

    def errors(accuracy, at=None):
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "the curve is incomplete")
            response = sh.frf(problem, band, at=at, accuracy=accuracy)
        return response.status.item(), response.truncation_error.values

    _, along = errors(1e-9)
    _, at_values = errors(1e-9, at)
    accuracy = np.sqrt(along.max() * at_values.max())
    poor = at_values > accuracy
    assert 0 < poor.sum() < len(at)
    assert at_values.max() < 2 * accuracy
    assert errors(accuracy)[0] == sh.Status.REACHED_END
    assert errors(accuracy, at[~poor])[0] == sh.Status.REACHED_END
    status, told = errors(accuracy, at[poor])
    assert status == sh.Status.ACCURACY_NOT_REACHED
    np.testing.assert_allclose(told, at_values[poor], rtol=1e-6)
    with pytest.raises(sh.SolveError, match="truncation_error"):
        sh.frf(problem, band, at=at[poor], accuracy=accuracy, throw=True)


@pytest.mark.slow
def test_folding_responses():
    """Smooth forces: a geometric fall, and errors measured across the path, as folds move too."""
    problem = duffing()
    path = sh.frf(problem, (0.08, 0.32), accuracy=1e-3)
    assert path.status.item() == sh.Status.REACHED_END
    assert 1 < path.sizes["harmonic"] < 5
    assert path.event_kind.values.tolist() == ["fold", "fold"]
    verified = sh.verify(path, exact=20)
    away = np.abs(path.frequency - path.event_frequency).min("event") > 1e-3
    # At the folds the exact motion is another one at the same frequency.
    assert float(verified.exact_difference.where(away).max()) <= 1e-3
    grid = sh.frf(problem, (0.08, 0.32), at=[0.15, 0.19, 0.21], accuracy=1e-4)
    assert grid.n_solutions.values.tolist() == [1, 3, 1]
    assert float(grid.truncation_error.max()) <= 1e-4


def test_sets_grow_as_symmetry_allows():
    model = sh.Model(
        np.eye(2), 0.1 * np.eye(2), [[2.0, -1], [-1, 2]], [(0, 1)], 5, 0.5, normal_load=1.0
    )
    force = sh.forces.HarmonicForce(cosine={0: [1.0, 0.0], 1: [0.0, 2.0]})
    problem = sh.HarmonicBalance(model, force, (0, 1))
    full = HarmonicSets(problem)
    assert [full.harmonics(level)[-1] for level in range(5)] == [1, 2, 3, 4, 5]
    assert full.harmonics(3) == (0, 1, 2, 3, 4)
    odd = HarmonicSets(sh.HarmonicBalance(model, sh.forces.PointForce(), (1, 5)))
    assert [odd.harmonics(level) for level in range(2)] == [(1, 3, 5), (1, 3, 5, 7)]
    third = HarmonicSets(sh.HarmonicBalance(model, sh.forces.HarmonicForce({3: [1.0, 0.0]}), (3,)))
    assert third.harmonics(1) == (3, 9)
    # The change is of harmonic 7 alone; beyond the larger set errors fall with the cube of 5 / 15.
    share = np.array([1.0, 0, 0, 1, 0, 0, 0, 0])
    least = (5 / odd.harmonics(odd.larger(0))[-1]) ** 3
    assert [odd.expected(0, 1.0, share, f * least) for f in (1.01, 0.99)] == [1, odd.level(19)]


def test_what_larger_sets_accept_at_once_is_not_solved_for():
    evaluation = SimpleNamespace(norm=1e-14, residual=np.full(2, 1e-3), jacobian=np.eye(2))
    larger: Any = SimpleNamespace(evaluate=lambda *_, **__: evaluation)
    search = _Search(larger, 1.0, np.ones(2), np.zeros(2))
    search.advance(None)
    assert (search.converged, search.running, search.solves) == (True, False, 0)


@pytest.mark.slow
@pytest.mark.parametrize("hertz", quick_first([18, 27], 1))
def test_normal_forces_are_within_their_estimate(hertz):
    problem = two_way()
    exact = sh.periodic_motion(problem, hertz, n_angles=4096)
    force = exact.normal_force.isel(contact=0).values
    for accuracy in (1e-2, 1e-4):
        response = sh.solve(problem, hertz, accuracy=accuracy)
        basis = FourierBasis(tuple(response.harmonic.values.tolist()))
        wave = unknowns_of(basis, basis.harmonics, response.coefficient.values)
        moved = basis.values(exact.angle.values) @ wave.reshape(2, -1)[1]
        error = np.abs(np.maximum(5 + 1e4 * moved, 0) - force).max() / force.max()
        estimate = response.normal_force_error.item()
        assert error <= estimate <= response.truncation_error.item() <= accuracy
        assert estimate < 30 * error
        least = abs(response.least_normal_force - exact.least_normal_force).item()
        assert least <= estimate * force.max()
        assert abs(response.open_fraction - exact.open_fraction) < 0.5 * accuracy


def test_curves_have_errors_of_normal_forces():
    response = sh.frf(two_way(), (20, 26), accuracy=1e-3, progress=False)
    errors = response.normal_force_error.isel(contact=0)
    assert (errors <= response.truncation_error).all()
    assert 0 < errors.max() <= 1e-3


def chain(n=12):
    """Masses on springs with two contacts and a free end, which is driven."""
    ones = np.ones(n)
    stiffness = 4e3 * (np.diag(2 * ones) - np.diag(ones[1:], 1) - np.diag(ones[1:], -1))
    stiffness[-1, -1] /= 2
    return sh.Model(
        np.eye(n),
        0.3 * np.eye(n) + 1e-4 * stiffness,
        stiffness,
        contacts=[(4,), (7, 9)],
        contact_stiffness=[3e3, 2e3],
        friction_coefficient=0.5,
        normal_load=[1.0, 0.5],
    )


def condensed_chain(harmonics):
    force = sh.forces.PointForce(11, amplitude=3.0)
    small = sh.condense(chain(), force, (0.6, 2.2), harmonics, places=range(8, 12), progress=False)
    return sh.HarmonicBalance(small, force)


@pytest.mark.slow
def test_a_condensed_structure_has_the_accuracy_of_the_whole():
    small = condensed_chain(range(1, 34, 2))
    whole = sh.HarmonicBalance(chain(), small.excitation)
    both = [sh.frf(p, (0.8, 1.6), accuracy=2e-2, progress=False) for p in (whole, small)]
    assert both[0].status == both[1].status == "the end of the band was reached"
    assert both[1].highest_harmonic.max() > 1
    assert both[1].truncation_error.max() <= 2e-2
    # Each within its accuracy of the exact response, at the peak of the same free end.
    heights = [b.peak_amplitude.max().item() for b in both]
    np.testing.assert_allclose(heights[1], heights[0], rtol=2e-2)
    verified = sh.verify(both[1], progress=False)
    assert '"passed": true' in verified.attrs["verification"]
    assert sh.datasets.rebuild(both[1]).harmonics == tuple(both[1].harmonic.values)
    # One harmonic alone is not as accurate.
    coarse = sh.frf(small, (0.8, 1.6), progress=False).peak_amplitude.max().item()
    assert abs(coarse / heights[1] - 1) > 1e-4


def test_a_condensed_structure_says_which_harmonics_it_lacks():
    for verb in (sh.frf, sh.solve):
        with pytest.raises(ValueError, match=r"condensed for harmonics=\(1, 3, 5\) at least"):
            verb(condensed_chain((1, 3)), (0.8, 1.6) if verb is sh.frf else 1.1, accuracy=1e-2)
    few = condensed_chain((1, 3, 5))
    with pytest.warns(RuntimeWarning, match="not as accurate|not every response") as told:
        response = sh.frf(few, (0.8, 1.6), accuracy=1e-3, progress=False)
    assert "condense the structure for more harmonics, about harmonics=(1, 3, 5," in str(
        told[0].message
    )
    assert response.highest_harmonic.max() == 1
    point = sh.solve(few, 1.1, accuracy=1e-3)
    assert "about harmonics=(1, 3, 5," in str(point.status.item())
