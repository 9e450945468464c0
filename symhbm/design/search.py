"""The search for an optimal design: several starts, descents from them, and the last digits."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import qmc

from symhbm.design.cases import Cases
from symhbm.design.descent import AGREE, Descent, Design, descend
from symhbm.design.optimum import Held
from symhbm.design.pieces import Piece
from symhbm.design.program import Program
from symhbm.design.space import Group, Space
from symhbm.fourier import FloatArray

_SEED = 2013
_NEARBY = np.log(3.0)
_POLISH = 6
_SMALL = 1e-3
"""Trust region that tells the multipliers at an optimum."""
_STILL = 1e-12
"""Slope of the logarithm of an amplitude over that of a design below which there is none."""


@dataclass(frozen=True)
class Found:
    """The best design and how it was found.

    ``design`` is surveyed; ``held`` tells what holds it, None where no descent converged;
    ``starts`` are all designs surveyed first, ``descents`` those that went down from some.
    """

    design: Design
    held: Held | None
    starts: list[Design]
    descents: list[Descent]


def is_flat(design: Design) -> bool:
    """Whether no large maximum changes with the design, to first and second order."""
    pieces = [piece for state in design.states for piece in state.pieces[:1]]
    return bool(pieces) and are_flat(pieces)


def are_flat(pieces: list[Piece]) -> bool:
    """Whether none of some maxima changes with the design, to first and second order."""
    return all(
        np.abs(piece.gradient).max() < _STILL and np.abs(piece.hessian).max() < _STILL
        for piece in pieces
    )


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
    descent = min(descents, key=lambda found: (found.design.value, not found.converged))
    # Of minima that agree, one that converged has more digits.
    alike = [
        found
        for found in descents
        if found.converged and found.design.value <= descent.design.value + AGREE
    ]
    design = (alike or [descent])[0].design
    held = None
    if np.isfinite(design.value):
        design, held = _polish(program, cases, design)
    return Found(design, held, designs, descents)


def starts(space: Space, n_starts: int | None) -> FloatArray:
    """Designs spread over the bounds, (n_starts, n_variables): alike first, then any."""
    n = space.n_variables
    wide = space.upper - space.lower
    along = n_starts or max(3, int(np.ceil(np.max(wide) / np.log(10) - 1e-9)))
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


def _polish(program: Program, cases: Cases, design: Design) -> tuple[Design, Held]:
    """Newton's method on the conditions that hold at a minimum, as long as they get better."""
    held = _held(program, design)
    here = design
    for _ in range(_POLISH):
        change, _, _ = held.step()
        if not np.all(np.isfinite(change)) or np.abs(change).max() > _SMALL:
            break
        x = np.clip(here.x + change, program.space.lower, program.space.upper)
        states = cases(x, here.states)
        there = Design(x, states, program.value(np.array([s.height for s in states])))
        if not there.value <= design.value + AGREE:
            break
        better = _held(program, there)
        if better.stationarity >= held.stationarity and np.abs(change).max() > 1e-12:
            break
        here, held = there, better
        if np.abs(change).max() <= 1e-12:
            break
    if here is design:
        return design, held
    final = _surveyed(program, cases, here.x)
    return (final, held) if final.value <= design.value + AGREE else (design, held)


def _held(program: Program, design: Design) -> Held:
    step = program.step(design.states, design.x, _SMALL)
    held = Held.of(program, design.x, design.states, step)
    _, weights, pulls = held.step()
    return replace(held, weights=weights, pulls=pulls) if np.all(weights > 0) else held
