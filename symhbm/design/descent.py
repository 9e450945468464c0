"""Descent to a minimum of a design problem: quadratic models of all maxima in a trust region.

The models have the exact first and second derivatives of every maximum that may become the largest:
steps converge quadratically, to a smooth minimum as well as to one where several maxima are equally
high. Maxima are followed between steps; where one is lost, and at the end, the whole bands are
surveyed, and new maxima enter the models.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from symhbm.design.maxima import FollowedMaximum, Maxima
from symhbm.design.optimum import ActiveSet
from symhbm.design.program import Program
from symhbm.numerics import FloatArray

FIRST_RADIUS = np.log(3.0)
"""Radii of the trust region, in logarithms of the design: first, largest and smallest."""
_LARGEST_RADIUS = np.log(30.0)
_SMALLEST_RADIUS = 1e-9
PRECISION = 1e-10
"""Last step of a minimum, relative: convergence is quadratic."""
_ROUND_OFF = 1e-13
"""Change of the logarithm of an amplitude that is round-off."""
_HIDDEN = 1e-10
"""Gain of a short step below the tolerance of IPOPT."""
AGREE = 1e-9
"""Largest relative difference of equal maxima."""
_STILL = 1e-12
"""Slope of the logarithm of an amplitude over that of a design that is round-off."""
_SMALL = 1e-3
"""Radius of the trust region whose step gives the multipliers at an optimum."""
_DIGITS = 1e-12
"""Last step of Newton's method."""
_MAX_POLISHES = 6
"""Most steps of Newton's method: it converges quadratically."""
_MAX_STEPS = 100
"""Most steps between two surveys."""
_MAX_SURVEYS = 30
"""Most surveys of a descent."""

Evaluate = Callable[[FloatArray, tuple[FloatArray, list[Maxima]] | None], list[Maxima]]
"""Maxima of all cases at a design: surveyed, or followed from another design."""


@dataclass(frozen=True)
class Design:
    """A design ``x`` (n_variables,), its cases, and the logarithm of the statistic."""

    x: FloatArray
    states: list[Maxima]
    value: float


@dataclass(frozen=True)
class Descent:
    """The end of a descent: a surveyed ``design``.

    ``converged`` tells that no step of the models leads further down; ``active`` are then the
    active maxima, bounds and constraint rows.
    """

    design: Design
    converged: bool
    active: ActiveSet | None = None


def is_flat(design: Design) -> bool:
    """Whether the largest maxima do not change with the design, to first and second order."""
    maxima = [followed for state in design.states for followed in state.contenders[:1]]
    return bool(maxima) and are_flat(maxima)


def are_flat(maxima: list[FollowedMaximum]) -> bool:
    """Whether maxima do not change with the design, to first and second order."""
    return all(
        np.abs(followed.gradient).max() < _STILL and np.abs(followed.hessian).max() < _STILL
        for followed in maxima
    )


def descend(program: Program, evaluate: Evaluate, start: Design) -> Descent:
    """Descend from a surveyed design whose statistic is finite."""
    best, current = start, start
    radius = FIRST_RADIUS
    for _ in range(_MAX_SURVEYS):
        current, radius, converged = _follow(program, evaluate, current, radius)
        active = None
        if converged:
            current, active = _polished(program, evaluate, current)
        surveyed = current
        if not all(state.surveyed for state in current.states):
            states = evaluate(current.x, None)
            surveyed = Design(current.x, states, _value(program, states))
        if surveyed.value <= best.value + _ROUND_OFF:
            best = surveyed
        if surveyed.value <= current.value + AGREE:
            ended = best is surveyed
            return Descent(best, converged and ended, active if ended else None)
        # A maximum that was not followed is higher: it enters the models.
        current = surveyed if np.isfinite(surveyed.value) else best
        radius = max(radius / 4, _SMALLEST_RADIUS)
    return Descent(best, False)


def _follow(program, evaluate, current: Design, radius: float) -> tuple[Design, float, bool]:
    """Steps until the statistic falls no further, without new surveys."""
    for _ in range(_MAX_STEPS):
        if is_flat(current):
            return current, radius, False
        step = program.step(current.states, current.x, radius)
        length = float(np.abs(step.x - current.x).max())
        expected = current.value - step.predicted
        # Gains below IPOPT's tolerance do not count; Newton's method gives the last digits.
        hidden = abs(expected) <= (_HIDDEN if length <= _SMALL else _ROUND_OFF)
        if length <= PRECISION or hidden:
            return current, radius, step.solved
        states = evaluate(step.x, (current.x, current.states))
        value = _value(program, states)
        gain = current.value - value
        if gain > 1e-4 * expected > 0:
            current = Design(step.x, states, value)
            if gain > 0.75 * expected and length > 0.9 * radius:
                radius = min(2 * radius, _LARGEST_RADIUS)
            elif gain < 0.25 * expected:
                radius = length / 2
        else:
            radius = length / 4
            if radius < _SMALLEST_RADIUS:
                return current, radius, False
    return current, radius, False


def _polished(
    program: Program, evaluate: Evaluate, current: Design
) -> tuple[Design, ActiveSet | None]:
    """Newton's method on the conditions of a minimum, as long as their residual falls."""
    active = _active_set(program, current)
    for _ in range(_MAX_POLISHES if active else 0):
        assert active is not None
        change, _, _ = active.step()
        length = float(np.abs(change).max())
        if not length <= _SMALL:
            break
        x = np.clip(current.x + change, program.variables.lower, program.variables.upper)
        states = evaluate(x, (current.x, current.states))
        trial = Design(x, states, _value(program, states))
        better = _active_set(program, trial)
        if better is None or not trial.value <= current.value + AGREE:
            break
        if better.stationarity >= active.stationarity and length > _DIGITS:
            break
        current, active = trial, better
        if length <= _DIGITS:
            break
    return current, active


def _active_set(program: Program, design: Design) -> ActiveSet | None:
    """The active set of a design, None where IPOPT fails."""
    step = program.step(design.states, design.x, _SMALL)
    if not step.solved:
        return None
    active = ActiveSet.of(program, design.x, design.states, step)
    _, weights, pulls = active.step()
    return (
        replace(active, weights=weights, constraint_multipliers=pulls)
        if np.all(weights > 0)
        else active
    )


def _value(program: Program, states: list[Maxima]) -> float:
    return program.value(np.array([state.height for state in states]))
