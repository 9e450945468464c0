"""The search for an optimal design: several starts, and descents from them in trust regions.

The models have the exact first and second derivatives of every maximum that may become the largest:
steps converge quadratically, to a smooth minimum as well as to one where several maxima are equally
high. Maxima are followed between steps; where one is lost, and at the end, the whole bands are
surveyed, and new maxima enter the models.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import compress

import numpy as np

from symhbm.design import tolerances
from symhbm.design.cases import Cases, Maxima
from symhbm.design.program import ActiveSet, Program
from symhbm.design.variables import DesignVariables
from symhbm.numerics import FloatArray
from symhbm.peaks import MaximumKind


@dataclass(frozen=True)
class Design:
    """A design ``x`` (n_variables,), its responses, and what designs compare by."""

    x: FloatArray
    states: list[Maxima]
    value: float


@dataclass(frozen=True)
class Descent:
    """The end of a descent: a surveyed ``design``.

    ``converged`` tells that no step of the models leads further down; ``active`` are then the
    active maxima, bounds and rows.
    """

    design: Design
    converged: bool
    active: ActiveSet | None = None


def is_flat(program: Program, design: Design) -> bool:
    """Whether neither largest maxima nor aims change with the design, to second order."""
    return program.is_flat([f for state in design.states for f in state.contenders[:1]])


def descend(program: Program, evaluate: Cases, start: Design) -> Descent:
    """Descend from a surveyed design whose aim is finite."""
    best, current = start, start
    radius = tolerances.FIRST_RADIUS
    for _ in range(tolerances.MOST_SURVEYS):
        current, radius, converged = _follow(program, evaluate, current, radius)
        active = None
        if converged:
            current, active = _polished(program, evaluate, current)
        surveyed = current
        if not all(state.surveyed for state in current.states):
            surveyed = _evaluated(program, evaluate, current.x)
        if surveyed.value <= best.value + tolerances.ROUND_OFF:
            best = surveyed
        if abs(surveyed.value - current.value) <= tolerances.AGREE:
            ended = best is surveyed
            return Descent(best, converged and ended, active if ended else None)
        # A maximum that was not followed is higher, or one that was is none: the models change.
        current = surveyed if np.isfinite(surveyed.value) else best
        radius = max(radius / 4, tolerances.SMALLEST_RADIUS)
    return Descent(best, False)


def _follow(program, evaluate, current: Design, radius: float) -> tuple[Design, float, bool]:
    """Steps until the aim falls no further, without new surveys."""
    for _ in range(tolerances.MOST_STEPS):
        if is_flat(program, current):
            return current, radius, False
        step = program.step(current.states, current.x, radius)
        length = float(np.abs(step.x - current.x).max())
        expected = current.value - step.predicted
        # Gains below IPOPT's tolerance do not count; Newton's method gives the last digits.
        least = tolerances.HIDDEN if length <= tolerances.SMALL else tolerances.ROUND_OFF
        hidden = abs(expected) <= least
        if length <= tolerances.PRECISION or hidden:
            return current, radius, step.solved
        trial = _evaluated(program, evaluate, step.x, current)
        gain = current.value - trial.value
        if gain > 1e-4 * expected > 0:
            current = trial
            if gain > 0.75 * expected and length > 0.9 * radius:
                radius = min(2 * radius, tolerances.LARGEST_RADIUS)
            elif gain < 0.25 * expected:
                radius = length / 2
        else:
            radius = length / 4
            if radius < tolerances.SMALLEST_RADIUS:
                return current, radius, False
    return current, radius, False


def _polished(
    program: Program, evaluate: Cases, current: Design
) -> tuple[Design, ActiveSet | None]:
    """Newton's method on the conditions of a minimum, as long as their residual falls."""
    active = _active_set(program, current)
    for _ in range(tolerances.MOST_POLISHES if active else 0):
        assert active is not None
        change, _, _ = active.step()
        length = float(np.abs(change).max())
        if not length <= tolerances.SMALL:
            break
        x = np.clip(current.x + change, program.variables.lower, program.variables.upper)
        trial = _evaluated(program, evaluate, x, current)
        better = _active_set(program, trial)
        if better is None or not trial.value <= current.value + tolerances.AGREE:
            break
        if better.stationarity >= active.stationarity and length > tolerances.DIGITS:
            break
        current, active = trial, better
        if length <= tolerances.DIGITS:
            break
    return current, active


def _active_set(program: Program, design: Design) -> ActiveSet | None:
    """The active set of a design, None where IPOPT fails."""
    step = program.step(design.states, design.x, tolerances.SMALL)
    if not step.solved:
        return None
    active = ActiveSet.of(program, design.x, design.states, step)
    _, weights, pulls = active.step()
    if not np.all(weights > 0):
        return active
    return replace(active, weights=weights, row_multipliers=pulls)


@dataclass(frozen=True)
class SearchResult:
    """The best design, and the starts and descents of the search.

    ``design`` is surveyed; ``active`` is its active set, None where no descent converged;
    ``starts`` are all designs surveyed first, ``descents`` begin at some of them.
    """

    design: Design
    active: ActiveSet | None
    starts: list[Design]
    descents: list[Descent]


def search(
    program: Program, cases: Cases, fixed_starts: list[FloatArray], n_starts: int | None
) -> SearchResult:
    """The best design, searched among equal values first: a start for values that differ."""
    variables = program.variables
    alike, index = program.alike()
    if len(variables.names) == variables.n_variables or feasible(alike) is None:
        return _spread_wide(program, cases, fixed_starts, n_starts)
    alike_cases = cases.changed(variables=alike.variables)
    best = _spread_wide(alike, alike_cases, [], n_starts)
    cases.failed += [(failed[index], reason) for failed, reason in alike_cases.failed]
    x = best.design.x[index]
    # A symmetric optimum may be a saddle, or the highest of several minima.
    nearby = around(variables, x, n_starts or tolerances.AROUND)
    return best_of(program, cases, [*fixed_starts, x, *nearby], 1, 0)


def _spread_wide(
    program: Program, cases: Cases, fixed_starts: list[FloatArray], n_starts: int | None
) -> SearchResult:
    """The best design from starts over the bounds, from more where an end of a band is highest.

    The ends rise and fall against each other and against peaks that come and go: minima are many.
    """
    found = best_of(program, cases, fixed_starts, n_starts, tolerances.DESCENTS)
    if n_starts is not None or not _ends_are_highest(program, found.design):
        return found
    more = tolerances.FINER * len(starts(program.variables, None))
    finer = best_of(program, cases, [], more, tolerances.FINER)
    best = finer if finer.design.value < found.design.value - tolerances.AGREE else found
    designs, descents = found.starts + finer.starts, found.descents + finer.descents
    return replace(best, starts=designs, descents=descents)


def _ends_are_highest(program: Program, design: Design) -> bool:
    """Whether the largest of a response that an aim depends on is at an end of its band."""
    used = np.repeat(program.used, len(design.states) // len(program.used))
    return any(
        one.maximum.kind == MaximumKind.EDGE and one.value >= state.height - tolerances.TIE
        for state in compress(design.states, used)
        for one in state.contenders
    )


def best_of(
    program: Program,
    cases: Cases,
    fixed_starts: list[FloatArray],
    n_starts: int | None,
    n_descents: int,
) -> SearchResult:
    """The best of the minima reached from several starts.

    A descent begins at every finite one of ``fixed_starts``, and at the ``n_descents`` best of
    those spread over the bounds.
    """
    given = [_evaluated(program, cases, x) for x in _allowed(program, fixed_starts)]
    others = [*_allowed(program, starts(program.variables, n_starts))]
    if not given and not others:
        others = [x for x in [feasible(program)] if x is not None]
    spread = [_evaluated(program, cases, x) for x in others]
    designs = [*given, *spread]
    chosen = [design for design in given if np.isfinite(design.value)]
    chosen = [design for design in chosen if not is_flat(program, design)]
    sloping = chosen + _promising(program, spread, n_descents)
    if not sloping:
        finite = sorted((d for d in designs if np.isfinite(d.value)), key=_value)
        sloping = [design for design in finite if not is_flat(program, design)][:1]
    descents = [descend(program, cases, design) for design in sloping]
    best = min(designs, key=_value)
    lowest = min((descent.design.value for descent in descents), default=np.inf)
    if best.value < lowest - tolerances.AGREE or not descents:
        return SearchResult(best, None, designs, descents)
    # Of minima that agree, one that converged has more digits.
    alike = [descent for descent in descents if descent.design.value <= lowest + tolerances.AGREE]
    ended = min(alike, key=lambda descent: not descent.converged)
    return SearchResult(ended.design, ended.active, designs, descents)


def again(program: Program, cases: Cases, x: FloatArray) -> SearchResult:
    """What a search found at a design ``x``, by one descent from there."""
    design = _evaluated(program, cases, x)
    if is_flat(program, design):
        return SearchResult(design, None, [design], [])
    descent = descend(program, cases, design)
    return SearchResult(descent.design, descent.active, [design], [descent])


def feasible(program: Program) -> FloatArray | None:
    """A design that satisfies all constraints; None where none was found."""
    variables = program.variables
    if np.any(variables.lower > variables.upper):
        return None
    most = tolerances.TRIED if program.limits.n_rows else 1
    return next(_allowed(program, starts(variables, most)), None)


def _allowed(program: Program, points: Iterable[FloatArray]) -> Iterator[FloatArray]:
    """The nearest designs that satisfy all constraints, of those where one was found."""
    return filter(program.limits.holds, map(program.nearest, points))


def starts(variables: DesignVariables, n_starts: int | None) -> FloatArray:
    """Designs spread over the bounds, (n_starts, n_variables)."""
    n = variables.n_variables
    wide = variables.upper - variables.lower
    along = n_starts or max(3, int(np.ceil(np.max(wide) / tolerances.APART - 1e-9)))
    if n == 1:
        points = (np.arange(along)[:, None] + 0.5) / along
    else:
        points = _spread(n, along)
    return variables.lower + points * wide


def around(variables: DesignVariables, x: FloatArray, n_points: int) -> FloatArray:
    """Designs around another one, (n_points, n_variables): values differ by up to a factor."""
    nearby = x + tolerances.NEARBY * (2 * _spread(variables.n_variables, n_points) - 1)
    return np.clip(nearby, variables.lower, variables.upper)


def _spread(n_variables: int, n_points: int) -> FloatArray:
    """Points spread evenly over the unit cube."""
    # Slow to import, and needed for designs of several variables alone.
    from scipy.stats import qmc

    sobol = qmc.Sobol(n_variables, rng=np.random.default_rng(tolerances.SEED))
    # Powers of two keep the sequence balanced.
    return sobol.random_base2(int(np.ceil(np.log2(n_points))))[:n_points]


def _promising(program: Program, designs: list[Design], most: int) -> list[Design]:
    """Designs from which to descend: local minima over one variable, the lowest of several."""
    low = designs
    if program.variables.n_variables == 1:
        # What is not known, or unbounded, is higher than its neighbours.
        along = sorted(designs, key=lambda design: design.x[0])
        values = [np.inf, *(design.value for design in along), np.inf]
        sides = zip(values, values[1:], values[2:], strict=False)
        low = [*compress(along, (value <= one and value < other for one, value, other in sides))]
    sloping = [d for d in low if np.isfinite(d.value) and not is_flat(program, d)]
    return sorted(sloping, key=_value)[:most]


def _evaluated(
    program: Program, cases: Cases, x: FloatArray, before: Design | None = None
) -> Design:
    """A design, surveyed or followed from another one."""
    states = cases(x, None if before is None else (before.x, before.states))
    return Design(x, states, program.value(states, x))


def _value(design: Design) -> float:
    return design.value
