"""Peaks as constrained maxima: their derivatives against differences, closed forms and frf."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from closed_forms import OneBlade

import symhbm as sh
from symhbm.balance.second_order import SecondOrder
from symhbm.continuation.between.peaks import PeakKind
from symhbm.continuation.branch import Branch
from symhbm.continuation.problem import FrequencyProblem
from symhbm.numerics.arrays import RADIANS
from symhbm.peaks.conditions import Conditions, solve
from symhbm.peaks.maximum import Maximum, MaximumKind

NAMES = ("contact_stiffness", "friction_coefficient", "normal_load", "mass", "stiffness")
NAMES += ("damping", "force_amplitude")


def blade(harmonics=(1,), **values):
    model = sh.single_blade(
        mass=1,
        stiffness=1e4,
        damping=0.5,
        contact_stiffness=1e4,
        friction_coefficient=0.5,
        normal_load=3,
    )
    return sh.HarmonicBalance(model.with_parameters(**values), sh.PointForce(), harmonics)


def ring(harmonics, seed=3, n_blades=3):
    rng = np.random.default_rng(seed)
    model = sh.bladed_disk(
        n_blades,
        mass=1,
        stiffness=1e4 * rng.uniform(0.99, 1.01, n_blades),
        damping=0.5,
        contact_stiffness=1e5 * rng.uniform(0.8, 1.2, n_blades),
        friction_coefficient=0.5 * rng.uniform(0.8, 1.2, n_blades),
        normal_load=20 * rng.uniform(0.7, 1.3, n_blades),
    )
    return sh.HarmonicBalance(model, sh.EngineOrder(1), harmonics)


def duffing():
    model = sh.single_blade(
        mass=1,
        stiffness=1,
        damping=0.05,
        contact_stiffness=0.2,
        friction_coefficient=0.5,
        normal_load=0.05,
        cubic_stiffness=0.1,
    )
    return sh.HarmonicBalance(model, sh.PointForce(amplitude=0.18), (1, 3))


def looping(harmonics=(1, 3), seed=3):
    """Four blades whose responses peak at corners where a small loop reaches a limit."""
    rng = np.random.default_rng(seed)
    model = sh.bladed_disk(
        4,
        mass=1,
        stiffness=1e4 * rng.uniform(0.95, 1.05, 4),
        damping=0.5,
        contact_stiffness=1e6 * rng.uniform(0.8, 1.2, 4),
        friction_coefficient=0.5 * rng.uniform(0.6, 1.4, 4),
        normal_load=2.0 * rng.uniform(0.7, 1.3, 4),
    )
    return sh.HarmonicBalance(model, sh.EngineOrder(1), harmonics)


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
    """Its problem, second derivatives, and the conditions of the highest peaks of each kind."""
    make, band = CASES[case]
    problem = make()
    names = (*NAMES, *(("cubic_stiffness",) if case == "cubic" else ()))
    second_order = SecondOrder(problem, names)
    walk = Branch(FrequencyProblem(problem), (RADIANS * band[0], RADIANS * band[1]), 5000, True)
    chosen = {}
    for peak in sorted(walk.peaks, key=lambda peak: -peak.amplitude):
        assert peak.kind != PeakKind.UNBOUNDED
        several = chosen.setdefault(peak.kind, [])
        if len(several) < 2:
            several.append(Maximum.at_peak(problem, peak))
    summits = [summit for several in chosen.values() for summit in several]
    return second_order, [(summit, solve(Conditions(second_order, summit))) for summit in summits]


def values_of(problem, names):
    return np.concatenate([np.atleast_1d(problem.parameters[name]) for name in names])


def moved(conditions, change):
    """The summit at parameters that differ by ``change``, solved for anew."""
    summit, second_order = conditions.summit, conditions.second_order
    problem, n = summit.problem, summit.problem.n_unknowns
    values = values_of(problem, second_order.names) + change
    chosen = {
        name: values[place.start - n - 1 : place.stop - n - 1]
        for name, place in second_order.places.items()
    }
    chosen["force_amplitude"] = float(chosen["force_amplitude"][0])
    start = replace(summit, problem=problem.with_parameters(**chosen))
    found = solve(Conditions(second_order, start))
    assert found is not None
    return found


def differences(conditions, along, step):
    """Central differences of amplitude, frequency and gradient in one direction."""
    low, high = (moved(conditions, sign * step * along) for sign in (-1, 1))
    pairs = (
        (high.summit.amplitude, low.summit.amplitude),
        (high.summit.frequency, low.summit.frequency),
        (high.gradient, low.gradient),
    )
    return [(one - other) / (2 * step) for one, other in pairs]


def test_kinds_of_peaks():
    kinds = {(case, str(s.kind)) for case in CASES for s, _ in solved(case)[1]}
    assert kinds >= {(case, "smooth") for case in CASES if case != "loops 1 3"}
    assert kinds >= {("ring 1", "corner"), ("ring 1 3", "corner"), ("ring 0 1 2", "corner")}
    # Loops back to the limit they began at, and across to the other.
    loops = [s.loop for s, _ in solved("loops 1 3")[1] if s.kind == MaximumKind.CORNER]
    assert {loop.returns for loop in loops} == {True, False}


@pytest.mark.parametrize("case", CASES)
def test_located_peaks_are_solutions(case):
    for summit, conditions in solved(case)[1]:
        assert conditions is not None
        assert conditions.stationarity < 1e-9
        # Both are solved to round-off; the amplitude of a peak is stationary.
        assert conditions.summit.amplitude == pytest.approx(summit.amplitude, rel=1e-12)
        assert conditions.summit.frequency == pytest.approx(summit.frequency, rel=1e-7)


@pytest.mark.parametrize("case", CASES)
def test_derivatives_of_peaks(case):
    rng = np.random.default_rng(1)
    second_order, peaks = solved(case)
    for _, here in peaks:
        values = values_of(here.summit.problem, second_order.names)
        along = values * rng.normal(size=len(values))
        coarse, fine = (differences(here, along, step) for step in (1e-5, 5e-6))
        exact = here.gradient @ along, here.frequency_gradient @ along, here.hessian @ along
        levels = (
            np.linalg.norm(here.gradient * values),
            np.linalg.norm(here.frequency_gradient * values),
            np.linalg.norm(here.hessian * np.outer(values, values)),
        )
        scales = 1.0, 1.0, values
        # Peaks are solved to some 1e-13 of themselves, which steps of 1e-5 make 1e-8; what the
        # square of the step adds, two steps tell.
        for bound, one, other, true, level, scale in zip(
            (1e-7, 1e-6, 1e-5), coarse, fine, exact, levels, scales, strict=True
        ):
            doubt = np.linalg.norm((one - other) * scale) / level
            assert doubt < 1e-4
            best = other + (other - one) / 3
            assert np.linalg.norm((best - true) * scale) / level < bound + doubt / 3


@pytest.mark.parametrize("case", CASES)
def test_shape_of_the_derivatives(case):
    second_order, peaks = solved(case)
    for _, here in peaks:
        n = here.summit.problem.n_unknowns
        np.testing.assert_allclose(
            here.hessian, here.hessian.T, atol=1e-9 * np.abs(here.hessian).max()
        )
        # The adjoint and the direct way to the frequency; the conditions are solved to 1e-9.
        direct = here.by_parameters[n]
        np.testing.assert_allclose(
            here.frequency_gradient, direct, atol=1e-9 * np.abs(direct).max()
        )
        # Twice the force and twice the limits move every contact twice as far.
        if case == "cubic":
            continue
        problem = here.summit.problem
        by = {
            name: here.gradient[p.start - n - 1 : p.stop - n - 1]
            for name, p in second_order.places.items()
        }
        scaled = by["force_amplitude"] * problem.excitation.amplitude
        scaled = scaled + by["normal_load"] @ problem.model.normal_load
        assert scaled.item() == pytest.approx(here.summit.amplitude, rel=1e-9)


@pytest.mark.parametrize("load", [1.0, 2.5, 5.0, 18.0])
def test_closed_form_of_one_blade(load):
    problem = blade(normal_load=load)
    second_order = SecondOrder(problem, ("normal_load",))
    walk = Branch(FrequencyProblem(problem), (RADIANS * 5, RADIANS * 40), 5000, True)
    peak = max(walk.peaks, key=lambda peak: peak.amplitude)
    found = solve(Conditions(second_order, Maximum.at_peak(problem, peak)))
    form = OneBlade(1, 0.5, 1e4, 1e4, 0.5 * load)
    omega, amplitude = max(form.peaks(), key=lambda pair: pair[1])
    assert found.summit.amplitude == pytest.approx(amplitude, rel=1e-10)

    # On the closed curve between frequency and amplitude, where its slope by frequency is 0.
    def value(a, limit):
        return np.polyval(replace(form, slip_limit=limit).polynomial(a), omega)

    step, limit = 1e-4, form.slip_limit
    by_limit = (value(amplitude, limit * (1 + step)) - value(amplitude, limit * (1 - step))) / limit
    by_amplitude = value(amplitude * (1 + step), limit) - value(amplitude * (1 - step), limit)
    expected = -0.5 * by_limit / (by_amplitude / amplitude)
    # The square of the step, and round-off of the closed form over it.
    assert found.gradient.item() == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("name", "place"), [("normal_load", 1), ("stiffness", 0), ("mass", 2)])
def test_differences_of_whole_responses(name, place):
    """Both sides found anew by continuation, which knows nothing of these conditions."""
    second_order, peaks = solved("ring 1")
    problem = peaks[0][0].problem
    step = 1e-5
    sides = []
    for sign in (-1, 1):
        values = np.array(problem.parameters[name])
        values[place] *= 1 + sign * step
        band = RADIANS * 50, RADIANS * 110
        curve = FrequencyProblem(problem.with_parameters(**{name: values}))
        sides.append(Branch(curve, band, 5000, True).peaks)
    kinds = set()
    for _, here in peaks:
        summit = here.summit
        low, high = (
            min(
                (peak for peak in side if peak.dof == summit.dof),
                key=lambda peak: abs(peak.value - summit.frequency),
            )
            for side in sides
        )
        size = 2 * step * problem.parameters[name][place]
        own = second_order.places[name]
        own = slice(own.start - problem.n_unknowns - 1, own.stop - problem.n_unknowns - 1)
        pairs = (
            ((high.amplitude - low.amplitude) / size, here.gradient[own]),
            ((high.value - low.value) / size, here.frequency_gradient[own]),
        )
        for by, exact in pairs:
            # Where smooth peaks stand is located to 1e-9, over steps of 1e-5.
            assert by == pytest.approx(exact[place], abs=1e-4 * np.abs(exact).max())
        kinds.add(summit.kind)
    assert kinds == {MaximumKind.SMOOTH, MaximumKind.CORNER}


def test_edge_of_the_band():
    problem = ring((1, 3))
    second_order = SecondOrder(problem, NAMES)
    omega = RADIANS * 70.0
    coefficient = sh.solve(problem, 70.0).coefficient.values
    unknowns = coefficient.transpose(0, 1, 2).reshape(-1)
    edge = Maximum.at_edge(problem, unknowns, omega, 2)
    here = solve(Conditions(second_order, edge))
    assert here.summit.frequency == pytest.approx(omega, rel=1e-15)
    values = values_of(problem, NAMES)
    # The band stays where it is.
    assert np.abs(here.frequency_gradient * values).max() < 1e-9 * omega
    along = values * np.random.default_rng(2).normal(size=len(values))
    low, high = (moved(here, sign * 1e-5 * along) for sign in (-1, 1))
    by = (high.summit.amplitude - low.summit.amplitude) / 2e-5
    level = np.linalg.norm(here.gradient * values)
    # The square of a step of 1e-5.
    assert abs(by - here.gradient @ along) < 1e-7 * level
    difference = (high.gradient - low.gradient) / 2e-5 - here.hessian @ along
    assert np.linalg.norm(difference * values) < 1e-6 * np.linalg.norm(
        here.hessian * np.outer(values, values)
    )


def test_a_minimum_is_refused():
    """Between two peaks the slope is zero, too."""
    problem = ring((1,))
    second_order = SecondOrder(problem)
    walk = Branch(FrequencyProblem(problem), (RADIANS * 50, RADIANS * 110), 5000, True)
    refused = 0
    for dof in range(problem.n_dof):
        place = slice(2 * dof, 2 * dof + 2)
        level = np.array([np.linalg.norm(point.unknowns[place]) for point in walk.points])
        for i in range(1, len(level) - 1):
            if not (level[i] < level[i - 1] and level[i] < level[i + 1]):
                continue
            point = walk.points[i]
            slip = problem.locate(point.unknowns).slip
            start = Maximum(problem, MaximumKind.SMOOTH, dof, point.unknowns, point.value, slip)
            here = Conditions(second_order, start)
            for _ in range(20):
                step = here.step()
                if step is None or here.length(step) > 0.1:
                    break
                here = here.moved(step)
            if here.stationarity < 1e-9 and here.evaluation.norm < 1e-11:
                assert not here.is_maximum()
                assert solve(Conditions(second_order, here.summit)) is None
                refused += 1
    assert refused >= 2


def test_an_onset_on_a_slope_is_no_corner():
    problem = ring((1,))
    second_order = SecondOrder(problem)
    walk = Branch(FrequencyProblem(problem), (RADIANS * 50, RADIANS * 110), 5000, True)
    corners = {(p.dof, p.value) for p in walk.peaks if p.kind == PeakKind.CORNER}
    refused = 0
    for point in (point for point in walk.points if len(point.events) == 1):
        slip = point.slip.copy()
        contact = point.events[0].contact
        slip[contact] = False
        for dof in range(problem.n_dof):
            place = problem, MaximumKind.CORNER, dof, point.unknowns, point.value, slip, contact
            found = solve(Conditions(second_order, Maximum(*place)))
            assert (found is not None) == ((dof, point.value) in corners)
            refused += found is None
    assert corners
    assert refused > 5


@pytest.mark.parametrize("factor", [0.2, 5.0])
def test_a_stale_start_gives_nothing_wrong(factor):
    """Far from where it was, a summit is found as a whole or not at all."""
    second_order, peaks = solved("ring 1")
    nothing = 0
    for summit, _ in peaks:
        other = summit.problem.with_parameters(
            normal_load=factor * summit.problem.model.normal_load
        )
        found = solve(Conditions(second_order, replace(summit, problem=other)))
        if found is None:
            nothing += 1
            continue
        walk = Branch(FrequencyProblem(other), (RADIANS * 5, RADIANS * 200), 5000, True)
        same = [peak for peak in walk.peaks if peak.dof == summit.dof]
        assert any(
            found.summit.amplitude == pytest.approx(peak.amplitude, rel=1e-9)
            and found.summit.frequency == pytest.approx(peak.value, rel=1e-6)
            for peak in same
        )
    assert nothing


def test_a_wrong_start_gives_nothing():
    second_order, peaks = solved("blade 1")
    summit = peaks[0][0]
    for wrong in (
        replace(summit, unknowns=30 * summit.unknowns),
        replace(summit, frequency=3 * summit.frequency),
        replace(
            summit, kind=MaximumKind.EDGE, frequency=2 * summit.frequency, unknowns=-summit.unknowns
        ),
    ):
        assert solve(Conditions(second_order, wrong)) is None
