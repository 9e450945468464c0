"""Periodic states: Newton's method on the map over a period, or over half a period."""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Status
from symhbm.numerics import Factorisation, FloatArray
from symhbm.time_domain.active_contacts import APART
from symhbm.time_domain.event_march import March, march
from symhbm.time_domain.linear_motion import LinearMotion, extremes

PERIODIC_TOLERANCE = 1e-11
"""Largest residual of periodicity relative to the motion, in the norm of energy."""
_ITERATIONS = 60
"""Most steps of Newton's method, from all starts."""
_SHARES = tuple(0.5**k for k in range(4))
"""Shares of a Newton step that are tried: shorter ones end at a corner, a new start is cheaper."""
_PERIODS = 10
"""Periods that are marched where Newton's method fails: each approaches the response."""
_BRIEF = 1e-5
"""Slip [rad] over a period that what is left of the residual may cause: its root."""
_SAMPLES = 4096
"""Angles among which the extremes of a force are searched: its derivative there is zero."""
_SMALLEST = 1e-12
"""Share of the largest singular value below which a direction is undetermined."""


def size_of(balance: HarmonicBalance, unknowns: FloatArray) -> float:
    """Bound [m] of a response, for tolerances."""
    return float(np.abs(balance.layout.coefficients(unknowns)).sum(axis=1).max()) or 1.0


def state_of(balance: HarmonicBalance, unknowns: FloatArray, frequency: float) -> FloatArray:
    """State (2 n_dof + n_contacts,) at ``tau = 0`` of a response: displacement, slope, friction.

    With planar friction those across follow, (2 n_dof + 2 n_contacts,).
    """
    located, relative = balance.locate(unknowns, frequency), balance.layout.relative(unknowns)
    size = balance.basis.n_components
    friction = np.zeros((2 if balance.planar_groups else 1, balance.n_contacts, size))
    for group in balance.groups:
        law, values = group.law, balance.contacts.values_of(group)
        rubs = "normal" not in law.directions or "tangential" in law.directions
        if group.n and rubs and law.spring_sliders(frequency, values) is not None:
            at = balance.contacts.at(group, relative, frequency)
            force = law.forces(at, located.groups[group.name]).reshape(group.n, -1, size)
            names = law.directions if len(law.directions) > 1 else ("tangential",)
            for k, name in enumerate(("tangential", "across")[: len(friction)]):
                if name in names:
                    friction[k, group.contacts] = force[:, names.index(name)]
    x, slope = (
        balance.layout.coefficients(unknowns) @ balance.basis.values(0.0, d) for d in (0, 1)
    )
    return np.concatenate([x, slope, (friction @ balance.basis.values(0.0)).ravel()])


def energy_scale(linear: LinearMotion) -> FloatArray:
    """Roots of the energies of unit states (2 n_dof + n_tangential n_active,)."""
    inertia = linear.frequency**2 * np.diag(linear.mass)
    elastic = np.diag(linear.stiffness)
    spring = np.where(linear.rubs, linear.contact_stiffness, 1.0)
    friction = np.tile(1 / spring, linear.n_tangential)
    return np.sqrt(np.concatenate([elastic + inertia, inertia, friction]))


def is_rigid(linear: LinearMotion) -> bool:
    """Whether something moves without stiffness where contacts do not hold it."""
    return bool(np.linalg.matrix_rank(linear.stiffness) < linear.n_dof)


@dataclass(frozen=True)
class Shot:
    """A march from a ``state`` over a period, or over half of one that repeats with a sign.

    ``residual`` is that of periodicity, ``matrix`` its derivative by the state; ``scale`` weighs
    the entries of a state by their energy.
    """

    state: FloatArray
    run: March
    residual: FloatArray
    matrix: FloatArray
    scale: FloatArray

    @cached_property
    def norm(self) -> float:
        """Size of the residual."""
        return float(np.linalg.norm(self.scale * self.residual))

    def is_near(self, precision: float) -> bool:
        """Whether the residual is within a precision relative to the motion."""
        return bool(self.norm <= precision * np.linalg.norm(self.scale * self.state))

    def improved(
        self,
        step: FloatArray,
        near: bool,
        shares: Sequence[float],
        shoot: Callable[[FloatArray], "Shot"],
    ) -> "Shot | None":
        """The first shot after a share of a Newton step that is better, None without one.

        ``near`` the periodic state the whole step must halve the residual.
        """
        for share in shares[: 1 if near else None]:
            with contextlib.suppress(ArithmeticError):
                trial = shoot(self.state + share * step)
                if trial.norm <= (1 - (0.5 if near else 1e-4) * share) * self.norm:
                    return trial
        return None


def shot(
    linear: LinearMotion,
    state: FloatArray,
    march: Callable[[Any, FloatArray, float], March] = march,
) -> Shot:
    """March from a state whose friction forces are put between their limits."""
    state, sign = linear.within_limits(state), -1.0 if linear.antiperiodic else 1.0
    run = march(linear, state, np.pi if linear.antiperiodic else 2 * np.pi)
    matrix = sign * run.jacobian - np.eye(len(state))
    return Shot(state, run, sign * run.end - state, matrix, energy_scale(linear))


def periodic_state(
    linear: LinearMotion, starts: Iterator[FloatArray]
) -> tuple[FloatArray, int, Status]:
    """State at ``tau = 0`` of the periodic motion, number of Newton steps, and status.

    ``starts`` (2 n_dof + n_active,) are states; each is used where Newton's method fails from the
    one before.
    """
    if not linear.largest_force:
        return np.zeros(2 * linear.n_dof + len(linear.active)), 0, Status.SUCCESS

    def attempt(state: FloatArray) -> Shot:
        trial = shot(linear, state)
        if linear.antiperiodic:
            return trial
        if linear.moves:
            return with_centres(linear, trial, off_middle)
        stuck = np.flatnonzero(~trial.run.slipped)
        return replace(trial, state=_centred(linear, trial.run, trial.state, stuck))

    def begin(state: FloatArray) -> Shot:
        try:
            return attempt(state)
        except ArithmeticError:
            return attempt(np.zeros_like(state))

    current, was_on_edge = begin(next(starts)), False
    for iteration in range(_ITERATIONS):
        near, trial = current.is_near(PERIODIC_TOLERANCE), None
        if current.norm > 0:
            step = _newton_step(linear, current)
            if step is None:
                return current.state, iteration, Status.SYSTEM_SINGULAR
            trial = current.improved(step, near, _SHARES, attempt)
        if trial is None and near:
            trial = None if was_on_edge else _off_edges(linear, current, attempt)
            if trial is None:
                return current.state, iteration, Status.SUCCESS
            was_on_edge = True
        start = next(starts, None) if trial is None else None
        if trial is not None:
            current = trial
        elif start is not None:
            current = begin(start)
        else:
            for _ in range(_PERIODS):
                current = attempt(-current.run.end if linear.antiperiodic else current.run.end)
    return current.state, _ITERATIONS, Status.NO_MOTION


def _off_edges(
    linear: LinearMotion, current: Shot, attempt: Callable[[FloatArray], Shot]
) -> Shot | None:
    """A shot without slip that is round-off, None where there is none or it would slip again.

    The static force of a contact that never slips is free between two edges, to which Newton's
    method comes from beyond.
    """
    run = current.run
    slips = np.abs(run.cells.state) == 1
    brief = linear.rubs & run.slipped & (run.cells.width @ slips < _BRIEF)
    brief &= ~np.any(run.cells.state == APART, axis=0)
    if linear.antiperiodic or not brief.any():
        return None
    try:
        trial = attempt(_centred(linear, run, current.state, np.flatnonzero(brief)))
    except ArithmeticError:
        return None
    return None if trial.run.slipped[brief].any() else trial


def _newton_step(linear: LinearMotion, current: Shot) -> FloatArray | None:
    scale, matrix, right = current.scale, current.matrix.copy(), -current.residual
    rigid = not linear.antiperiodic and is_rigid(linear)
    if not (linear.antiperiodic or rigid or linear.moves):
        # The static force of a contact that never slips is free: no step changes it.
        free = 2 * linear.n_dof + np.flatnonzero(~current.run.slipped)
        matrix[free], right[free] = np.eye(len(scale))[free], 0.0
    matrix, right = matrix * (scale[:, None] / scale), scale * right
    if rigid:
        # The position of a body without springs is free instead: the step of least norm.
        step = np.linalg.lstsq(matrix, right, rcond=_SMALLEST)[0]
    else:
        step = Factorisation(matrix).solve(right)
    return None if step is None else step / scale


def _centred(linear: LinearMotion, run: March, state: FloatArray, stuck: np.ndarray) -> FloatArray:
    """The same motion with the forces of contacts ``stuck`` between their limits.

    They never slip: their static forces shift the whole motion and change no other constant
    limit.
    """
    directions = linear.directions[stuck]
    force = linear.contact_stiffness[stuck] * (run.cells.displacement @ directions.T)
    force[:, 0] = run.cells.friction[:, stuck]
    high, low = extremes(force)
    push = -(high + low) / 2 @ directions
    move = np.linalg.lstsq(linear.stiffness, -push, rcond=None)[0]
    if np.abs(linear.stiffness @ move + push).max() > 1e-9 * np.abs(push).max():
        return state
    shift = np.zeros_like(state)
    shift[: linear.n_dof] = move
    shift[2 * linear.n_dof + stuck] = -(high + low) / 2
    return state + shift


def with_centres(linear: LinearMotion, trial: Shot, middle: Callable[..., Any]) -> Shot:
    """The shot with one more condition: forces of contacts that never slip are centred.

    ``middle`` tells how far that of a contact is off, and the derivative by the state.
    """
    residual, matrix = trial.residual.copy(), trial.matrix.copy()
    if not linear.antiperiodic:
        across = len(linear.active) * np.arange(linear.n_tangential)
        for contact in np.flatnonzero(~trial.run.slipped).tolist():
            rows = 2 * linear.n_dof + contact + across
            residual[rows], matrix[rows] = middle(linear, trial.run, trial.state, contact)
    if not np.all(np.isfinite(matrix)):
        raise ArithmeticError("the derivative of the motion is not finite")
    return replace(trial, residual=residual, matrix=matrix)


def off_middle(
    linear: LinearMotion, run: March, state: FloatArray, contact: int
) -> tuple[float, FloatArray]:
    """How far the force of a contact that sticks is from the middle of its limits; derivative.

    Periodicity does not determine the static force of such a contact. What it comes nearest to are
    the upper limit at one instant and the lower one at another.
    """
    n, friction = linear.n_dof, linear.friction[contact]
    force = run.cells.displacement @ (
        linear.contact_stiffness[contact] * linear.directions[contact]
    )
    force[:, 0] = run.cells.friction[:, contact]
    tau = 2 * np.pi * np.arange(1, _SAMPLES + 1) / _SAMPLES
    x, _, samples = run.cells.evaluate(linear, tau)
    wall = friction * run.cells.pressure(linear)[:, :, contact]
    limit = friction * linear.pressure(x)[:, contact]
    by_displacement = friction * linear.pressing[contact]
    high, low = extremes(np.stack([force - wall, force + wall], axis=2))
    instants = np.argmax(samples[:, contact] - limit), np.argmin(samples[:, contact] + limit)
    gradient = np.zeros(len(state))
    for sign, instant in zip((-1, 1), instants, strict=True):
        jacobian = march(linear, state, tau[instant]).jacobian
        gradient += (jacobian[2 * n + contact] + sign * by_displacement @ jacobian[:n]) / 2
    return float((high[0] + low[1]) / 2), gradient
