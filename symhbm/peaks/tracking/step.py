"""One step of a maximum of the response to other parameters: predicted, corrected, looked for."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from symhbm.balance import HarmonicBalance, SecondOrder
from symhbm.continuation import Branch, FrequencyProblem, solve_point
from symhbm.continuation.between import Peak, PeakKind
from symhbm.numerics import FloatArray
from symhbm.peaks.conditions import Conditions, solve
from symhbm.peaks.maximum import Maximum, MaximumKind

_FURTHEST = 0.3
"""Distance from the prediction beyond which another maximum may have been found."""
_MAX_POINTS = 2000
_WINDOW = 2e-3
_ENLARGED = 4
"""Half width of the first window, relative, and how often it is enlarged."""


def between(
    problem: HarmonicBalance, target: HarmonicBalance, names: Sequence[str]
) -> Callable[[float], HarmonicBalance]:
    """The way from one problem (0) to another (1) that differs in the named parameters.

    They change in the logarithm where all are positive, else linearly.
    """
    first = {name: np.asarray(problem.parameters[name], dtype=float) for name in names}
    last = {name: np.asarray(target.parameters[name], dtype=float) for name in names}
    positive = {n: bool(np.all(first[n] > 0) and np.all(last[n] > 0)) for n in names}

    def at(share: float) -> HarmonicBalance:
        if share in (0.0, 1.0):
            return target if share else problem
        moved = {
            name: first[name] ** (1 - share) * last[name] ** share
            if positive[name]
            else (1 - share) * first[name] + share * last[name]
            for name in names
        }
        return problem.with_parameters(**moved)

    return at


def advanced(
    conditions: Conditions, problem: HarmonicBalance, furthest: float = _FURTHEST
) -> tuple[Conditions, float] | None:
    """The maximum of the same kind after a step, and how far it is from its prediction."""
    try:
        start = predicted(conditions, problem)
        found = None if start is None else solve(start)
        if start is None or found is None:
            return None
        distance = apart(start.summit, found.summit)
        if not np.all(np.isfinite(found.by_parameters)):
            return None
    except ArithmeticError:
        return None
    return (found, distance) if distance <= furthest else None


def predicted(conditions: Conditions, problem: HarmonicBalance) -> Conditions | None:
    """The conditions moved to other parameters to first order, None where that leads nowhere."""
    second_order, summit = conditions.second_order, conditions.summit
    change = conditions.by_parameters @ (
        values_of(second_order, problem) - values_of(second_order, summit.problem)
    )
    last = summit.problem.n_unknowns
    frequency = summit.frequency + float(change[last])
    if not (np.all(np.isfinite(change)) and 0.5 < frequency / summit.frequency < 2):
        return None
    unknowns = summit.unknowns + change[:last]
    moved = replace(summit, problem=problem, unknowns=unknowns, frequency=frequency)
    return Conditions(second_order, moved, conditions.multipliers + change[last + 1 :])


def values_of(second_order: SecondOrder, problem: HarmonicBalance) -> FloatArray:
    """The parameters that are variables of ``second_order``, one after the other."""
    own = [problem.own(name, problem.parameters[name]) for name in second_order.names]
    return np.concatenate([np.zeros(0), *map(np.atleast_1d, own)])


def search(
    second_order: SecondOrder,
    near: Maximum,
    problem: HarmonicBalance,
    bands: Sequence[tuple[float, float]] = (),
    jump: float = np.inf,
) -> Conditions | None:
    """The maximum of the same degree of freedom along the frequency response next to another.

    None if there is none whose height is within ``jump``, relatively.
    """
    if near.kind == MaximumKind.EDGE:
        solved = solve_point(problem, near.frequency)
        edge = Maximum.at_edge(problem, solved.unknowns, near.frequency, near.dof)
        return verified(second_order, edge) if solved.converged else None
    low, high = band_of(near.frequency, bands)
    down = up = _WINDOW * near.frequency
    for _ in range(_ENLARGED):
        ends = max(near.frequency - down, low), min(near.frequency + up, high)
        if ends[0] >= ends[1]:
            return None
        curve = FrequencyProblem(problem)
        walk = Branch(curve, ends, _MAX_POINTS, per_dof=True, guess=near.unknowns)
        if not walk.points:
            return None
        width = ends[1] - ends[0]

        def unlikeness(peak: Peak, width: float = width) -> float:
            height = abs(np.log(peak.amplitude / near.amplitude))
            return abs(peak.value - near.frequency) / width + 10 * height

        peaks = [p for p in walk.peaks if p.dof == near.dof and p.kind != PeakKind.UNBOUNDED]
        for peak in sorted(peaks, key=unlikeness):
            found = verified(second_order, Maximum.at_peak(problem, peak))
            if found is not None and height(found.summit, near) <= jump:
                return found
        ends = walk.points[0], walk.points[-1]
        edges = [Maximum.at_edge(problem, p.unknowns, p.value, near.dof) for p in ends]
        if max(height(edge, near) for edge in edges) > jump:
            return None  # another mountain
        falling = edges[0].amplitude > edges[1].amplitude
        down, up = (4 * down, up) if falling else (down, 4 * up)
    return None


def verified(second_order: SecondOrder, summit: Maximum) -> Conditions | None:
    """The conditions of a summit if it is a maximum with derivatives."""
    try:
        found = solve(Conditions(second_order, summit))
        return found if found is not None and np.all(np.isfinite(found.by_parameters)) else None
    except ArithmeticError:
        return None


def polished(conditions: Conditions) -> Conditions:
    """A solved maximum after one more step: all digits that there are."""
    try:
        step = conditions.step()
        return conditions if step is None else conditions.moved(step)
    except ArithmeticError:
        return conditions


def height(summit: Maximum, other: Maximum) -> float:
    """By how much a summit is higher than another, relative."""
    return summit.amplitude / other.amplitude - 1


def band_of(frequency: float, bands: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """The band that a frequency is in, or next to."""
    if not bands:
        return 0.5 * frequency, 2 * frequency
    return min(bands, key=lambda band: max(band[0] - frequency, frequency - band[1]))


def aimed(conditions: Conditions, problem: HarmonicBalance) -> Maximum:
    """Where to look for a maximum after parameters changed: as predicted, if that is anywhere."""
    try:
        found = predicted(conditions, problem)
    except ArithmeticError:
        found = None
    return replace(conditions.summit, problem=problem) if found is None else found.summit


def apart(one: Maximum, other: Maximum) -> float:
    """Distance of two summits, relative to the response; frequencies count tenfold."""
    moved = np.linalg.norm(one.unknowns - other.unknowns) / np.linalg.norm(other.unknowns)
    return float(np.hypot(moved, 10 * (one.frequency / other.frequency - 1)))
