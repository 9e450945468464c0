"""Peaks as constrained maxima: their derivatives against differences, closed forms and frf."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import symhbm as sh
from symhbm.balance.second_order import SecondOrder
from symhbm.continuation.between.peaks import PeakKind
from symhbm.continuation.following import follow_branch
from symhbm.continuation.problem import FrequencyProblem
from symhbm.numerics.check import RADIANS
from symhbm.peaks.conditions import Conditions, solve
from symhbm.peaks.maximum import Maximum, MaximumKind
from tests.problems import one_blade, ring_of_blades

NAMES = ("contact_stiffness", "friction_coefficient", "normal_load", "mass", "stiffness")
NAMES += ("damping", "force_amplitude")


def blade(harmonics=(1,), **values):
    model = one_blade()
    return sh.HarmonicBalance(model.with_parameters(**values), sh.forces.PointForce(), harmonics)


def ring(harmonics, seed=3, n_blades=3):
    rng = np.random.default_rng(seed)
    model = ring_of_blades(
        n_blades,
        stiffness=1e4 * rng.uniform(0.99, 1.01, n_blades),
        contact_stiffness=1e5 * rng.uniform(0.8, 1.2, n_blades),
        friction_coefficient=0.5 * rng.uniform(0.8, 1.2, n_blades),
        normal_load=20 * rng.uniform(0.7, 1.3, n_blades),
    )
    return sh.HarmonicBalance(model, sh.forces.EngineOrder(1), harmonics)


def duffing():
    model = one_blade(
        stiffness=1, damping=0.05, contact_stiffness=0.2, normal_load=0.05, cubic_stiffness=0.1
    )
    return sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=0.18), (1, 3))


def looping(harmonics=(1, 3), seed=3):
    """Four blades whose responses peak at corners where a small loop reaches its limit."""
    rng = np.random.default_rng(seed)
    model = ring_of_blades(
        4,
        stiffness=1e4 * rng.uniform(0.95, 1.05, 4),
        contact_stiffness=1e6 * rng.uniform(0.8, 1.2, 4),
        friction_coefficient=0.5 * rng.uniform(0.6, 1.4, 4),
        normal_load=2.0 * rng.uniform(0.7, 1.3, 4),
    )
    return sh.HarmonicBalance(model, sh.forces.EngineOrder(1), harmonics)


CASES = {
    "blade 1": (blade, (10, 40)),
    "blade 1 3 5": (lambda: blade((1, 3, 5)), (10, 40)),
    "ring 1": (lambda: ring((1,)), (50, 110)),
    "ring 1 3": (lambda: ring((1, 3)), (50, 110)),
    "ring 0 1 2": (lambda: ring((0, 1, 2)), (50, 110)),
    "cubic": (duffing, (0.08, 0.32)),
    "loops 1 3": (looping, (90, 96)),
}


@cache
def solved(case):
    """Second derivatives of a case, and its highest maxima of each kind with their conditions."""
    make, band = CASES[case]
    problem = make()
    names = (*NAMES, *(("cubic_stiffness",) if case == "cubic" else ()))
    second_order = SecondOrder(problem, names)
    branch = follow_branch(
        FrequencyProblem(problem), (RADIANS * band[0], RADIANS * band[1]), 5000, True
    )
    chosen = {}
    for peak in sorted(branch.peaks, key=lambda peak: -peak.amplitude):
        assert peak.kind != PeakKind.UNBOUNDED
        same_kind = chosen.setdefault(peak.kind, [])
        if len(same_kind) < 2:
            same_kind.append(Maximum.at_peak(problem, peak))
    maxima = [maximum for same_kind in chosen.values() for maximum in same_kind]
    return second_order, [
        (maximum, solve(Conditions.of(second_order, maximum))) for maximum in maxima
    ]


def values_of(problem, names):
    return np.concatenate([np.atleast_1d(problem.parameters[name]) for name in names])


def solved_at(conditions, change):
    """The maximum at parameters that differ by ``change``."""
    maximum, second_order = conditions.maximum, conditions.second_order
    problem, n = maximum.problem, maximum.problem.n_unknowns
    values = values_of(problem, second_order.names) + change
    chosen = {
        name: values[columns.start - n - 1 : columns.stop - n - 1]
        for name, columns in second_order.places.items()
    }
    chosen["force_amplitude"] = float(chosen["force_amplitude"][0])
    start = replace(maximum, problem=problem.with_parameters(**chosen))
    solution = solve(Conditions.of(second_order, start))
    assert solution is not None
    return solution


def differences(conditions, direction, step):
    """Central differences of amplitude, frequency and both gradients in one direction."""
    low, high = (solved_at(conditions, sign * step * direction) for sign in (-1, 1))
    pairs = (
        (high.maximum.amplitude, low.maximum.amplitude),
        (high.maximum.frequency, low.maximum.frequency),
        (high.gradient, low.gradient),
        (high.frequency_gradient, low.frequency_gradient),
    )
    return [(above - below) / (2 * step) for above, below in pairs]


def test_kinds_of_peaks():
    kinds = {(case, str(s.kind)) for case in CASES for s, _ in solved(case)[1]}
    assert kinds >= {(case, "smooth") for case in CASES if case != "loops 1 3"}
    assert kinds >= {("ring 1", "corner"), ("ring 1 3", "corner"), ("ring 0 1 2", "corner")}
    # Loops back to the limit they began at, and across to the other.
    loops = [s.loop for s, _ in solved("loops 1 3")[1] if s.kind == MaximumKind.CORNER]
    assert {loop.returns for loop in loops} == {True, False}


@pytest.mark.parametrize("case", CASES)
def test_located_peaks_are_solutions(case):
    for maximum, conditions in solved(case)[1]:
        assert conditions is not None
        assert conditions.stationarity < 1e-9
        # Both are solved to round-off; the amplitude of a peak is stationary.
        assert conditions.maximum.amplitude == pytest.approx(maximum.amplitude, rel=1e-12)
        assert conditions.maximum.frequency == pytest.approx(maximum.frequency, rel=1e-7)


@pytest.mark.parametrize("case", CASES)
def test_derivatives_of_peaks(case):
    rng = np.random.default_rng(1)
    second_order, peaks = solved(case)
    for _, conditions in peaks:
        values = values_of(conditions.maximum.problem, second_order.names)
        direction = values * rng.normal(size=len(values))
        coarse, fine = (differences(conditions, direction, step) for step in (1e-5, 5e-6))
        exact = (
            conditions.gradient @ direction,
            conditions.frequency_gradient @ direction,
            conditions.hessian @ direction,
            conditions.frequency_hessian @ direction,
        )
        levels = (
            np.linalg.norm(conditions.gradient * values),
            np.linalg.norm(conditions.frequency_gradient * values),
            np.linalg.norm(conditions.hessian * np.outer(values, values)),
            np.linalg.norm(conditions.frequency_hessian * np.outer(values, values)),
        )
        scales = 1.0, 1.0, values, values
        # Peaks are solved to some 1e-13 of themselves, which steps of 1e-5 make 1e-8; what the
        # square of the step adds, two steps tell.
        for bound, one, other, true, level, scale in zip(
            (1e-7, 1e-6, 1e-5, 1e-5), coarse, fine, exact, levels, scales, strict=True
        ):
            doubt = np.linalg.norm((one - other) * scale) / level
            assert doubt < 1e-4
            best = other + (other - one) / 3
            assert np.linalg.norm((best - true) * scale) / level < bound + doubt / 3


@pytest.mark.parametrize("case", CASES)
def test_symmetry_and_scaling_of_derivatives(case):
    second_order, peaks = solved(case)
    for _, conditions in peaks:
        n = conditions.maximum.problem.n_unknowns
        np.testing.assert_allclose(
            conditions.hessian, conditions.hessian.T, atol=1e-9 * np.abs(conditions.hessian).max()
        )
        bend = conditions.frequency_hessian
        np.testing.assert_allclose(bend, bend.T, atol=1e-9 * np.abs(bend).max())
        # Adjoint and direct derivatives of the frequency; the conditions are solved to 1e-9.
        direct = conditions.by_parameters[n]
        np.testing.assert_allclose(
            conditions.frequency_gradient, direct, atol=1e-9 * np.abs(direct).max()
        )
        # Twice the force and twice the limits move every contact twice as far.
        if case == "cubic":
            continue
        problem = conditions.maximum.problem
        by = {
            name: conditions.gradient[columns.start - n - 1 : columns.stop - n - 1]
            for name, columns in second_order.places.items()
        }
        scaled = by["force_amplitude"] * problem.excitation.amplitude
        scaled = scaled + by["normal_load"] @ problem.model.normal_load
        assert scaled.item() == pytest.approx(conditions.maximum.amplitude, rel=1e-9)


def test_edge_of_the_band():
    problem = ring((1, 3))
    second_order = SecondOrder(problem, NAMES)
    omega = RADIANS * 70.0
    coefficient = sh.solve(problem, 70.0).coefficient.values
    unknowns = coefficient.transpose(0, 1, 2).reshape(-1)
    edge = Maximum.at_edge(problem, unknowns, omega, 2)
    conditions = solve(Conditions.of(second_order, edge))
    assert conditions.maximum.frequency == pytest.approx(omega, rel=1e-15)
    values = values_of(problem, NAMES)
    # The band stays where it is.
    assert np.abs(conditions.frequency_gradient * values).max() < 1e-9 * omega
    direction = values * np.random.default_rng(2).normal(size=len(values))
    low, high = (solved_at(conditions, sign * 1e-5 * direction) for sign in (-1, 1))
    by = (high.maximum.amplitude - low.maximum.amplitude) / 2e-5
    level = np.linalg.norm(conditions.gradient * values)
    # The square of a step of 1e-5.
    assert abs(by - conditions.gradient @ direction) < 1e-7 * level
    difference = (high.gradient - low.gradient) / 2e-5 - conditions.hessian @ direction
    assert np.linalg.norm(difference * values) < 1e-6 * np.linalg.norm(
        conditions.hessian * np.outer(values, values)
    )


def test_a_minimum_is_refused():
    """The slope also vanishes at a minimum between two peaks."""
    problem = ring((1,))
    second_order = SecondOrder(problem)
    branch = follow_branch(FrequencyProblem(problem), (RADIANS * 50, RADIANS * 110), 5000, True)
    refused = 0
    for dof in range(problem.n_dof):
        coefficients = slice(2 * dof, 2 * dof + 2)
        level = np.array([np.linalg.norm(point.unknowns[coefficients]) for point in branch.points])
        for i in range(1, len(level) - 1):
            if not (level[i] < level[i - 1] and level[i] < level[i + 1]):
                continue
            point = branch.points[i]
            slip = problem.locate(point.unknowns, point.value).switches
            start = Maximum(problem, MaximumKind.SMOOTH, dof, point.unknowns, point.value, slip)
            conditions = Conditions.of(second_order, start)
            for _ in range(20):
                step = conditions.step()
                if step is None or conditions.length(step) > 0.1:
                    break
                conditions = conditions.moved(step)
            if conditions.stationarity < 1e-9 and conditions.evaluation.norm < 1e-11:
                assert not conditions.is_maximum()
                assert solve(Conditions.of(second_order, conditions.maximum)) is None
                refused += 1
    assert refused >= 2


def test_an_onset_on_a_slope_is_no_corner():
    problem = ring((1,))
    second_order = SecondOrder(problem)
    branch = follow_branch(FrequencyProblem(problem), (RADIANS * 50, RADIANS * 110), 5000, True)
    corners = {(p.dof, p.value) for p in branch.peaks if p.kind == PeakKind.CORNER}
    refused = 0
    for point in (point for point in branch.points if len(point.events) == 1):
        slip = point.switches.copy()
        contact = point.events[0].contact
        slip[contact] = False
        for dof in range(problem.n_dof):
            arguments = problem, MaximumKind.CORNER, dof, point.unknowns, point.value, slip, contact
            conditions = solve(Conditions.of(second_order, Maximum(*arguments)))
            assert (conditions is not None) == ((dof, point.value) in corners)
            refused += conditions is None
    assert corners
    assert refused > 5


@pytest.mark.parametrize("factor", [0.2, 5.0])
def test_start_from_other_parameters(factor):
    """From a start at other parameters, the solution is a maximum or None."""
    second_order, peaks = solved("ring 1")
    n_failed = 0
    for maximum, _ in peaks:
        problem = maximum.problem.with_parameters(
            normal_load=factor * maximum.problem.model.normal_load
        )
        conditions = solve(Conditions.of(second_order, replace(maximum, problem=problem)))
        if conditions is None:
            n_failed += 1
            continue
        branch = follow_branch(FrequencyProblem(problem), (RADIANS * 5, RADIANS * 200), 5000, True)
        same_dof = [peak for peak in branch.peaks if peak.dof == maximum.dof]
        assert any(
            conditions.maximum.amplitude == pytest.approx(peak.amplitude, rel=1e-9)
            and conditions.maximum.frequency == pytest.approx(peak.value, rel=1e-6)
            for peak in same_dof
        )
    assert n_failed


def test_wrong_starts_are_refused():
    second_order, peaks = solved("blade 1")
    maximum = peaks[0][0]
    for start in (
        replace(maximum, unknowns=30 * maximum.unknowns),
        replace(maximum, frequency=3 * maximum.frequency),
        replace(
            maximum,
            kind=MaximumKind.EDGE,
            frequency=2 * maximum.frequency,
            unknowns=-maximum.unknowns,
        ),
    ):
        assert solve(Conditions.of(second_order, start)) is None
