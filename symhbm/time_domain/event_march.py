"""Event-driven integration of the motion with contacts, with exact derivatives.

A sticking contact begins to slip when its friction force reaches ``+-mu N``, a slipping one sticks
when the wall that pushes its slider turns back; it opens when its normal force vanishes, before
which it slips, and when it closes it slips if the tangential motion is faster than the wall.
Acceleration is a continuous function of displacement, velocity and friction forces, and these are
continuous in time: a shift of an event changes none of their derivatives but one, that of the
friction force. Of a contact that begins to slip or opens it becomes that of the wall or 0; of one
that closes and sticks it is that of the displacement since the contact closed.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

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


@dataclass(frozen=True)
class March:
    """A motion over an interval: its cells, its events and its end.

    Attributes
    ----------
    cells
        The motion; ``slipped`` (n_active,) tells which contacts slipped or opened in it.
    event_angle, event_contact, event_state : (n_events,)
        Where [rad], which active contact, and its state that begins.
    end : (2 n_dof + n_active,)
        Displacement, derivative by ``tau`` and friction force at the end.
    jacobian : (2 n_dof + n_active, 2 n_dof + n_active)
        Exact derivative of the end by the start.
    """

    cells: Cells
    slipped: np.ndarray
    event_angle: FloatArray
    event_contact: np.ndarray
    event_state: FloatArray
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
        n = linear.n_dof
        stuck = 2 * n + np.flatnonzero(~self.slipped)
        slipped = 2 * n + np.flatnonzero(self.slipped & linear.rubs)
        kept = np.concatenate([np.arange(2 * n), slipped])
        matrix = self.jacobian[np.ix_(kept, kept)]
        # The forces of stuck contacts follow the displacement through their springs alone.
        spring = (linear.contact_stiffness[:, None] * linear.directions)[~self.slipped]
        matrix[:, :n] += self.jacobian[np.ix_(kept, stuck)] @ spring
        return kept, matrix


def march(linear: LinearMotion, state: FloatArray, length: float) -> March:
    """March from ``tau = 0`` to ``length`` [rad].

    ``state`` (2 n_dof + n_active,) is displacement, its derivative by ``tau`` [m] and the friction
    forces [N], which are put between their limits. Raises ArithmeticError for a motion that is not
    finite, or where events follow each other without end.
    """
    n, count = linear.n_dof, len(linear.active)
    x, slope = state[:n].copy(), state[n : 2 * n].copy()
    limit = linear.limits(x)
    friction = np.clip(state[2 * n :], -limit, limit)
    of_contact, touching = _states_at(linear, x, slope, friction, limit)
    friction = np.where(of_contact == STICK, friction, slip(of_contact) * limit)
    slipped = (of_contact != STICK) | ~linear.rubs
    variation = np.eye(len(state))
    _follow_walls(linear, of_contact, np.flatnonzero(slipped), variation)
    ended_slip = np.zeros(count)
    tau, cells, events = 0.0, [], []
    while length - tau > SHORTEST:
        flow = linear.flow(of_contact)
        powers = linear.expand(flow, tau, x, slope, linear.constant(x, friction, of_contact))
        if not np.all(np.isfinite(powers)):
            raise ArithmeticError("the motion is not finite")
        share = min(1.0, (length - tau) / flow.width)
        powers *= share ** _POWER[:, None]
        margin = _margins(linear, powers, friction, limit, of_contact, ended_slip, touching)
        at, changing, side = first_event(margin)
        width = share * at * flow.width
        if width > SHORTEST:
            powers = powers * at ** _POWER[:, None]
            cells.append((tau, width, powers, friction.copy(), of_contact.copy()))
            variation = _carry(linear, flow.transition(share * at), of_contact, variation)
            stick = of_contact == STICK
            x = powers.sum(axis=0)
            slope = _POWER @ powers / width
            travel = linear.directions @ powers[1:].sum(axis=0)
            friction = friction + np.where(stick, linear.contact_stiffness * travel, 0.0)
            if len(linear.normal):
                limit = linear.limits(x)
                friction = np.where(stick, friction, slip(of_contact) * limit)
            tau = length if at == 1.0 and share < 1.0 else tau + width
            if width > _INSTANT:
                ended_slip, touching = np.zeros(count), np.zeros(count, dtype=bool)
        for j, of_side in zip(changing.tolist(), side.tolist(), strict=True):
            before, ended_slip[j] = of_contact[j], 0.0
            if before == APART:
                of_contact[j], touching[j] = _closing(linear, slope, j), True
            elif before == STICK and linear.rubs[j]:
                of_contact[j] = 1.0 - 2.0 * of_side
            elif before != STICK and of_side == 0:
                of_contact[j], ended_slip[j] = STICK, before
            else:
                of_contact[j], touching[j] = APART, True
            if of_contact[j] != STICK:
                friction[j] = slip(of_contact[j]) * limit[j]
                slipped[j] = True
                _follow_walls(linear, of_contact, np.array([j]), variation)
            elif before == APART:
                friction[j] = 0.0
                variation[2 * n + j] = linear.friction_since_closing(slope, j) @ variation[:n]
            events.append((tau, j, of_contact[j]))
        if len(events) > EVENTS_PER_CONTACT * count:
            raise ArithmeticError("the contacts change their states without end")
    angle, contact, begins = zip(*events, strict=True) if events else ([], [], [])
    return March(
        Cells(*map(np.array, zip(*cells, strict=True))),
        slipped,
        np.array(angle, dtype=float),
        np.array(contact, dtype=int),
        np.array(begins, dtype=float),
        np.concatenate([x, slope, friction]),
        variation,
    )


def _states_at(
    linear: LinearMotion, x: FloatArray, slope: FloatArray, friction: FloatArray, limit: FloatArray
) -> tuple[FloatArray, np.ndarray]:
    """States of the contacts (n_active,), and which of them just touch."""
    normal, pushes = linear.normal, np.sign(friction) * (linear.directions @ slope)
    closes, least = normal.directions @ slope, limit.copy()
    pushes[normal.contact] -= normal.ratio * closes
    # A limit that moves is that of the state but for round-off.
    least[normal.contact] -= _NOISE * (
        limit[normal.contact] + normal.friction * np.abs(normal.load)
    )
    state = np.where((np.abs(friction) >= least) & (pushes > 0), np.sign(friction), STICK)
    touching = np.zeros(len(limit), dtype=bool)
    if len(normal):
        pressure = normal.pressure(x)
        touching[normal.contact] = pressure == 0
        state[normal.contact[(pressure < 0) | (pressure == 0) & (closes <= 0)]] = APART
        for j in normal.contact[(pressure == 0) & (closes > 0)].tolist():
            state[j] = _closing(linear, slope, j)
    return state, touching


def _closing(linear: LinearMotion, slope: FloatArray, contact: int) -> float:
    """State of an active contact that closes: it slips if it moves faster than the wall."""
    normal, outward = linear.normal, float(linear.directions[contact] @ slope)
    k = np.searchsorted(normal.contact, contact)
    wall = float(normal.ratio[k] * (normal.directions[k] @ slope))
    return float(np.sign(outward)) if abs(outward) * (1 - _NOISE) > wall else STICK


def _follow_walls(
    linear: LinearMotion, state: FloatArray, contacts: np.ndarray, variation: FloatArray
) -> None:
    """Make the friction of contacts that slip vary as their limit does, of open ones not at all."""
    n = linear.n_dof
    variation[2 * n + contacts] = linear.friction_slopes(state)[contacts] @ variation[:n]


def _carry(
    linear: LinearMotion, transition: FloatArray, state: FloatArray, variation: FloatArray
) -> FloatArray:
    """Derivative by the initial state after one more cell."""
    n, normal, friction = linear.n_dof, linear.normal, variation[2 * linear.n_dof :]
    constant = -linear.push @ friction
    if len(normal):
        constant -= normal.push @ (normal.by_displacement(state) @ variation[:n])
    moved = transition @ np.concatenate([variation[: 2 * n], constant])
    travel = moved[:n] - variation[:n]
    return np.concatenate([moved, friction + linear.friction_slopes(state) @ travel])


def _margins(
    linear: LinearMotion,
    powers: FloatArray,
    friction: FloatArray,
    limit: FloatArray,
    state: FloatArray,
    ended_slip: FloatArray,
    touching: np.ndarray,
) -> FloatArray:
    """Powers of the margins, positive until a contact changes its state, (n_active, 2, DEGREE + 1).

    Distances to the upper and the lower limit while it sticks; along the slip, the velocity less
    that of the limit, and the normal force; minus that where it is open. Zeros at the start of the
    cell that belong to the last event are divided out.
    """
    normal, margin = linear.normal, np.empty((len(state), 2, DEGREE + 1))
    motion, pressing = linear.directions @ powers.T, normal.directions @ powers.T
    contact = friction, limit, state, ended_slip, touching, linear.contact_stiffness, linear.rubs
    springs = normal.contact, normal.stiffness, normal.load, normal.friction, normal.ratio
    _write_margins(motion, *contact, pressing, *springs, margin)
    return margin


@Loop
def _write_margins(
    motion: Any,
    friction: Any,
    limit: Any,
    state: Any,
    ended_slip: Any,
    touching: Any,
    stiffness: Any,
    rubs: Any,
    pressing: Any,
    of_normal: Any,
    normal_stiffness: Any,
    load: Any,
    coefficient: Any,
    ratio: Any,
    margin: Any,
) -> None:
    size = margin.shape[2]
    for j in range(len(state)):
        slides = abs(state[j]) == 1
        for k in range(size):
            force = stiffness[j] * motion[j, k] if k else friction[j]
            margin[j, 0, k], margin[j, 1, k] = -force, force
            if slides:
                margin[j, 0, k] = state[j] * (k + 1) * motion[j, k + 1] if k + 1 < size else 0.0
        margin[j, 0, 0] += 0.0 if slides else limit[j]
        margin[j, 1, 0] += limit[j]
        if slides:
            _make_positive(margin[j, 1])
    for i in range(len(of_normal)):
        j = of_normal[i]
        if state[j] == APART or not rubs[j]:
            _write_pressure(normal_stiffness[i], load[i], pressing[i], touching[j], margin[j, 0])
            for k in range(size if state[j] == APART else 0):
                margin[j, 0, k] = -margin[j, 0, k]
            _make_positive(margin[j, 1])
            continue
        # The limits of a contact that sticks, and the wall of one that slips, move with the load.
        moves = coefficient[i] * normal_stiffness[i] if state[j] == STICK else -ratio[i]
        terms = _largest(margin[j, 0])
        wall = 0.0
        for k in range(size):
            order = 1 if state[j] == STICK else k
            wall = max(wall, abs(moves * order * pressing[i, k]))
        for k in range(1, size):
            if state[j] == STICK:
                margin[j, 0, k] += moves * pressing[i, k]
                margin[j, 1, k] += moves * pressing[i, k]
            else:
                margin[j, 0, k - 1] += moves * k * pressing[i, k]
        # Differences of equal terms never change their sign: their digits are round-off.
        for side in range(2 if state[j] == STICK else 1):
            if _largest(margin[j, side]) <= _NOISE * (terms + wall):
                _make_positive(margin[j, side])
            if state[j] == STICK and touching[j]:
                _divide(margin[j, side])
        if state[j] != STICK:
            _write_pressure(normal_stiffness[i], load[i], pressing[i], touching[j], margin[j, 1])
    # A contact that sticks since this instant is on its limit, at zero velocity: a double zero.
    for j in range(len(state)):
        if ended_slip[j] != 0 and abs(state[j]) != 1:
            for _ in range(2):
                _divide(margin[j, 0 if ended_slip[j] > 0 else 1])


@Loop
def _write_pressure(
    stiffness: float, load: float, pressing: Any, touches: bool, powers: Any
) -> None:
    """Write a normal force; of a contact that ``touches``, which has none, over its variable."""
    for k in range(len(powers)):
        powers[k] = stiffness * pressing[k] + (0.0 if k else load)
    if touches:
        _divide(powers)


@Loop
def _divide(powers: Any) -> None:
    """Divide a polynomial that is 0 at 0 by its variable."""
    for k in range(len(powers) - 1):
        powers[k] = powers[k + 1]
    powers[len(powers) - 1] = 0.0


@Loop
def _make_positive(powers: Any) -> None:
    """Write a polynomial that never changes its sign."""
    for k in range(len(powers)):
        powers[k] = 0.0
    powers[0] = 1.0


@Loop
def _largest(powers: Any) -> float:
    largest = 0.0
    for k in range(len(powers)):
        largest = max(largest, abs(powers[k]))
    return largest


def first_event(margin: FloatArray) -> tuple[float, np.ndarray, np.ndarray]:
    """Share of the cell at the first event, 1 without one, the contacts that have it, and sides.

    ``margin`` (n_active, 2, DEGREE + 1) are powers of what is positive until then.
    """
    first = polynomials.first_exits(margin.reshape(-1, margin.shape[2])).reshape(-1, 2)
    soonest = first.min(axis=1)
    at = float(soonest.min(initial=np.inf))
    if at > 1:
        return 1.0, np.zeros(0, dtype=int), np.zeros(0, dtype=int)
    changing = np.flatnonzero(soonest <= at + np.finfo(float).eps)
    return at, changing, first[changing].argmin(axis=1)
