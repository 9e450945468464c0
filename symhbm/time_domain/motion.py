"""The periodic motion in time: event-driven for springs and sliders, by shooting with others.

Shooting solves for the periodic state by Newton's method, with the variational equations for its
derivative. Motions need not be unique: a response nearby selects one.

Of motions that no force drives the period is unknown as well, and of a nonlinear mode the damping
ratio of the force along the momentum that sustains it, while its amplitude is given.
"""

import contextlib
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Status, newton, solve_point
from symhbm.numerics import FloatArray, by_harmonic, check, larger_set, unknowns_of
from symhbm.time_domain.event_march import March, march
from symhbm.time_domain.exact_motion import ExactMotion, describe_motion, exact_motion
from symhbm.time_domain.integrated_motion import IntegratedMotion
from symhbm.time_domain.linear_motion import LinearMotion, extremes
from symhbm.time_domain.periodic_orbit import (
    PERIODIC_TOLERANCE,
    Shot,
    energy_scale,
    off_middle,
    shot,
    size_of,
    state_of,
    with_centres,
)
from symhbm.time_domain.planar_march import planar_march, planar_middle
from symhbm.time_domain.planar_motion import PlanarMotion

PERIODIC = 1e-9
"""Largest distance of states a period apart over the motion, in the norm of energy."""
_EVEN = 1e-9
"""Share of a response below which even harmonics count as zero."""
_FARTHEST = 100.0
"""Norm of a trial over that of the start above which the step is too long."""
_SHOOTING_SHARES = tuple(0.5**k for k in range(8))
"""Shares of a Newton step that are tried."""
_SHOOTING_ITERATIONS = 40
"""Most steps of Newton's method."""
_SMALLEST = 1e-12
"""Share of the largest singular value below which a direction is undetermined."""


class _Bounded(LinearMotion):
    """The motion without its smooth laws, which does not grow."""

    def _check_contacts(self, problem: HarmonicBalance) -> None:
        """Any."""


def shoot(balance: HarmonicBalance, unknowns: FloatArray, frequency: float) -> ExactMotion:
    """Find the periodic motion near a response (n_unknowns,) [m] to harmonic balance.

    ``frequency`` is angular [rad/s]. The motion repeats itself with the opposite sign after half a
    period where force and response do. A contact that never slips is centred between its limits.

    Raises ValueError for a mass matrix that is not positive definite.
    """
    frequency = check.scalar("frequency", frequency, "positive")
    coefficients = np.abs(balance.layout.coefficients(unknowns))
    kind, marched, middle = IntegratedMotion, march, off_middle
    if balance.planar_groups:
        kind, marched, middle = PlanarMotion, planar_march, planar_middle
    integrator: Any = kind(balance, frequency, size_of(balance, unknowns))
    even = coefficients[:, balance.basis.order % 2 == 0]
    integrator.antiperiodic &= bool(even.max(initial=0.0) <= _EVEN * coefficients.max())
    start = integrator.of_active(state_of(balance, unknowns, frequency))
    try:
        state, iterations, status = _periodic_state(integrator, start, marched, middle)
        motion = describe_motion(integrator, state, iterations, status, marched)
        motion = replace(motion, friction_loss=motion.friction_loss + integrator.loss(motion))
    except ArithmeticError:
        n_state = 2 * integrator.n_dof + len(integrator.active)
        motion = describe_motion(_Bounded(balance, frequency), np.zeros(n_state), 0, Status.GROWS)
        return replace(motion, periodicity=np.inf)
    if status == Status.SUCCESS and motion.status == Status.NO_MOTION:
        # The tolerance of motions exact to round-off is below that of the integrator.
        status = Status.SUCCESS if motion.periodicity <= PERIODIC else Status.NO_MOTION
        motion = replace(motion, status=status)
    return motion


def _periodic_state(
    integrator: IntegratedMotion,
    start: FloatArray,
    march: Callable[..., March],
    middle: Callable[..., Any],
) -> tuple[FloatArray, int, Status]:
    """State at ``tau = 0`` of the periodic motion, number of Newton steps, and status."""
    scale = energy_scale(integrator)
    farthest = _FARTHEST * np.linalg.norm(scale * start) or np.inf

    def attempt(state: FloatArray) -> Shot:
        if np.linalg.norm(scale * state) > farthest:
            raise ArithmeticError("the motion is far from the start")
        return with_centres(integrator, shot(integrator, state, march), middle)

    current = attempt(start)
    for iteration in range(_SHOOTING_ITERATIONS):
        near = current.is_near(PERIODIC)
        if current.norm == 0:
            return current.state, iteration, Status.SUCCESS
        matrix = current.matrix * (scale[:, None] / scale)
        step = np.linalg.lstsq(matrix, -scale * current.residual, rcond=_SMALLEST)[0] / scale
        trial = current.improved(step, near, _SHOOTING_SHARES, attempt)
        if trial is None:
            return current.state, iteration, Status.SUCCESS if near else Status.NO_MOTION
        current = trial
    return current.state, _SHOOTING_ITERATIONS, Status.NO_MOTION


Balanced = tuple[HarmonicBalance, FloatArray]
"""A problem and its unknowns (n_unknowns,) [m]."""
_ITERATIONS = 30
_SHARES = (1.0, 0.5, 0.25, 0.125)
"""Shares of a Newton step that are tried."""
_STEP = 1e-6
"""Relative change of the period, and change of the damping ratio, of central differences."""
_UNDETERMINED = 1e-11
"""Share of the largest singular value below which a direction is: forces of stuck contacts."""
_FAR = 0.5
"""Change of the period, relative, or of the damping ratio beyond which it is another motion."""


def exact_motion_of(
    problem: HarmonicBalance, frequency: float, near: Balanced | None = None
) -> ExactMotion:
    """Find the periodic motion at an angular ``frequency`` [rad/s], exact for springs and sliders.

    There may be several, but with friction of a constant load alone: it is the one close to the
    response ``near``, by default to one that is solved for. Raises as `exact_motion` and `shoot`.
    """
    if not (problem.curved_groups or problem.planar_groups):
        return exact_motion(
            problem, frequency, None if near is None else state_of(*near, frequency)
        )
    if near is None:
        balance = problem.located()
        if not all(group.law.odd for group in problem.curved_groups + problem.planar_groups):
            balance = balance.with_harmonics((*range(max(*problem.harmonics, 2) + 1),))
        near = balance, solve_point(balance, frequency).unknowns
    motion = shoot(*near, frequency)
    if motion.converged:
        return motion
    return shoot(*_with_more_harmonics(*near, frequency), frequency)


def _with_more_harmonics(
    balance: HarmonicBalance, unknowns: FloatArray, frequency: float
) -> Balanced:
    """The solution of the balance with more harmonics."""
    larger = HarmonicBalance(balance.model, balance.excitation, larger_set(balance.harmonics))
    coefficient = by_harmonic(balance.basis, balance.layout.coefficients(unknowns))
    start = unknowns_of(larger.basis, balance.harmonics, coefficient)
    return larger, newton(partial(larger.evaluate, frequency=frequency), start).unknowns


class FreeMotion(NamedTuple):
    """An exact free motion.

    ``frequency`` [rad/s]; ``damping_ratio``, 0 of a limit cycle; ``amplitude`` (n_dof,), largest
    ``|x|`` over the period [m].
    """

    frequency: float
    damping_ratio: float
    amplitude: FloatArray


def free_motion(
    problem: HarmonicBalance,
    frequency: float,
    unknowns: FloatArray,
    dof: int,
    damping_ratio: float | None = None,
) -> FreeMotion | None:
    """The exact motion near a balanced one without a force, None where none is found.

    ``unknowns`` (n_unknowns,) [m] and ``frequency`` [rad/s] are a solution of the ``problem``, of a
    limit cycle or, with a ``damping_ratio``, of a nonlinear mode. The exact one has the velocity of
    its degree of freedom ``dof`` at ``tau = 0``, and if it is a mode also its displacement.

    Raises ArithmeticError and ValueError as `march` and `LinearMotion`.
    """
    whole, is_mode = LinearMotion(problem, frequency), damping_ratio is not None
    start = whole.of_active(state_of(problem, unknowns, frequency))
    n, scale = len(start), energy_scale(whole)
    size = np.linalg.norm(scale * start)
    place = np.append(start, [1.0, damping_ratio or 0.0])
    first = place.copy()
    held = [whole.n_dof + dof, *([dof] if is_mode else [])]
    unit = np.append(1 / np.where(scale > 0, scale, 1.0), [1 / size, 1 / size])

    def residual(place: FloatArray) -> tuple[FloatArray, March]:
        """Of state, period over that of the ``frequency``, and damping ratio."""
        stretch, ratio = place[-2:].tolist()
        if not np.abs(place - first)[-2:].max() < _FAR:
            raise ArithmeticError("the motion is far from the one looked for")
        linear = whole.sustained(ratio) if is_mode else whole
        run = march(linear, place[:-2], 2 * np.pi * stretch)
        moved = scale[held] * (place - first)[held]
        return np.append(scale * (run.end - place[:n]), moved), run

    wrong, run = residual(place)
    for _ in range(_ITERATIONS):
        was = np.linalg.norm(wrong)
        if was <= PERIODIC_TOLERANCE * size:
            break
        matrix = np.zeros((len(wrong), n + 2))
        matrix[:n, :n] = scale[:, None] * (run.jacobian - np.eye(n))
        for k in (n, n + 1)[: 1 + is_mode]:
            step = _STEP * np.eye(n + 2)[k]
            ends = [residual(place + sign * step)[0] for sign in (1, -1)]
            matrix[:, k] = (ends[0] - ends[1]) / (2 * _STEP)
        matrix[n + np.arange(len(held)), held] = scale[held]
        moved = np.linalg.lstsq(matrix * unit, -wrong, rcond=_UNDETERMINED)[0] * unit
        for share in _SHARES:
            with contextlib.suppress(ArithmeticError):
                trial = residual(place + share * moved)
                if np.linalg.norm(trial[0]) < was:
                    place, (wrong, run) = place + share * moved, trial
                    break
        else:
            break
    if not np.linalg.norm(wrong) <= PERIODIC_TOLERANCE * size:
        return None
    stretch, ratio = place[-2:].tolist()
    high, low = extremes(run.cells.displacement)
    # The product of ratio and frequency is that of the force, whatever the unit of time.
    return FreeMotion(frequency / stretch, ratio * stretch, np.maximum(high, -low))
