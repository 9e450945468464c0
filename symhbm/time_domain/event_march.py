"""Event-driven integration of the motion with contacts, with exact derivatives.

A sticking contact begins to slip when its friction force reaches ``+-mu N``, a slipping one sticks
when the wall that pushes its slider turns back; it opens when its normal force vanishes, before
which it slips, and when it closes it slips if the tangential motion is faster than the wall.
Acceleration is a continuous function of displacement, velocity and friction forces, and these are
continuous in time: a shift of an event changes none of their derivatives but one, that of the
friction force. Of a contact that begins to slip or opens it becomes that of the wall or 0; of one
that closes and sticks it is that of the displacement since the contact closed.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.numerics import FloatArray
from symhbm.numerics.loops import Loop, polynomials
from symhbm.time_domain.active_contacts import APART, STICK, slip
from symhbm.time_domain.cells import Cells
from symhbm.time_domain.linear_motion import DEGREE, LinearMotion

_POWER = np.arange(DEGREE + 1)
_INSTANT = 1e-13
"""Distance of events [rad] below which they share one state."""
SHORTEST = 1e-15
"""Shortest interval between events [rad]: the round-off of an angle."""
_NOISE = 1e-13
"""Share of the terms of a margin below which it is round-off: walls that move with the slider."""
EVENTS_PER_CONTACT = 2000
"""Events per contact above which contacts change their states without end."""
_TO_BERNSTEIN = np.ascontiguousarray(polynomials.bernstein(DEGREE).T)
_ROUND_OFF = 2.0**-52
"""Share of a cell within which events are one."""


@dataclass(frozen=True)
class March:
    """A motion over an interval: its cells, its events and its end.

    Attributes
    ----------
    cells
        The motion; ``slipped`` (n_active,) tells which contacts slipped or opened in it.
    events : (n_events, 3)
        Where [rad], which active contact, and its state that begins.
    end : (2 n_dof + n_active,)
        Displacement, derivative by ``tau`` and friction force at the end.
    jacobian : (2 n_dof + n_active, 2 n_dof + n_active)
        Exact derivative of the end by the start.
    """

    cells: Cells
    slipped: np.ndarray
    events: FloatArray
    end: FloatArray
    jacobian: FloatArray

    def multipliers(self, linear: LinearMotion) -> np.ndarray:
        """Eigenvalues of the derivative, largest first, at given static forces."""
        values = np.linalg.eigvals(self.perturbed(linear)[1])
        return values[np.argsort(-np.abs(values))]

    def perturbed(self, linear: LinearMotion) -> tuple[np.ndarray, FloatArray]:
        """The derivative at given static forces, of the entries of the state that come first.

        Static forces of contacts that never slip do not change: each has one more eigenvalue, 1.
        """
        n, size = linear.n_dof, linear.n_tangential
        directions = np.concatenate([linear.directions, linear.across][:size])
        slipped = np.tile(self.slipped, size)
        stuck = 2 * n + np.flatnonzero(~slipped)
        moves = 2 * n + np.flatnonzero(slipped & directions.any(axis=1))
        kept = np.concatenate([np.arange(2 * n), moves])
        matrix = self.jacobian[np.ix_(kept, kept)]
        # The forces of stuck contacts follow the displacement through their springs alone.
        springs = np.tile(linear.contact_stiffness, size)[:, None] * directions
        matrix[:, :n] += self.jacobian[np.ix_(kept, stuck)] @ springs[~slipped]
        return kept, matrix


def march(linear: LinearMotion, state: FloatArray, length: float) -> March:
    """March from ``tau = 0`` to ``length`` [rad].

    ``state`` (2 n_dof + n_active,) is displacement, its derivative by ``tau`` [m] and the friction
    forces [N], which are put between their limits. Raises ArithmeticError for a motion that is not
    finite, or where events follow each other without end.
    """
    n, count = linear.n_dof, len(linear.active)
    x, slope, friction = np.split(linear.within_limits(state), [n, 2 * n])
    limit = linear.limits(x)
    of_contact, touching = _states_at(linear, x, slope, friction, limit)
    friction = np.where(of_contact == STICK, friction, slip(of_contact) * limit)
    slipped = (of_contact != STICK) | ~linear.rubs
    variation = np.eye(len(state))
    for j in np.flatnonzero(slipped).tolist():
        variation[2 * n + j] = linear.friction_slopes(of_contact)[j] @ variation[:n]
    ended_slip, changes = np.zeros(count), np.empty((count, 2), dtype=np.int64)
    contacts = of_contact, ended_slip, touching
    tau, cells, events = 0.0, [], []
    while length - tau > SHORTEST:
        flow, powers = linear.cell(tau, x, slope, friction, of_contact)
        if not np.isfinite(powers).all():
            raise ArithmeticError("the motion is not finite")
        share = min(1.0, (length - tau) / flow.width)
        powers *= share ** _POWER[:, None]
        at, n_changes = _to_event(linear, powers, friction, limit, contacts, changes)
        width = share * at * flow.width
        if width > SHORTEST:
            powers = powers * at ** _POWER[:, None]
            cells.append((tau, width, powers, friction, of_contact.copy()))
            slopes, stick = linear.friction_slopes(of_contact), of_contact == STICK
            _carry(linear, flow.transition(share * at), slopes, of_contact, variation)
            travel = powers[1:].sum(axis=0)
            x, slope = powers[0] + travel, _POWER @ powers / width
            limit = linear.limits(x)
            friction = np.where(stick, friction + slopes @ travel, slip(of_contact) * limit)
            tau = length if at == 1.0 and share < 1.0 else tau + width
            if width > _INSTANT:
                ended_slip[:], touching[:] = 0.0, False
        for j, side in changes[:n_changes].tolist():
            before, ended_slip[j] = of_contact[j], 0.0
            if before == APART:
                of_contact[j], touching[j] = _closing(linear, slope, j), True
            elif before == STICK and linear.rubs[j]:
                of_contact[j] = 1.0 - 2.0 * side
            elif before != STICK and side == 0:
                of_contact[j], ended_slip[j] = STICK, before
            else:
                of_contact[j], touching[j] = APART, True
            friction = friction.copy()
            if of_contact[j] != STICK:
                friction[j] = slip(of_contact[j]) * limit[j]
                slipped[j] = True
                variation[2 * n + j] = linear.friction_slopes(of_contact)[j] @ variation[:n]
            elif before == APART:
                friction[j] = 0.0
                variation[2 * n + j] = linear.friction_since_closing(slope, j) @ variation[:n]
            events.append((tau, j, of_contact[j]))
        if len(events) > EVENTS_PER_CONTACT * count:
            raise ArithmeticError("the contacts change their states without end")
    return March(
        Cells(*map(np.array, zip(*cells, strict=True))),
        slipped,
        np.array(events, dtype=float).reshape(-1, 3),
        np.concatenate([x, slope, friction]),
        variation,
    )


def _states_at(
    linear: LinearMotion, x: FloatArray, slope: FloatArray, friction: FloatArray, limit: FloatArray
) -> tuple[FloatArray, np.ndarray]:
    """States of the contacts (n_active,), and which of them just touch."""
    pressure, closes = linear.pressure(x), linear.pressing @ slope
    pushes = np.sign(friction) * linear.contact_stiffness * (linear.directions @ slope)
    pushes -= linear.friction * closes
    # A limit that moves is that of the state but for round-off.
    least = limit - _NOISE * (limit + linear.friction * np.abs(linear.loads))
    state = np.where((np.abs(friction) >= least) & (pushes > 0), np.sign(friction), STICK)
    touching = pressure == 0
    state[(pressure < 0) | touching & (closes <= 0)] = APART
    for j in np.flatnonzero(touching & (closes > 0)).tolist():
        state[j] = _closing(linear, slope, j)
    return state, touching


def _closing(linear: LinearMotion, slope: FloatArray, contact: int) -> float:
    """State of an active contact that closes: it slips if it moves faster than the wall."""
    outward = linear.contact_stiffness[contact] * (linear.directions[contact] @ slope)
    wall = linear.friction[contact] * (linear.pressing[contact] @ slope)
    return math.copysign(1.0, outward) if abs(outward) * (1 - _NOISE) > wall else STICK


def _to_event(
    linear: LinearMotion,
    powers: FloatArray,
    friction: FloatArray,
    limit: FloatArray,
    contacts: tuple[FloatArray, FloatArray, NDArray[np.bool_]],
    changes: NDArray[np.int64],
) -> tuple[float, int]:
    """The first event within a cell, as `first_event`, by margins that are positive until then.

    Distances to the upper and the lower limit while a contact sticks; along the slip, the velocity
    less that of the limit, and the normal force; minus that where it is open. Zeros at the start of
    the cell that belong to the last event are divided out.
    """
    force = linear.contact_stiffness[:, None] * (linear.directions @ powers.T)
    pressure = linear.pressing @ powers.T
    pressure[:, 0] += linear.loads
    wall = linear.friction[:, None] * pressure
    force[:, 0], wall[:, 0] = friction, limit
    margin = np.empty((len(friction), 2, DEGREE + 1))
    _write_margins(force, wall, pressure, *contacts, linear.rubs, margin)
    return first_event(margin, changes)


def _carry(
    linear: LinearMotion, transition: FloatArray, slopes: FloatArray, state: FloatArray,
    variation: FloatArray,
) -> None:  # fmt: skip
    """Write the derivative by the initial state after one more cell of friction's ``slopes``."""
    n = linear.n_dof
    constant = -linear.push @ variation[2 * n :]
    if linear.moves:
        closed = (state != APART)[:, None]
        constant -= linear.push_normal @ (closed * (linear.pressing @ variation[:n]))
    moved = transition @ np.concatenate([variation[: 2 * n], constant])
    variation[2 * n :] += slopes @ (moved[:n] - variation[:n])
    variation[: 2 * n] = moved


@Loop
def _write_margins(force, wall, pressure, state, ended_slip, touching, rubs, margin) -> None:
    size = margin.shape[2]
    for j in range(len(state)):
        apart, slides = state[j] == APART, abs(state[j]) == 1
        if apart or not rubs[j]:
            for k in range(size):
                margin[j, 0, k] = -pressure[j, k] if apart else pressure[j, k]
            _make_positive(margin[j, 1])
            if touching[j]:
                _divide(margin[j, 0])
            continue
        terms = 0.0
        for k in range(size):
            order = k if slides else 1
            terms = max(terms, order * abs(force[j, k]), order * abs(wall[j, k]))
            if not slides:
                margin[j, 0, k] = wall[j, k] - force[j, k]
                margin[j, 1, k] = wall[j, k] + force[j, k]
                continue
            margin[j, 1, k] = pressure[j, k]
            margin[j, 0, k] = 0.0
            if k:
                margin[j, 0, k - 1] = k * (state[j] * force[j, k] - wall[j, k])
        # Differences of equal terms never change their sign: their digits are round-off.
        for side in range(1 if slides else 2):
            if _largest(margin[j, side]) <= _NOISE * terms:
                _make_positive(margin[j, side])
        if touching[j]:
            for side in range(1 if slides else 0, 2):
                _divide(margin[j, side])
        # A contact that sticks since this instant is on its limit, at zero velocity: a double zero.
        if ended_slip[j] != 0 and not slides:
            for _ in range(2):
                _divide(margin[j, 0 if ended_slip[j] > 0 else 1])


@Loop
def _divide(powers) -> None:
    """Divide a polynomial that is 0 at 0 by its variable."""
    for k in range(len(powers) - 1):
        powers[k] = powers[k + 1]
    powers[len(powers) - 1] = 0.0


@Loop
def _make_positive(powers) -> None:
    """Write a polynomial that never changes its sign."""
    for k in range(len(powers)):
        powers[k] = 0.0
    powers[0] = 1.0


@Loop
def _largest(powers) -> float:
    largest = 0.0
    for k in range(len(powers)):
        largest = max(largest, abs(powers[k]))
    return largest


@Loop
def first_event(margin, changes) -> Any:
    """Share of the cell at the first event, 1 without one, and how many contacts have it.

    ``margin`` (n_active, 2, DEGREE + 1) are powers of what is positive until then; their contacts
    and sides are written to ``changes`` (n_active, 2).
    """
    flat = margin.reshape(-1, margin.shape[2])
    exits = np.empty(len(flat))
    polynomials.find_exits(flat @ _TO_BERNSTEIN, flat, exits)
    at, count = math.inf, 0
    for j in range(len(exits)):
        at = min(at, exits[j])
    if at > 1:
        return 1.0, 0
    for j in range(len(margin)):
        side = 1 if exits[2 * j + 1] < exits[2 * j] else 0
        if exits[2 * j + side] <= at + _ROUND_OFF:
            changes[count, 0], changes[count, 1] = j, side
            count += 1
    return at, count
