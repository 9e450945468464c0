"""The periodic motion of a slider: its position after a period is that before it.

Where a contact opens there is no memory, and one march from where it closes is the motion. Where it
never opens a march takes a position of the slider to another one, which is closer to the periodic one
but where the contact only sticks; Newton's method with the derivative of the march finds that.
"""

import math
from typing import Any

import numpy as np

from symhbm.model.contacts.planar.march import (
    APART,
    BEGIN,
    CLOSED,
    END,
    GIVEN,
    HOW,
    KIND,
    NODE,
    SLIP,
    lap,
)
from symhbm.model.contacts.planar.rest import resting_place
from symhbm.model.contacts.planar.series import bounds_of, closed_intervals, motion_at
from symhbm.numerics.loops import Loop

NEVER, RESTS, MOVES = range(3)
"""Whether a contact never touches, sticks all the time, or slips or opens."""
_LAPS = 60
_SETTLED = 1e-14
"""Change of the position of the slider, relative to the largest limit, that is round-off."""


@Loop
def _most_inside(waves: Any, q: Any, at: Any) -> float:
    """The instant [rad] at which a force is farthest inside its circle, about."""
    samples = 8 * waves.shape[2] + 8
    best, angle = np.inf, 0.0
    for i in range(samples):
        tau = 2 * math.pi * i / samples
        motion_at(waves, tau, at)
        value = math.hypot(at[0, 0] - q[0], at[1, 0] - q[1]) - at[2, 0]
        if value < best:
            best, angle = value, tau
    return angle


@Loop
def period(
    waves: Any, held: int, closed: Any, place: Any, angles: Any, pieces: Any, nodes: Any
) -> Any:
    """Write the pieces of one period of a contact: what it does, and how many there are.

    ``held`` is 0 for a contact that is to stick. ``closed`` (2, n) takes where it is closed [rad],
    ``place`` (3) and ``angles`` (3) the resting place of the slider. The result is one of the
    kinds, the number of closed intervals (-1: always), of pieces (-1: too many for the arrays), and
    of active instants.
    """
    bounds, at, q = np.empty((2, 4)), np.empty((3, 3)), np.empty(2)
    transfer = np.empty((2, 3))
    bounds_of(waves, bounds)
    n_closed = closed_intervals(waves, bounds, closed[0], closed[1])
    n_active = resting_place(waves, angles, place)
    # Without a motion nothing but the limit is felt, and round-off of the mean is none.
    if bounds[0, 0] == 0 and n_closed < 0:
        place[2] = min(place[2], 0.0)
    if held == 0 or (n_closed < 0 and place[2] <= 0):
        return RESTS, n_closed, 0, n_active
    if n_closed == 0:
        return NEVER, n_closed, 0, n_active
    if n_closed > 0:
        count, n_nodes = 0, 0
        for i in range(n_closed):
            start, finish = closed[0, i], closed[1, i]
            count, n_nodes = lap(
                waves, bounds, start, finish, CLOSED, q, transfer, pieces, nodes, count, n_nodes
            )
            if count < 0 or count >= len(pieces) - 1:
                return MOVES, n_closed, -1, n_active
            following = closed[0, i + 1] if i + 1 < n_closed else closed[0, 0] + 2 * math.pi
            if following > finish:
                piece = pieces[count]
                piece[KIND], piece[HOW], piece[BEGIN], piece[END] = APART, 0.0, finish, following
                piece[NODE] = -1
                count += 1
        return MOVES, n_closed, count, n_active
    q[0], q[1] = place[0], place[1]
    start = _most_inside(waves, q, at)
    finish = start + 2 * math.pi
    before = np.inf
    count = 0
    for number in range(_LAPS):
        first_x, first_y = q[0], q[1]
        count, _ = lap(waves, bounds, start, finish, GIVEN, q, transfer, pieces, nodes, 0, 0)
        if count < 0:
            return MOVES, n_closed, -1, n_active
        slips = False
        for i in range(count):
            slips = slips or pieces[i, KIND] == SLIP
        if not slips:
            return RESTS, n_closed, 0, n_active
        if number == 0:
            continue
        a, b = 1 - transfer[0, 0], -transfer[0, 1]
        c, d = -transfer[1, 0], 1 - transfer[1, 1]
        determinant = a * d - b * c
        if determinant <= 0:
            continue
        x = (d * transfer[0, 2] - b * transfer[1, 2]) / determinant
        y = (a * transfer[1, 2] - c * transfer[0, 2]) / determinant
        change = math.hypot(x, y)
        if change <= _SETTLED * bounds[1, 0] or (
            change <= 1e-9 * bounds[1, 0] and change > 0.3 * before
        ):
            break
        if change < before or number % 4:
            q[0], q[1] = first_x + x, first_y + y
        before = change
    return MOVES, n_closed, count, n_active
