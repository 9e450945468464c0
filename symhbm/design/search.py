"""The search for an optimal design: several starts, and descents from them."""

from dataclasses import dataclass, replace
from itertools import compress
from typing import TYPE_CHECKING

import numpy as np
import scipy

from symhbm.design import tolerances
from symhbm.design.cases import Cases
from symhbm.design.descent import Descent, Design, descend, is_flat
from symhbm.design.optimum import ActiveSet
from symhbm.design.program import Program
from symhbm.design.variables import DesignVariables, Group
from symhbm.numerics import FloatArray

if TYPE_CHECKING:
    from scipy.optimize import LinearConstraint


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
    alike = replace(program, variables=common(variables), constraint=_merged(program))
    if alike.variables.n_variables == variables.n_variables or not alike.feasible():
        return _best(program, cases, fixed_starts, n_starts, tolerances.DESCENTS)
    alike_cases = cases.changed(variables=alike.variables)
    best = _best(alike, alike_cases, [], n_starts, tolerances.DESCENTS)
    values = dict(zip(variables.names, best.design.x, strict=True))
    x = np.array([values[group.parameter] for group in variables.groups])
    # A symmetric optimum may be a saddle, or the highest of several minima.
    nearby = around(variables, x, n_starts or tolerances.AROUND)
    return _best(program, cases, [*fixed_starts, x, *nearby], 1, 0)


def _merged(program: Program) -> "LinearConstraint | None":
    """The constraint on designs whose variables of one parameter are alike."""
    constraint = program.constraint
    if constraint is None:
        return None
    names = np.array([group.parameter for group in program.variables.groups])
    matrix = np.atleast_2d(np.asarray(constraint.A, dtype=float))
    merged = [matrix[:, names == name].sum(axis=1) for name in program.variables.names]
    return scipy.optimize.LinearConstraint(np.column_stack(merged), constraint.lb, constraint.ub)  # type: ignore


def _best(
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
    points = [*fixed_starts, *starts(program.variables, n_starts)]
    designs = [_surveyed(program, cases, program.nearest(point)) for point in points]
    chosen = [design for design in designs[: len(fixed_starts)] if np.isfinite(design.value)]
    chosen += _promising(program.variables, designs[len(fixed_starts) :], n_descents)
    sloping = [design for design in chosen if not is_flat(design)]
    if not sloping:
        finite = sorted((d for d in designs if np.isfinite(d.value)), key=_value)
        sloping = [design for design in finite if not is_flat(design)][:1]
    descents = [descend(program, cases, design) for design in sloping]
    best = min(designs, key=_value)
    lowest = min((descent.design.value for descent in descents), default=np.inf)
    if best.value < lowest - tolerances.AGREE or not descents:
        return SearchResult(best, None, designs, descents)
    # Of minima that agree, one that converged has more digits.
    alike = [descent for descent in descents if descent.design.value <= lowest + tolerances.AGREE]
    ended = min(alike, key=lambda descent: not descent.converged)
    return SearchResult(ended.design, ended.active, designs, descents)


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


def common(variables: DesignVariables) -> DesignVariables:
    """The variables of designs in which all values of one parameter are one variable."""
    groups = []
    for name in variables.names:
        same = [group for group in variables.groups if group.parameter == name]
        entries = tuple(sorted(entry for group in same for entry in group.entries))
        lower, upper = max(g.lower for g in same), min(g.upper for g in same)
        groups.append(Group(name, name, entries, lower, upper))
    return DesignVariables(tuple(groups), variables.ratios)


def _promising(variables: DesignVariables, designs: list[Design], most: int) -> list[Design]:
    """Designs from which to descend: local minima over one variable, the lowest of several."""
    finite = [design for design in designs if np.isfinite(design.value)]
    if variables.n_variables > 1:
        return sorted(finite, key=_value)[:most]
    finite.sort(key=lambda design: design.x[0])
    values = [np.inf, *(design.value for design in finite), np.inf]
    sides = zip(values, values[1:], values[2:], strict=False)
    low = [value <= before and value < after for before, value, after in sides]
    return sorted(compress(finite, low), key=_value)[:most]


def _surveyed(program: Program, cases: Cases, x: FloatArray) -> Design:
    states = cases(x)
    return Design(x, states, program.value(np.array([state.height for state in states])))


def _value(design: Design) -> float:
    return design.value
