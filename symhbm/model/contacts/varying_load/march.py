"""One contact over one period: where it sticks, slips, opens and closes, and what it does there.

The contact has the tangential displacement ``u`` and the normal one ``v``, which closes it where it
is positive. Its spring carries ``p = N0 + k_n v``; it is closed where ``p > 0``. The scaled
position ``q`` of its slider lies between two walls,

    low = k_t u - mu p  <=  q  <=  high = k_t u + mu p,

which move; ``q`` rests unless one of them pushes it. Where the contact is apart the walls have met
and ``q = k_t u``. Events are zeros of the trigonometric polynomials ``low'``, ``high'`` and ``p``,
and the places where a wall reaches ``q``: between two zeros in a row each wall is monotone.
"""

import math

import numpy as np

from symhbm.model.contacts.motions import Behaviour, History, angles_from
from symhbm.model.contacts.press import extremes
from symhbm.numerics import FloatArray, FourierBasis
from symhbm.numerics.loops import Loop, series

APART, PUSHED_UP, PUSHED_DOWN, STICK_LOW, STICK_HIGH, STICK_CLOSED, LIFTED = range(7)
"""Kinds of pieces: ``q`` is ``k_t u``, ``low``, ``high``, or a number since an event.

That event is a turning point of ``low`` or of ``high``, or the contact has closed there. The last
kind tells where a contact is apart whose stick is imposed.
"""
KIND, BEGIN, END, ANCHOR, SHARE, WEIGHT = range(6)
"""Columns of a piece: its kind, its ends [rad], the angle where its ``q`` is taken from [rad].

Then ``alpha`` of a piece that sticks since it closed, ``q = k_t u + alpha p`` there, and the weight
with which a piece counts: one half for each of the two that are full stick.
"""
_LOW_TURNS, _HIGH_TURNS, _OPENS_OR_CLOSES = range(3)


@Loop
def walls(cosine, sine, values, waves) -> tuple[float, float]:
    """Write ``k_t u``, ``p``, ``low`` and ``high`` into waves (4, 2, H + 1).

    The result is the round-off of walls, and of their derivatives, which a load does not move.
    ``cosine`` and ``sine`` (2, H + 1) are the coefficients of ``u`` and ``v``; ``values`` are
    ``k_t``, ``k_n``, ``mu`` and ``N0``.
    """
    stiffness, normal, friction, load = values[0], values[1], values[2], values[3]
    size, rate = abs(friction * load), 0.0
    for h in range(cosine.shape[1]):
        for k in range(2):
            part = cosine if k == 0 else sine
            pull, press = stiffness * part[0, h], normal * part[1, h]
            if h == 0 and k == 0:
                press += load
            waves[0, k, h], waves[1, k, h] = pull, press
            waves[2, k, h], waves[3, k, h] = pull - friction * press, pull + friction * press
            size += max(h, 1) * (abs(pull) + abs(friction * press))
            rate += h * (abs(pull) + abs(friction * press))
    return 4e-16 * size, 4e-16 * rate


@Loop
def march(waves, noise: tuple[float, float], held: int, pieces, turning) -> int:
    """Write the pieces of one period; the result is their number.

    ``noise`` is the round-off of `walls`. ``held`` is 1 or 0 for a contact whose slip is imposed,
    else -1. ``turning`` (4, 2) takes value and angle of the largest ``low``, the smallest ``high``,
    the smallest and the largest ``p``.
    """
    size = 6 * waves.shape[2] + 8
    angles, kinds = np.empty(size), np.empty(size, dtype=np.int64)
    rises = np.empty(size, dtype=np.bool_)
    zeros, up = np.empty(size), np.empty(size, dtype=np.bool_)
    rate = np.empty((2, waves.shape[2]))
    n = 0
    for k in range(2):  # the turning points of both walls
        series.derive(waves[2 + k, 0], waves[2 + k, 1], rate[0], rate[1])
        count = series.sign_changes(rate[0], rate[1], noise[1], zeros, up)
        high, at_high, low, at_low = extremes(waves[2 + k], zeros, count)
        turning[k, 0], turning[k, 1] = (high, at_high) if k == 0 else (low, at_low)
        for i in range(count):
            angles[n], kinds[n], rises[n] = zeros[i], k, up[i]
            n += 1
    series.derive(waves[1, 0], waves[1, 1], rate[0], rate[1])
    count = series.sign_changes(rate[0], rate[1], 0.0, zeros, up)
    high, at_high, low, at_low = extremes(waves[1], zeros, count)
    turning[2, 0], turning[2, 1], turning[3, 0], turning[3, 1] = low, at_low, high, at_high
    if high <= 0:
        return _piece(pieces, 0, APART, 0.0, 2 * math.pi, 0.0, 0.0)
    opens = low < 0
    closes = 0
    if opens:
        closes = series.sign_changes(waves[1, 0], waves[1, 1], 0.0, zeros, up)
        if not closes and waves[1, 0, 0] < 0:  # its largest load is above 0 by round-off alone
            return _piece(pieces, 0, APART, 0.0, 2 * math.pi, 0.0, 0.0)
        opens = closes > 0
        for i in range(closes):
            angles[n], kinds[n], rises[n] = zeros[i], _OPENS_OR_CLOSES, up[i]
            n += 1
    first, last = turning[0, 1], turning[1, 1]
    beyond = turning[0, 0] - turning[1, 0]
    slips = beyond > 0
    if held == 0 or (held < 0 and not slips):
        _piece(pieces, 0, STICK_LOW, first, first + 2 * math.pi, first, 0.0)
        count = _piece(pieces, 1, STICK_HIGH, first, first + 2 * math.pi, last, 0.0)
        pieces[0, WEIGHT] = pieces[1, WEIGHT] = 0.5
        for i in range(closes):
            if not up[i]:
                end = zeros[(i + 1) % closes]
                end = end if end > zeros[i] else end + 2 * math.pi
                count = _piece(pieces, count, LIFTED, zeros[i], end, 0.0, 0.0)
        return count
    # Continued beyond the limit, or on it but for round-off: each wall pushes where it turns only.
    if not slips or (beyond <= noise[0] and not opens):
        middle = last if last > first else last + 2 * math.pi
        _piece(pieces, 0, STICK_LOW, first, middle, first, 0.0)
        return _piece(pieces, 1, STICK_HIGH, middle, first + 2 * math.pi, last, 0.0)
    start = first
    if opens:
        for i in range(n):
            if kinds[i] == _OPENS_OR_CLOSES and not rises[i]:
                start = angles[i]
    for i in range(n):
        if angles[i] <= start:
            angles[i] += 2 * math.pi
    for i in range(1, n):
        angle, zero_of, rise = angles[i], kinds[i], rises[i]
        place = i
        while place and angles[place - 1] > angle:
            angles[place], kinds[place] = angles[place - 1], kinds[place - 1]
            rises[place] = rises[place - 1]
            place -= 1
        angles[place], kinds[place], rises[place] = angle, zero_of, rise
    return _around(waves, noise[0], start, opens, angles[:n], kinds[:n], rises[:n], pieces)


@Loop
def _around(waves, noise: float, start: float, opens: bool, angles, kinds, rises, pieces) -> int:
    """March from ``start`` through the sorted zeros, where each wall is monotone in between."""
    kind = APART if opens else STICK_LOW
    begin, anchor, share, count = start, start, 0.0, 0
    place = 0.0 if opens else series.at(waves[2, 0], waves[2, 1], start)[0]
    left = start
    for i in range(len(angles)):
        right = angles[i]
        if kind >= STICK_LOW:
            low = series.at(waves[2, 0], waves[2, 1], right)[0]
            high = series.at(waves[3, 0], waves[3, 1], right)[0]
            # A wall that rests pushes by round-off only.
            if low > place + noise or high < place - noise:
                wall = 2 if low > place + noise else 3
                rising = wall == 2
                reached = series.crossing(
                    waves[wall, 0], waves[wall, 1], place, left, right, rising
                )
                count = _piece(pieces, count, kind, begin, reached, anchor, share)
                kind, begin = (PUSHED_UP if wall == 2 else PUSHED_DOWN), reached
        after = kind
        if kinds[i] == _OPENS_OR_CLOSES and not rises[i]:
            after = APART
        elif kinds[i] == _OPENS_OR_CLOSES and kind == APART:
            low_slope = series.at(waves[2, 0], waves[2, 1], right)[1]
            high_slope = series.at(waves[3, 0], waves[3, 1], right)[1]
            after = STICK_CLOSED
            if low_slope > 0:
                after = PUSHED_UP
            elif high_slope < 0:
                after = PUSHED_DOWN
        elif kind == PUSHED_UP and kinds[i] == _LOW_TURNS and not rises[i]:
            after = STICK_LOW
        elif kind == PUSHED_DOWN and kinds[i] == _HIGH_TURNS and rises[i]:
            after = STICK_HIGH
        if after != kind:
            count = _piece(pieces, count, kind, begin, right, anchor, share)
            kind, begin, anchor, share = after, right, right, 0.0
            wall = 3 if kind == STICK_HIGH else 2
            place = series.at(waves[wall, 0], waves[wall, 1], right)[0]
            if kind == STICK_CLOSED:
                place = series.at(waves[0, 0], waves[0, 1], right)[0]
                closing = series.at(waves[1, 0], waves[1, 1], right)[1]
                if closing > 0:
                    share = -series.at(waves[0, 0], waves[0, 1], right)[1] / closing
        left = right
    end = start + 2 * math.pi
    if end > begin:
        count = _piece(pieces, count, kind, begin, end, anchor, share)
    return count


@Loop
def _piece(
    pieces, count: int, kind: int, begin: float, end: float, anchor: float, share: float
) -> int:
    """Append a piece; the result is the number of pieces."""
    pieces[count, 0], pieces[count, 1], pieces[count, 2] = kind, begin, end
    pieces[count, 3], pieces[count, 4], pieces[count, 5] = anchor, share, 1.0
    return count + 1


_SIDES = {PUSHED_UP: -1, STICK_LOW: -1, PUSHED_DOWN: 1, STICK_HIGH: 1, STICK_CLOSED: 0}
"""The slider is at ``k_t u + side mu p``, or stays where that was at the anchor of its piece."""


def history_of(
    basis: FourierBasis, motion: FloatArray, values: FloatArray, pieces: FloatArray, n_angles: int
) -> History:
    """From a motion (2 K) [m], ``k_t``, ``k_n``, ``mu`` and ``N0``, and pieces (p, 6)."""
    stiffness, normal, friction, load = values.tolist()
    kind, begin = pieces[:, KIND].astype(int), pieces[:, BEGIN]
    parts = motion.reshape(2, -1)
    angle = angles_from(begin[0], pieces[:, (BEGIN, END)].ravel(), n_angles)
    u, v = displacement = parts @ basis.values(angle).T
    press = load + normal * v
    # A point belongs to the piece that goes on from it, whatever the last digits of both say.
    middle = (angle[1:] + angle[:-1]) / 2
    inside = (middle - begin[:, None]) % (2 * np.pi) < (pieces[:, END] - begin)[:, None]
    inside = np.concatenate([inside, inside[:, :1]], axis=1)
    pushed = np.isin(kind, (PUSHED_UP, PUSHED_DOWN))
    side = np.array([_SIDES.get(each, 0) for each in kind.tolist()])
    at_anchor = parts @ basis.values(pieces[:, ANCHOR]).T
    place = stiffness * at_anchor[0] + side * friction * (load + normal * at_anchor[1])
    sticking = stiffness * u - place[:, None]
    pull = np.where(pushed[:, None], -friction * side[:, None] * press, sticking)
    apart = (inside & np.isin(kind, (APART, LIFTED))[:, None]).any(axis=0)
    slips = (inside & pushed[:, None]).any(axis=0)
    tangential = np.where(apart, 0.0, (pieces[:, WEIGHT, None] * inside * pull).sum(axis=0))
    carried = np.where(apart, 0.0, np.maximum(press, 0.0))
    state = np.where(apart, Behaviour.OPENS, np.where(slips, Behaviour.SLIPS, Behaviour.STICKS))
    return History(angle, displacement, np.array([tangential, carried]), friction * carried, state)
