"""Descent to a minimum of a design problem: quadratic models of all maxima in a trust region.

The models hold the exact first and second derivatives of every maximum that may become the largest,
so that steps converge quadratically to a smooth minimum as well as to one where several maxima are
equally high. On the way maxima are followed; where one is lost, and at the end, the whole bands are
surveyed, and what was not known before enters the models.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from symhbm.design.pieces import Pieces
from symhbm.design.program import Program
from symhbm.fourier import FloatArray

FIRST_RADIUS = np.log(3.0)
_LARGEST_RADIUS = np.log(30.0)
_SMALLEST_RADIUS = 1e-9
PRECISION = 1e-10
"""Last step of a minimum, relative: convergence is quadratic."""
_ROUND_OFF = 1e-13
"""Changes of the logarithm of an amplitude that tell nothing."""
AGREE = 1e-9
"""Relative difference of two maxima that are the same."""
_LEVEL_STEPS = 3
"""Steps that change nothing, where quadratic convergence has ended: the response is level."""
_MAX_STEPS = 100
_MAX_SURVEYS = 30

Evaluate = Callable[[FloatArray, list[Pieces] | None], list[Pieces]]
"""All cases at a design: surveyed, or followed from those at another."""


@dataclass(frozen=True)
class Design:
    """A design ``x`` (n_variables,), its surveyed cases, and the logarithm of the statistic."""

    x: FloatArray
    states: list[Pieces]
    value: float


@dataclass(frozen=True)
class Descent:
    """Where a descent ended: ``converged`` if no step of the models goes further down.

    ``path`` are the designs accepted, with the logarithm of the statistic.
    """

    design: Design
    converged: bool
    path: list[tuple[FloatArray, float]]


def descend(program: Program, evaluate: Evaluate, start: Design) -> Descent:
    """Go down from a surveyed design whose statistic is finite."""
    best, here = start, start
    path = [(start.x, start.value)]
    radius = FIRST_RADIUS
    for _ in range(_MAX_SURVEYS):
        here, radius, converged = _follow(program, evaluate, here, radius, path)
        surveyed = here
        if not all(state.surveyed for state in here.states):
            states = evaluate(here.x, None)
            surveyed = Design(here.x, states, _value(program, states))
        if surveyed.value <= best.value:
            best = surveyed
        if surveyed.value <= here.value + AGREE:
            return Descent(best, converged and best is surveyed, path)
        # A maximum that was not followed is higher: it is in the models from now on.
        here = surveyed if np.isfinite(surveyed.value) else best
        radius = max(radius / 4, _SMALLEST_RADIUS)
    return Descent(best, False, path)


def _follow(program, evaluate, here: Design, radius: float, path) -> tuple[Design, float, bool]:
    """Steps until none goes further down, with the maxima that are known."""
    n_level = 0
    for _ in range(_MAX_STEPS):
        step = program.step(here.states, here.x, radius)
        length = float(np.abs(step.x - here.x).max())
        expected = here.value - step.predicted
        if length <= PRECISION:
            return here, radius, step.solved
        states = evaluate(step.x, here.states)
        value = _value(program, states)
        gain = here.value - value
        # Close to the minimum gains drown in round-off; the models are then as good as exact.
        within = abs(gain) <= _ROUND_OFF and abs(expected) <= _ROUND_OFF
        if within or gain > 1e-4 * expected > 0:
            here = Design(step.x, states, value)
            path.append((here.x, here.value))
            n_level = n_level + 1 if within else 0
            if n_level == _LEVEL_STEPS:
                return here, radius, step.solved
            if gain > 0.75 * expected and length > 0.9 * radius:
                radius = min(2 * radius, _LARGEST_RADIUS)
            elif gain < 0.25 * expected and not within:
                radius = length / 2
        else:
            radius = length / 4
            if radius < _SMALLEST_RADIUS:
                return here, radius, False
    return here, radius, False


def _value(program: Program, states: list[Pieces]) -> float:
    return program.value(np.array([state.height for state in states]))
