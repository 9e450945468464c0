"""One step of a maximum to other parameters: prediction, correction and search."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from symhbm.balance import HarmonicBalance, SecondOrder
from symhbm.continuation import FrequencyProblem, follow_branch, solve_point
from symhbm.continuation.between import Peak, PeakKind
from symhbm.numerics import FloatArray
from symhbm.peaks.conditions import Conditions, solve
from symhbm.peaks.maximum import Maximum

_MAX_DISTANCE = 0.3
"""Distance from the prediction beyond which the solution may be another maximum: the response has
changed by a third where first order foretold none of it."""
_WINDOW, _MAX_WINDOWS = 2e-3, 4
"""Half width of the first window of a search, about the width of a lightly damped peak, and the
number of windows, each four times as wide on one side: the last reaches over a tenth."""
_WINDOW_POINTS = 2000
"""Most points of a window, where 29 were the most seen: a search ends in any case."""


def problems_between(
    problem: HarmonicBalance, target: HarmonicBalance, names: Sequence[str]
) -> Callable[[float], HarmonicBalance]:
    """The problems from one (0) to another (1) that differs in the named parameters.

    A parameter varies logarithmically if all its values are positive, else linearly.
    """
    first = {name: np.asarray(problem.parameters[name], dtype=float) for name in names}
    last = {name: np.asarray(target.parameters[name], dtype=float) for name in names}
    positive = {n: bool(np.all(first[n] > 0) and np.all(last[n] > 0)) for n in names}

    def at(share: float) -> HarmonicBalance:
        if share in (0.0, 1.0):
            return target if share else problem
        values = {
            name: first[name] ** (1 - share) * last[name] ** share
            if positive[name]
            else (1 - share) * first[name] + share * last[name]
            for name in names
        }
        return problem.with_parameters(**values)

    return at


def advanced(conditions: Conditions, problem: HarmonicBalance) -> tuple[Conditions, float] | None:
    """The maximum of the same kind after a step, and its distance from the prediction."""
    try:
        start = predicted(conditions, problem)
        solved = None if start is None else solve(start)
        if start is None or solved is None or not np.all(np.isfinite(solved.by_parameters)):
            return None
    except ArithmeticError:
        return None
    distance = distance_between(start.maximum, solved.maximum)
    return (solved, distance) if distance <= _MAX_DISTANCE else None


def predicted(conditions: Conditions, problem: HarmonicBalance) -> Conditions | None:
    """The conditions predicted to first order for other parameters; None if far off."""
    second_order, maximum = conditions.second_order, conditions.maximum
    change = conditions.by_parameters @ (
        parameter_values(second_order, problem) - parameter_values(second_order, maximum.problem)
    )
    n = maximum.problem.n_unknowns
    frequency = maximum.frequency + float(change[n])
    if not (np.all(np.isfinite(change)) and 0.5 < frequency / maximum.frequency < 2):
        return None
    unknowns = maximum.unknowns + change[:n]
    moved = replace(maximum, problem=problem, unknowns=unknowns, frequency=frequency)
    return Conditions.of(second_order, moved, conditions.multipliers + change[n + 1 :])


def parameter_values(second_order: SecondOrder, problem: HarmonicBalance) -> FloatArray:
    """Values of the parameters that are variables of ``second_order``, concatenated."""
    values = [problem.own(name, problem.parameters[name]) for name in second_order.names]
    return np.concatenate([np.zeros(0), *map(np.atleast_1d, values)])


def search(
    second_order: SecondOrder,
    start: Maximum,
    problem: HarmonicBalance,
    bands: Sequence[tuple[float, float]] = (),
    max_difference: float = np.inf,
) -> Conditions | None:
    """The most similar maximum of the same degree of freedom along the frequency response.

    None if there is none whose amplitude differs by at most ``max_difference``, relatively.
    """
    if start.held:
        solved = solve_point(problem, start.frequency)
        at = problem, solved.unknowns, start.frequency
        edge = Maximum.at_edge(*at, start.dof, start.kind)
        return verified(second_order, edge) if solved.converged else None
    low, high = band_of(start.frequency, bands)
    below = above = _WINDOW * start.frequency
    for _ in range(_MAX_WINDOWS):
        ends = max(start.frequency - below, low), min(start.frequency + above, high)
        if ends[0] >= ends[1]:
            return None
        curve, most = FrequencyProblem(problem), _WINDOW_POINTS
        branch = follow_branch(curve, ends, most, per_dof=True, guess=start.unknowns)
        if not branch.points:
            return None
        width = ends[1] - ends[0]

        def mismatch(peak: Peak, width: float = width) -> float:
            log_ratio = abs(np.log(peak.amplitude / start.amplitude))
            return abs(peak.value - start.frequency) / width + 10 * log_ratio

        peaks = [p for p in branch.peaks if p.dof == start.dof and p.kind != PeakKind.UNBOUNDED]
        for peak in sorted(peaks, key=mismatch):
            conditions = verified(second_order, Maximum.at_peak(problem, peak))
            if conditions and relative_height(conditions.maximum, start) <= max_difference:
                return conditions
        ends = branch.points[0], branch.points[-1]
        edges = [Maximum.at_edge(problem, p.unknowns, p.value, start.dof) for p in ends]
        if max(relative_height(edge, start) for edge in edges) > max_difference:
            return None  # the window belongs to another peak
        falling = edges[0].amplitude > edges[1].amplitude
        below, above = (4 * below, above) if falling else (below, 4 * above)
    return None


def verified(second_order: SecondOrder, maximum: Maximum) -> Conditions | None:
    """The solved conditions of a maximum; None unless it is one with finite derivatives."""
    try:
        solved = solve(Conditions.of(second_order, maximum))
        return solved if solved and np.all(np.isfinite(solved.by_parameters)) else None
    except ArithmeticError:
        return None


def polished(conditions: Conditions) -> Conditions:
    """A solved maximum after one more Newton step, accurate to round-off."""
    try:
        step = conditions.step()
        return conditions if step is None else conditions.moved(step)
    except ArithmeticError:
        return conditions


def relative_height(maximum: Maximum, reference: Maximum) -> float:
    """Relative difference of the amplitude of a maximum from that of a reference.

    Of a goal, which may be 0, relative to what it is where its terms do not cancel.
    """
    if reference.problem.goal is None:
        return maximum.amplitude / reference.amplitude - 1
    size = reference.unit * float(np.linalg.norm(reference.unknowns))
    return (maximum.amplitude - reference.amplitude) / (size or 1.0)


def band_of(frequency: float, bands: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """The band that contains a frequency, or the closest one."""
    if not bands:
        return 0.5 * frequency, 2 * frequency
    return min(bands, key=lambda band: max(band[0] - frequency, frequency - band[1]))


def expected_maximum(conditions: Conditions, problem: HarmonicBalance) -> Maximum:
    """The predicted maximum after a change of parameters; the unchanged one without prediction."""
    try:
        prediction = predicted(conditions, problem)
    except ArithmeticError:
        prediction = None
    return prediction.maximum if prediction else replace(conditions.maximum, problem=problem)


def distance_between(maximum: Maximum, reference: Maximum) -> float:
    """Distance of two maxima, relative to the response; frequencies count tenfold."""
    change, size = maximum.unknowns - reference.unknowns, np.linalg.norm(reference.unknowns)
    shift = 10 * (maximum.frequency / reference.frequency - 1)
    return float(np.hypot(np.linalg.norm(change) / size, shift))
