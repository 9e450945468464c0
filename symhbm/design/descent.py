"""Descent to a minimum of a design problem: quadratic models of all maxima in a trust region.

The models have the exact first and second derivatives of every maximum that may become the largest:
steps converge quadratically, to a smooth minimum as well as to one where several maxima are equally
high. Maxima are followed between steps; where one is lost, and at the end, the whole bands are
surveyed, and new maxima enter the models.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from symhbm.design import tolerances
from symhbm.design.maxima import Maxima
from symhbm.design.program import ActiveSet, Program
from symhbm.numerics import FloatArray

Evaluate = Callable[[FloatArray, tuple[FloatArray, list[Maxima]] | None], list[Maxima]]
"""Maxima of all cases at a design: surveyed, or followed from another design."""


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


def descend(program: Program, evaluate: Evaluate, start: Design) -> Descent:
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
            states = evaluate(current.x, None)
            surveyed = Design(current.x, states, program.value(states, current.x))
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
        states = evaluate(step.x, (current.x, current.states))
        value = program.value(states, step.x)
        gain = current.value - value
        if gain > 1e-4 * expected > 0:
            current = Design(step.x, states, value)
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
    program: Program, evaluate: Evaluate, current: Design
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
        states = evaluate(x, (current.x, current.states))
        trial = Design(x, states, program.value(states, x))
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
