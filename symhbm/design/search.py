"""The search for an optimal design: several starts, descents from them, and the last digits."""

from dataclasses import dataclass

import numpy as np

from symhbm.design.cases import Cases
from symhbm.design.descent import AGREE, Descent, Design, descend, is_flat
from symhbm.design.optimum import ActiveSet
from symhbm.design.program import Program
from symhbm.design.space import Group, Space
from symhbm.numerics import FloatArray

_SEED = 2013
_NEARBY = np.log(3.0)
_APART = np.log(25.0)
"""Distance of starts: a descent reaches over a factor of five on either side."""


@dataclass(frozen=True)
class Found:
    """The best design and how it was found.

    ``design`` is surveyed; ``held`` tells what holds it, None where no descent converged;
    ``starts`` are all designs surveyed first, ``descents`` those that went down from some.
    """

    design: Design
    held: ActiveSet | None
    starts: list[Design]
    descents: list[Descent]


def search(
    program: Program, cases: Cases, given: list[FloatArray], n_starts: int | None, n_descents: int
) -> Found:
    """The best of the minima that are reached from several starts.

    All finite ones that are ``given`` are gone down from, and the ``n_descents`` best of others.
    """
    points = [*given, *starts(program.space, n_starts)]
    designs = [_surveyed(program, cases, program.nearest(point)) for point in points]
    chosen = [design for design in designs[: len(given)] if np.isfinite(design.value)]
    chosen += _promising(program.space, designs[len(given) :], n_descents)
    sloping = [design for design in chosen if not is_flat(design)] or sorted(
        (design for design in designs if np.isfinite(design.value) and not is_flat(design)),
        key=lambda design: design.value,
    )[:1]
    descents = [descend(program, cases, design) for design in sloping]
    best = min(designs, key=lambda design: design.value)
    lowest = min((descent.design.value for descent in descents), default=np.inf)
    if best.value < lowest - AGREE or not descents:
        return Found(best, None, designs, descents)
    # Of minima that agree, one that converged has more digits.
    alike = [descent for descent in descents if descent.design.value <= lowest + AGREE]
    ended = min(alike, key=lambda descent: not descent.converged)
    return Found(ended.design, ended.held, designs, descents)


def starts(space: Space, n_starts: int | None) -> FloatArray:
    """Designs spread over the bounds, (n_starts, n_variables): alike first, then any."""
    n = space.n_variables
    wide = space.upper - space.lower
    along = n_starts or max(3, int(np.ceil(np.max(wide) / _APART - 1e-9)))
    if n == 1:
        points = (np.arange(along)[:, None] + 0.5) / along
    else:
        points = _spread(n, along)
    return space.lower + points * wide


def around(space: Space, x: FloatArray, n_points: int) -> FloatArray:
    """Designs whose values differ from those of another by up to a factor, (n_points, ...)."""
    nearby = x + _NEARBY * (2 * _spread(space.n_variables, n_points) - 1)
    return np.clip(nearby, space.lower, space.upper)


def _spread(n_variables: int, n_points: int) -> FloatArray:
    """Points spread evenly over the unit cube."""
    # Slow to import, and needed for designs of several variables alone.
    from scipy.stats import qmc

    sobol = qmc.Sobol(n_variables, rng=np.random.default_rng(_SEED))
    # Powers of two keep the sequence balanced.
    return sobol.random_base2(int(np.ceil(np.log2(n_points))))[:n_points]


def common(space: Space) -> Space:
    """The space of designs in which all variables of one parameter are alike."""
    groups = []
    for name in space.names:
        own = [group for group in space.groups if group.parameter == name]
        entries = tuple(sorted(entry for group in own for entry in group.entries))
        lower, upper = max(g.lower for g in own), min(g.upper for g in own)
        groups.append(Group(name, name, entries, lower, upper))
    return Space(tuple(groups), space.ratios)


def _promising(space: Space, designs: list[Design], most: int) -> list[Design]:
    """Designs to go down from: the valleys of one variable, the lowest of several."""
    finite = [design for design in designs if np.isfinite(design.value)]
    if space.n_variables > 1:
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
