"""The periodic motion of a slider: its position after a period is that before it.

Where a contact opens there is no memory, and one march from where it closes is the motion. Where it
never opens a march takes a position of the slider to another one, closer to the periodic one unless
the contact only sticks; Newton's method with the derivative of the march finds that.
"""

import math
from typing import Any

import numpy as np

from symhbm.model.contacts.planar.collocation import bounds_of, motion_at
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
from symhbm.model.contacts.press import closed_intervals
from symhbm.numerics.loops import Loop, arrays

NEVER, RESTS, MOVES, BEGINS = range(4)
"""Whether a contact never touches, sticks all the time, slips or opens, or just begins to slip."""
TOO_MANY, UNSETTLED = -1, -2
"""Numbers of pieces that say what failed."""
FEW, PER_HARMONIC, MOST = 100, 50, 20000
"""Numbers of pieces that suffice as a rule, and the most."""
_NO_SLIP = 1e-13
"""How much a resting place may be asked for, relative to the limit: less is no slip."""
_LEAST_SLIP = 1e-9
"""How much it is asked for by the least slip whose derivatives have digits."""
_LAPS = 200
_SETTLED = 1e-14
"""Change of the position of the slider, relative to motion and limit, that is round-off."""


@Loop
def prepare(basis, motion, values, waves, press, turning, closed) -> int:
    """Write series of ``k_t u_x``, ``k_t u_y``, ``mu p`` (3, 2, H + 1) and of ``p`` (2, H + 1).

    A slider moves with the mean of ``u``, which no force depends on and which takes digits: it is
    left out. ``values`` are ``k_t``, ``k_n``, ``mu`` and ``N0``; further arguments and the result
    are those of `symhbm.model.contacts.press.closed_intervals`.
    """
    order, is_sine, _ = basis
    size = len(order)
    waves[:], press[:] = 0.0, 0.0
    press[0, 0] = values[3]
    for i in range(size):
        part = 1 if is_sine[i] else 0
        if order[i] > 0:
            waves[0, part, order[i]] = values[0] * motion[i]
            waves[1, part, order[i]] = values[0] * motion[size + i]
        if len(motion) > 2 * size:
            press[part, order[i]] += values[1] * motion[2 * size + i]
    for part in range(2):
        arrays.add(values[2], press[part], waves[2, part])
    return closed_intervals(press, turning, closed)


@Loop
def _most_inside(waves, q, at) -> float:
    """The instant [rad] at which a force is farthest inside its circle, about."""
    samples = 8 * waves.shape[2] + 8
    best, angle = np.inf, 0.0
    for i in range(samples):
        tau = 2 * math.pi * i / samples
        motion_at(waves, tau, at)
        value = np.hypot(at[0, 0] - q[0], at[1, 0] - q[1]) - at[2, 0]
        if value < best:
            best, angle = value, tau
    return angle


@Loop
def _newton(transfer, tiny: float, step) -> Any:
    """Write how far the periodic motion is from the end of a march, (2); how far from its begin.

    A march ends on the circle: what it leaves of a change is along one direction, across the last
    force. With the result comes what has changed along the force; below what is ``tiny`` that is
    left out.
    """
    a, b, x = transfer[0, 0], transfer[0, 1], transfer[0, 2]
    c, d, y = transfer[1, 0], transfer[1, 1], transfer[1, 2]
    step[:] = 0.0
    first, second = np.hypot(a, c), np.hypot(b, d)
    if max(first, second) == 0.0:
        return 0.0, np.hypot(x, y)
    along_x, along_y = (a / first, c / first) if first > second else (b / second, d / second)
    share = along_x * x + along_y * y
    rest = np.hypot(x - share * along_x, y - share * along_y)
    if rest <= tiny:
        x, y = share * along_x, share * along_y
    determinant = (1 - a) * (1 - d) - b * c
    if determinant <= 0.0:
        return np.hypot(x, y), rest
    start_x = ((1 - d) * x + b * y) / determinant
    start_y = ((1 - a) * y + c * x) / determinant
    step[0], step[1] = a * start_x + b * start_y, c * start_x + d * start_y
    return np.hypot(x + step[0], y + step[1]), rest


@Loop
def period(waves, held: int, n_closed: int, closed, place, pieces, nodes) -> Any:
    """Write the pieces of one period of a contact: what it does, and how many there are.

    ``held`` is 0 for a contact that is to stick, 1 for one that is to slip; ``closed`` (2, n) tells
    the intervals [rad] in which it is closed, ``n_closed`` their number (-1: always), ``place`` (3)
    the resting place of the slider. The result is one of the kinds, and the number of pieces:
    `TOO_MANY` where they are more than the arrays hold, `UNSETTLED` where no march ends where it
    began. A contact that is to slip and is at its limit but for round-off rests; its pieces are
    those of the least slip, whose limit is in ``waves`` then.
    """
    bounds, at, q = np.empty((2, 4)), np.empty((3, 3)), np.empty(2)
    transfer, step = np.empty((2, 3)), np.empty(2)
    bounds_of(waves, bounds)
    if n_closed == 0 or bounds[1, 0] == 0:
        return NEVER, 0
    tiny, least = _NO_SLIP * bounds[1, 0], _LEAST_SLIP * bounds[1, 0]
    begins = held == 1 and n_closed < 0 and bounds[0, 0] > 0 and abs(place[2]) < least
    if begins:
        waves[2, 0, 0] -= least - place[2]
        bounds_of(waves, bounds)
    elif held == 0 or (n_closed < 0 and (place[2] <= tiny or bounds[0, 0] == 0)):
        return RESTS, 0
    if n_closed > 0:
        count, n_nodes = 0, 0
        for i in range(n_closed):
            start, finish = closed[0, i], closed[1, i]
            count, n_nodes = lap(
                waves, bounds, start, finish, CLOSED, q, transfer, pieces, nodes, count, n_nodes
            )
            if count < 0 or count >= len(pieces) - 1:
                return MOVES, TOO_MANY
            following = closed[0, i + 1] if i + 1 < n_closed else closed[0, 0] + 2 * math.pi
            if following > finish:
                piece = pieces[count]
                piece[KIND], piece[HOW], piece[BEGIN], piece[END] = APART, 0.0, finish, following
                piece[NODE] = -1
                count += 1
        return MOVES, count
    q[0], q[1] = place[0], place[1]
    start = _most_inside(waves, q, at)
    finish = start + 2 * math.pi
    before, size = np.inf, bounds[0, 0] + bounds[1, 0]
    count = 0
    for number in range(_LAPS):
        count, _ = lap(waves, bounds, start, finish, GIVEN, q, transfer, pieces, nodes, 0, 0)
        if count < 0:
            return MOVES, TOO_MANY
        slips = False
        for i in range(count):
            slips = slips or pieces[i, KIND] == SLIP
        if not slips:
            return RESTS, 0
        if number == 0:
            continue
        change, rest = _newton(transfer, 1e-12 * size, step)
        small = change + rest <= 1e-10 * size
        if change + rest <= _SETTLED * size or (small and change > 0.3 * before):
            break
        if change < before or number % 4:
            q[0], q[1] = q[0] + step[0], q[1] + step[1]
        before = change
    else:
        return MOVES, UNSETTLED
    return BEGINS if begins else MOVES, count
