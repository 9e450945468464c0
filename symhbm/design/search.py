"""The search for an optimal design: several starts, and descents from them."""

from dataclasses import dataclass

import numpy as np

from symhbm.design.cases import Cases
from symhbm.design.descent import AGREE, Descent, Design, descend, is_flat
from symhbm.design.optimum import ActiveSet
from symhbm.design.program import Program
from symhbm.design.variables import DesignVariables, Group
from symhbm.numerics import FloatArray

_SEED = 2013
"""Seed of the starts: a search is reproducible."""
_NEARBY = np.log(3.0)
"""Distance of designs around another one: less than a descent reaches over."""
_APART = np.log(25.0)
"""Distance of starts: a descent reaches over a factor of five on either side."""


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
    sloping = [design for design in chosen if not is_flat(design)] or sorted(
        (design for design in designs if np.isfinite(design.value) and not is_flat(design)),
        key=lambda design: design.value,
    )[:1]
    descents = [descend(program, cases, design) for design in sloping]
    best = min(designs, key=lambda design: design.value)
    lowest = min((descent.design.value for descent in descents), default=np.inf)
    if best.value < lowest - AGREE or not descents:
        return SearchResult(best, None, designs, descents)
    # Of minima that agree, one that converged has more digits.
    alike = [descent for descent in descents if descent.design.value <= lowest + AGREE]
    ended = min(alike, key=lambda descent: not descent.converged)
    return SearchResult(ended.design, ended.active, designs, descents)


def starts(variables: DesignVariables, n_starts: int | None) -> FloatArray:
    """Designs spread over the bounds, (n_starts, n_variables)."""
    n = variables.n_variables
    wide = variables.upper - variables.lower
    along = n_starts or max(3, int(np.ceil(np.max(wide) / _APART - 1e-9)))
    if n == 1:
        points = (np.arange(along)[:, None] + 0.5) / along
    else:
        points = _spread(n, along)
    return variables.lower + points * wide


def around(variables: DesignVariables, x: FloatArray, n_points: int) -> FloatArray:
    """Designs around another one, (n_points, n_variables): values differ by up to a factor."""
    nearby = x + _NEARBY * (2 * _spread(variables.n_variables, n_points) - 1)
    return np.clip(nearby, variables.lower, variables.upper)


def _spread(n_variables: int, n_points: int) -> FloatArray:
    """Points spread evenly over the unit cube."""
    # Slow to import, and needed for designs of several variables alone.
    from scipy.stats import qmc

    sobol = qmc.Sobol(n_variables, rng=np.random.default_rng(_SEED))
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
        return sorted(finite, key=lambda design: design.value)[:most]
    finite.sort(key=lambda design: design.x[0])
    values = [np.inf, *(design.value for design in finite), np.inf]
    valleys = [
        design
        for i, design in enumerate(finite, start=1)
        if values[i] <= values[i - 1] and values[i] < values[i + 1]
    ]
    return sorted(valleys, key=lambda design: design.value)[:most]


def _surveyed(program: Program, cases: Cases, x: FloatArray) -> Design:
    states = cases(x)
    return Design(x, states, program.value(np.array([state.height for state in states])))
