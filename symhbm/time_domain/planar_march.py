"""The motion beside planar friction from event to event, with exact derivatives, and periodic.

A sticking contact slips when its force reaches the circle of radius ``mu N``, a slipping one sticks
when nothing pushes its slider any more, and opens when its normal force vanishes. Forces are
continuous at all of these; what jumps is the derivative of the friction: of a contact that begins
to slip it follows the wall, of one that closes and sticks the displacement since it closed.
"""

import numpy as np

from symhbm.model.contacts import PlanarFriction
from symhbm.numerics import FloatArray
from symhbm.time_domain.active_contacts import APART, STICK
from symhbm.time_domain.event_march import EVENTS_PER_CONTACT, SHORTEST, March, first_event
from symhbm.time_domain.linear_motion import DEGREE
from symhbm.time_domain.planar_motion import Instant, PlanarCells, PlanarMotion, Step

_ON_CIRCLE = 1e-12
"""Relative distance from its limit below which a force is on it."""
_ALWAYS = np.eye(DEGREE + 1)[0]
"""Powers of a margin that is always positive."""
_SAMPLES = 256
"""Instants of a force whose middle is searched."""


def planar_march(linear: PlanarMotion, state: FloatArray, length: float) -> March:
    """As `symhbm.time_domain.event_march.march`, of states (2 n_dof + 2 n_active,)."""
    count = len(linear.active)
    at, zeros = _start(linear, state)
    closes = np.zeros(count, dtype=bool)
    slipped = (at.state != STICK) | ~linear.rubs
    cells, events, changes = [], [], np.empty((count, 2), dtype=np.int64)
    while length - at.tau > SHORTEST:
        step = linear.step(at, length - at.tau)
        powers, directions = linear.polynomials(at, step)
        if not np.all(np.isfinite(powers)):
            raise ArithmeticError("the motion is not finite")
        margin = _margins(linear, at, step, powers, zeros)
        margin = np.ascontiguousarray(margin.transpose(2, 1, 0))
        share, n_changes = first_event(margin, changes)
        width = share * step.width
        if width > SHORTEST:
            along = share ** np.arange(DEGREE + 1)[:, None]
            cell = at.tau, width, powers * along, at.force, at.state, directions * along
            cells.append(cell)
            last = share == 1.0 and step.width >= length - at.tau
            at = linear.follow(at, step, share, closes)
            at.tau = length if last else at.tau
            zeros, closes = np.zeros((2, count), dtype=int), np.zeros(count, dtype=bool)
        for j, of_side in changes[:n_changes].tolist():
            _change(linear, at, j, of_side, zeros, closes)
            slipped[j] |= at.state[j] != STICK
            events.append((at.tau, j, at.state[j]))
        if len(events) > EVENTS_PER_CONTACT * count:
            raise ArithmeticError("the contacts change their states without end")
    by_x, by_slope, by_force, _ = at.by_start
    return March(
        PlanarCells(*map(np.array, zip(*cells, strict=True))),
        slipped,
        np.array(events, dtype=float).reshape(-1, 3),
        np.concatenate([at.x, at.slope, at.force.T.ravel()]),
        np.concatenate([by_x, by_slope, *by_force.transpose(1, 0, 2)]),
    )


def _start(linear: PlanarMotion, state: FloatArray) -> tuple[Instant, np.ndarray]:
    """The first instant, its forces within their limits, and zeros of margins there."""
    n, count, size = linear.n_dof, len(linear.active), len(state)
    x, slope, unit = state[:n].copy(), state[n : 2 * n].copy(), np.eye(size)
    pressure, limit = linear.pressure(x), linear.limits(x)
    force = linear.within_limits(state)[2 * n :].reshape(2, -1).T.copy()
    direction = np.arctan2(force[:, 1], force[:, 0])
    by_force = unit[2 * n :].reshape(2, count, size).transpose(1, 0, 2).copy()
    by_direction = np.zeros((count, size))
    at = Instant(
        0.0, x, slope, force, np.full(count, STICK), direction,
        (unit[:n], unit[n : 2 * n], by_force, by_direction),
    )  # fmt: skip
    on_circle = linear.rubs & (limit > 0) & (np.hypot(*force.T) >= limit * (1 - _ON_CIRCLE))
    zeros, closes = np.zeros((2, count), dtype=int), np.zeros(count, dtype=bool)
    wall = linear.pressing @ slope
    for j in range(count):
        if pressure[j] < 0 or (pressure[j] == 0 and wall[j] <= 0):
            at.state[j], at.force[j], by_force[j] = APART, 0.0, 0.0
            zeros[0, j] = pressure[j] == 0
        elif pressure[j] == 0:
            at.state[j] = APART
            _change(linear, at, j, 0, zeros, closes)
        elif on_circle[j]:
            c, s = np.cos(direction[j]), np.sin(direction[j])
            rate = linear.pairs[j] @ slope
            ahead = linear.contact_stiffness[j] * (c * rate[0] + s * rate[1])
            if ahead > linear.friction[j] * wall[j]:
                _slip(linear, at, j, direction[j])
            else:
                zeros[0, j] = 1
    return at, zeros


def _slip(linear: PlanarMotion, at: Instant, contact: int, direction: float) -> None:
    """Let a contact slip; against its one tangential direction its state is -1."""
    _, _, by_force, by_direction = at.by_start
    limit, c, s = linear.limits(at.x)[contact], np.cos(direction), np.sin(direction)
    against = not linear.across[contact].any() and c < 0
    at.direction[contact], at.state[contact] = direction, -1.0 if against else 1.0
    by_direction[contact] = 0.0
    if limit > 0:
        by_direction[contact] = (c * by_force[contact, 1] - s * by_force[contact, 0]) / limit
    linear.on_walls(at, np.array([contact]))


def _change(
    linear: PlanarMotion, at: Instant, j: int, side: int, zeros: np.ndarray, closes: np.ndarray
) -> None:
    """Change the state of a contact by the ``side`` of its margin that vanished."""
    by_x, _, by_force, _ = at.by_start
    before = at.state[j]
    if before == APART:
        rate, wall = linear.pairs[j] @ at.slope, linear.pressing[j] @ at.slope
        speed = linear.contact_stiffness[j] * np.hypot(*rate)
        at.force[j], by_force[j] = 0.0, 0.0
        if linear.rubs[j] and speed > linear.friction[j] * wall:
            zeros[:, j], closes[j] = (0, 1), True
            _slip(linear, at, j, np.arctan2(rate[1], rate[0]))
        else:
            at.state[j], zeros[:, j] = STICK, (2 * linear.rubs[j], 1)
            if wall > 0:
                # Closing earlier by dp / p' adds k_t u' times that.
                earlier = linear.pressing[j] @ by_x / wall
                by_force[j] = linear.contact_stiffness[j] * rate[:, None] * earlier
    elif before == STICK and linear.rubs[j] and side == 0:
        zeros[:, j] = 0
        _slip(linear, at, j, np.arctan2(at.force[j, 1], at.force[j, 0]))
    elif before != STICK and side == 0:
        at.state[j], zeros[:, j] = STICK, (2, 0)
    else:
        at.state[j], at.force[j], by_force[j], zeros[:, j] = APART, 0.0, 0.0, (1, 0)


def _margins(
    linear: PlanarMotion, at: Instant, step: Step, powers: FloatArray, zeros: np.ndarray
) -> FloatArray:
    """Powers of the margins, positive until a contact changes its state, (DEGREE + 1, 2, n_active).

    While it sticks the square of its limit less that of its force, while it slips the speed of its
    slider, and its normal force. ``zeros`` (2, n_active) are those at the start of the step that
    belong to the last event: they are divided out.
    """
    margin = np.zeros((DEGREE + 1, 2, len(at.state)))
    margin[0] = 1.0
    pressure = powers @ linear.pressing.T
    pressure[0] += linear.loads
    moves = linear.pressing.any(axis=1)
    travel = np.einsum("mdn,kn->kmd", linear.pairs, powers)
    travel[0] = 0.0
    slips = np.flatnonzero(np.abs(at.state) == 1)
    margin[:, 0, slips] = linear.speeds(at, step)
    for j in np.flatnonzero(linear.rubs & (at.state == STICK)).tolist():
        force = linear.contact_stiffness[j] * travel[:, j]
        force[0] += at.force[j]
        squares = [
            np.convolve(part, part) for part in (linear.friction[j] * pressure[:, j], *force.T)
        ]
        square = (squares[0] - squares[1] - squares[2])[: DEGREE + 1]
        terms = max(np.abs(part).max() for part in squares)
        margin[:, 0, j] = square / terms if terms else _ALWAYS
    for j in np.flatnonzero(moves).tolist():
        if at.state[j] == APART:
            margin[:, 0, j] = -pressure[:, j]
        else:
            margin[:, 1, j] = pressure[:, j]
    for side, j in np.argwhere(zeros).tolist():
        order = zeros[side, j]
        margin[:, side, j] = np.append(margin[order:, side, j], np.zeros(order))
    return margin


def planar_middle(
    linear: PlanarMotion, run: March, state: FloatArray, contact: int
) -> tuple[FloatArray, FloatArray]:
    """The force (2,) [N] in the middle of those that a contact has which sticks, and derivative.

    The whole motion moves with a static force: so does the middle, but for its shape.
    """
    tau = 2 * np.pi * np.arange(_SAMPLES) / _SAMPLES
    x, _, force = run.cells.evaluate(linear, tau)
    parts = [*force.reshape(_SAMPLES, 2, -1)[:, :, contact].T, linear.limits(x)[:, contact]]
    rows = 2 * linear.n_dof + contact + len(linear.active) * np.arange(2)
    return PlanarFriction.middle_of(np.array(parts)), np.eye(len(state))[rows]
