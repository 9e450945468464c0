"""Descent to a minimum of a design problem: quadratic models of all maxima in a trust region.

The models hold the exact first and second derivatives of every maximum that may become the largest,
so that steps converge quadratically to a smooth minimum as well as to one where several maxima are
equally high. On the way maxima are followed; where one is lost, and at the end, the whole bands are
surveyed, and what was not known before enters the models.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from symhbm.design.optimum import ActiveSet
from symhbm.design.pieces import FollowedMaximum, Maxima
from symhbm.design.program import Program
from symhbm.numerics import FloatArray

FIRST_RADIUS = np.log(3.0)
_LARGEST_RADIUS = np.log(30.0)
_SMALLEST_RADIUS = 1e-9
PRECISION = 1e-10
"""Last step of a minimum, relative: convergence is quadratic."""
_ROUND_OFF = 1e-13
"""Changes of the logarithm of an amplitude that tell nothing."""
_HIDDEN = 1e-10
"""Gains that the tolerance of IPOPT hides, of short steps."""
AGREE = 1e-9
"""Relative difference of two maxima that are the same."""
_STILL = 1e-12
"""Slope of the logarithm of an amplitude over that of a design below which there is none."""
_SMALL = 1e-3
"""Trust region that tells the multipliers at an optimum."""
_DIGITS = 1e-12
"""Last step of Newton's method."""
_MAX_POLISHES = 6
_MAX_STEPS = 100
_MAX_SURVEYS = 30

Evaluate = Callable[[FloatArray, tuple[FloatArray, list[Maxima]] | None], list[Maxima]]
"""All cases at a design: surveyed, or followed from those at another."""


@dataclass(frozen=True)
class Design:
    """A design ``x`` (n_variables,), its cases, and the logarithm of the statistic."""

    x: FloatArray
    states: list[Maxima]
    value: float


@dataclass(frozen=True)
class Descent:
    """Where a descent ended: a surveyed ``design``.

    ``converged`` tells that no step of the models goes further down, and then ``held`` what holds
    the design.
    """

    design: Design
    converged: bool
    held: ActiveSet | None = None


def is_flat(design: Design) -> bool:
    """Whether no large maximum changes with the design, to first and second order."""
    pieces = [piece for state in design.states for piece in state.pieces[:1]]
    return bool(pieces) and are_flat(pieces)


def are_flat(pieces: list[FollowedMaximum]) -> bool:
    """Whether none of some maxima changes with the design, to first and second order."""
    return all(
        np.abs(piece.gradient).max() < _STILL and np.abs(piece.hessian).max() < _STILL
        for piece in pieces
    )


def descend(program: Program, evaluate: Evaluate, start: Design) -> Descent:
    """Go down from a surveyed design whose statistic is finite."""
    best, here = start, start
    radius = FIRST_RADIUS
    for _ in range(_MAX_SURVEYS):
        here, radius, converged = _follow(program, evaluate, here, radius)
        held = None
        if converged:
            here, held = _polished(program, evaluate, here)
        surveyed = here
        if not all(state.surveyed for state in here.states):
            states = evaluate(here.x, None)
            surveyed = Design(here.x, states, _value(program, states))
        if surveyed.value <= best.value + _ROUND_OFF:
            best = surveyed
        if surveyed.value <= here.value + AGREE:
            ended = best is surveyed
            return Descent(best, converged and ended, held if ended else None)
        # A maximum that was not followed is higher: it is in the models from now on.
        here = surveyed if np.isfinite(surveyed.value) else best
        radius = max(radius / 4, _SMALLEST_RADIUS)
    return Descent(best, False)


def _follow(program, evaluate, here: Design, radius: float) -> tuple[Design, float, bool]:
    """Steps until none goes further down, with the maxima that are known."""
    for _ in range(_MAX_STEPS):
        if is_flat(here):
            return here, radius, False
        step = program.step(here.states, here.x, radius)
        length = float(np.abs(step.x - here.x).max())
        expected = here.value - step.predicted
        # Gains that IPOPT's tolerance hides are none; Newton's method has the last digits.
        hidden = abs(expected) <= (_HIDDEN if length <= _SMALL else _ROUND_OFF)
        if length <= PRECISION or hidden:
            return here, radius, step.solved
        states = evaluate(step.x, (here.x, here.states))
        value = _value(program, states)
        gain = here.value - value
        if gain > 1e-4 * expected > 0:
            here = Design(step.x, states, value)
            if gain > 0.75 * expected and length > 0.9 * radius:
                radius = min(2 * radius, _LARGEST_RADIUS)
            elif gain < 0.25 * expected:
                radius = length / 2
        else:
            radius = length / 4
            if radius < _SMALLEST_RADIUS:
                return here, radius, False
    return here, radius, False


def _polished(
    program: Program, evaluate: Evaluate, here: Design
) -> tuple[Design, ActiveSet | None]:
    """Newton's method on the conditions that hold at a minimum, as long as they get better."""
    held = _held(program, here)
    for _ in range(_MAX_POLISHES if held else 0):
        assert held is not None
        change, _, _ = held.step()
        length = float(np.abs(change).max())
        if not length <= _SMALL:
            break
        x = np.clip(here.x + change, program.space.lower, program.space.upper)
        states = evaluate(x, (here.x, here.states))
        there = Design(x, states, _value(program, states))
        better = _held(program, there)
        if better is None or not there.value <= here.value + AGREE:
            break
        if better.stationarity >= held.stationarity and length > _DIGITS:
            break
        here, held = there, better
        if length <= _DIGITS:
            break
    return here, held


def _held(program: Program, design: Design) -> ActiveSet | None:
    """What holds a design, None where IPOPT does not tell."""
    step = program.step(design.states, design.x, _SMALL)
    if not step.solved:
        return None
    held = ActiveSet.of(program, design.x, design.states, step)
    _, weights, pulls = held.step()
    return replace(held, weights=weights, pulls=pulls) if np.all(weights > 0) else held


def _value(program: Program, states: list[Maxima]) -> float:
    return program.value(np.array([state.height for state in states]))
