"""One contact over one period: where it sticks, slips, opens and closes, and which way it slips.

The contact's spring carries ``x = k_t u`` less the scaled position ``q`` of its slider, both with
two components. The slider rests as long as the force ``T = x - q`` stays in the circle of radius
``r``; where it does not, the slider follows: ``T = r n``, and ``q' = (x' . n - r') n`` while that
pushes.
Where the contact is apart, ``r <= 0``, there is no force and no memory.
"""

import math
from typing import Any

import numpy as np

from symhbm.model.contacts.planar.collocation import (
    ALONG,
    DIRECTION,
    EXCESS,
    LIMIT,
    ROUND_OFF,
    STAGES,
    TURN,
    WEIGHT,
    direction_after,
    direction_within,
    factorise,
    motion_at,
    slip_step,
    solve_factorised,
    step_matrix,
)
from symhbm.numerics.loops import Loop

APART, STICK, SLIP = range(3)
"""Kinds of pieces."""
GOES_ON, CLOSED, GIVEN, PUSHED = range(4)
"""How a piece begins: as the one before ended, with closing, with a position of the slider.

``PUSHED`` is slip from a position of the slider.
"""
KIND, HOW, BEGIN, END, FIRST, LAST, NODE = range(7)
"""Columns of a piece: its kind, how it begins, its ends [rad].

Of slip ``a`` at both ends, of stick ``q_x`` and ``q_y``; of slip the number of its first node.
"""
TOLERANCE = 1e-12
"""Error of the force of a step, relative to the largest limit."""
_LONGEST = 2.0
"""Longest step [rad] times the highest harmonic."""
_MOST = 20000
_GROWTH = 3.0
_STALLED = 1e-9
"""Shortest stick [rad] where neither stick nor slip lasts."""


@Loop
def _stick_until(waves, bounds, q, start: float, end: float, departs: bool, at) -> Any:
    """Until when [rad] a slider rests, and whether it is pushed then.

    Bounds of derivatives tell how far the force is in the circle for sure. ``departs`` where it
    begins on the circle.
    """
    size = bounds[1, 0]
    second, third = bounds[0, 2] + bounds[1, 2], 0.0
    angle = start
    for count in range(_MOST):
        motion_at(waves, angle, at)
        tx, ty = at[0, 0] - q[0], at[1, 0] - q[1]
        force, limit, rate = np.hypot(tx, ty), at[2, 0], at[2, 1]
        slow = at[0, 1] * at[0, 1] + at[1, 1] * at[1, 1]
        if count == 0 and departs:
            # The square of the force over that of the limit: its second derivative is negative.
            bend = 2 * (slow + tx * at[0, 2] + ty * at[1, 2] - rate * rate - limit * at[2, 2])
            if bend >= 0:
                return angle, True
            step = 0.3
            for _ in range(30):
                x1 = math.sqrt(slow) + step * bounds[0, 2]
                r1 = abs(rate) + step * bounds[1, 2]
                third = 6 * (x1 * bounds[0, 2] + r1 * bounds[1, 2])
                third += 2 * (force + step * x1) * bounds[0, 3]
                third += 2 * (abs(limit) + step * r1) * bounds[1, 3]
                new = 1.5 * -bend / third if third > 0 else 0.3
                if step <= new:
                    break
                step = max(0.7 * new, 0.3 * step)
            if step < 1e-12:
                return angle, True
        else:
            gap = limit - force
            if gap <= 2 * ROUND_OFF * size:
                rising = tx * at[0, 1] + ty * at[1, 1] - rate * force
                if rising > 0 or gap < -1e-9 * size:
                    return angle, True
                gap = 0.0
            # |T + x' h| + second h^2 / 2 = r + r' h: convex, so a chord stays before its root.
            left, right = 0.0, math.sqrt(2 * (gap + limit + force) / second) if second > 0 else 7.0
            right = min(right + 2 * (abs(rate) + math.sqrt(slow)) / (second + 1e-300), 7.0)
            below = -gap
            x, y = tx + right * at[0, 1], ty + right * at[1, 1]
            above = np.hypot(x, y) - limit - right * rate + 0.5 * second * right * right
            if above <= 0:
                left = right
            else:
                for _ in range(12):
                    middle = 0.5 * (left + right)
                    x, y = tx + middle * at[0, 1], ty + middle * at[1, 1]
                    value = (
                        np.hypot(x, y) - limit - middle * rate + 0.5 * second * (middle * middle)
                    )
                    if value > 0:
                        right, above = middle, value
                    else:
                        left, below = middle, value
                    if left > 0.8 * right:
                        break
                    chord = left - below * (right - left) / (above - below)
                    x, y = tx + chord * at[0, 1], ty + chord * at[1, 1]
                    value = np.hypot(x, y) - limit - chord * rate + 0.5 * second * (chord * chord)
                    if value > 0:
                        right, above = chord, value
                    else:
                        left, below = chord, value
            step = left
        angle += max(step, 2 * ROUND_OFF * (1 + abs(angle)))
        if angle >= end:
            return end, False
    return angle, True


@Loop
def _push(at, direction: float) -> Any:
    """``x' . n - r'`` and its derivative by the angle while the contact slips."""
    c, s = math.cos(direction), math.sin(direction)
    across = at[1, 1] * c - at[0, 1] * s
    bend = at[0, 2] * c + at[1, 2] * s - at[2, 2]
    if at[2, 0] > 0:
        bend += across * across / at[2, 0]
    return at[0, 1] * c + at[1, 1] * s - at[2, 1], bend


@Loop
def _end_of_slip(waves, begin: float, length: float, direction: float, work, nodes) -> float:
    """How far [rad] into a step nothing pushes the slider any more; the step ends with that."""
    at = np.empty((3, 3))
    turns = np.empty(STAGES)
    for i in range(STAGES):
        turns[i] = nodes[i, TURN]
    left, right = 0.0, 1.0
    for i in range(STAGES):
        share = (nodes[i, 0] - begin) / length
        if nodes[i, EXCESS] < 0:
            right = share
            break
        left = share
    share = 0.5 * (left + right)
    for _ in range(50):
        a = direction_within(turns, share, direction, length)
        motion_at(waves, begin + share * length, at)
        value, slope = _push(at, a)
        if value > 0:
            left = share
        else:
            right = share
        new = 0.5 * (left + right)
        if slope < 0 and left <= share - value / (slope * length) <= right:
            new = share - value / (slope * length)
        step = abs(new - share)
        share = new
        if step < 1e-13:
            break
    end = share * length
    for _ in range(3):
        if end <= 1e-13:
            return 0.0
        slip_step(waves, begin, end, direction, work, nodes)
        motion_at(waves, begin + end, at)
        value, slope = _push(at, direction_after(nodes, direction, end))
        if not slope < 0:
            break
        step = -value / slope
        if abs(step) > 0.1 * length or abs(step) <= 1e-14:
            break
        end += step
    if end <= 1e-13:
        return 0.0
    slip_step(waves, begin, end, direction, work, nodes)
    return end


@Loop
def lap(
    waves,
    bounds,
    start: float,
    finish: float,
    how: int,
    q,
    transfer,
    pieces,
    nodes,
    count: int,
    n_nodes: int,
) -> Any:
    """March from one angle to another, over which the contact is closed; ``how`` it begins.

    ``q`` (2) is the position of the slider before and after; ``transfer`` (2, 3) takes its
    derivative by itself and how far it has moved. Pieces and nodes are added; the result is their
    numbers, negative where they do not suffice.
    """
    at = np.empty((3, 3))
    matrix, pivots = np.empty((STAGES, STAGES)), np.empty(STAGES, np.int64)
    right = np.empty((STAGES, 1))
    work = np.empty((STAGES, 4)), matrix, pivots, np.empty((STAGES, 1))
    transfer[:] = 0.0
    transfer[0, 0] = transfer[1, 1] = 1.0
    highest = max(waves.shape[2] - 1, 1)
    longest = _LONGEST / highest
    scale = bounds[1, 0]
    angle, direction = start, 0.0
    slips, departs, stalled = False, False, False
    motion_at(waves, angle, at)
    if how == CLOSED:
        q[0], q[1] = at[0, 0], at[1, 0]
        slips = np.hypot(at[0, 1], at[1, 1]) > at[2, 1]
        direction = math.atan2(at[1, 1], at[0, 1])
        departs = True
    else:
        tx, ty = at[0, 0] - q[0], at[1, 0] - q[1]
        if np.hypot(tx, ty) >= at[2, 0] * (1 - 1e-13):
            direction = math.atan2(ty, tx)
            slips = _push(at, direction)[0] > 0
            for k in range(2):
                n = math.cos(direction) if k == 0 else math.sin(direction)
                place = at[k, 0] - at[2, 0] * n
                transfer[k, 2] += place - q[k]
                q[k] = place
            how = PUSHED if slips else GIVEN
            if not slips:
                # The position is that on the circle: only its part along the circle is free.
                n0, n1 = -math.sin(direction), math.cos(direction)
                transfer[0, 0], transfer[0, 1] = n0 * n0, n0 * n1
                transfer[1, 0], transfer[1, 1] = n1 * n0, n1 * n1
    length = 0.0
    while angle < finish:
        if count >= len(pieces) - 1:
            return -1, n_nodes
        if not slips:
            until, slips = _stick_until(waves, bounds, q, angle, finish, departs, at)
            if stalled and until == angle:
                until = min(angle + _STALLED, finish)
            stalled = False
            if until > angle:
                piece = pieces[count]
                piece[KIND], piece[HOW], piece[BEGIN], piece[END] = STICK, how, angle, until
                piece[FIRST], piece[LAST] = q[0], q[1]
                count += 1
                how = GOES_ON
            angle = until
            if not slips:
                break
            motion_at(waves, angle, at)
            direction = math.atan2(at[1, 0] - q[1], at[0, 0] - q[0])
            if how != CLOSED:
                how = PUSHED
            length = 0.0
            continue
        # Slip, until nothing pushes any more.
        motion_at(waves, angle, at)
        limit_begin, first_direction = at[2, 0], direction
        shrink, moved_x, moved_y, ends = 1.0, 0.0, 0.0, False
        if length == 0.0:
            speed = np.hypot(at[0, 1], at[1, 1])
            length = longest
            if how != CLOSED and speed > 0:
                length = min(longest, 4 * at[2, 0] / speed)
        while angle < finish and not ends:
            if count >= len(pieces) - 1 or n_nodes + STAGES > len(nodes):
                return -1, n_nodes
            length = min(length, longest, finish - angle)
            own = nodes[n_nodes : n_nodes + STAGES]
            settled, error = slip_step(waves, angle, length, direction, work, own)
            largest = 0.0
            for i in range(STAGES):
                largest = max(largest, own[i, LIMIT])
            worst = largest * error * error * min(1.0, length) / (TOLERANCE * scale)
            turned = abs(own[STAGES - 1, DIRECTION] - own[0, DIRECTION])
            if (not settled or worst > 1.0 or turned > 2.0) and length > 1e-11:
                length *= 0.4 if not settled or worst > 1e6 else 0.6
                continue
            stops = False
            for i in range(STAGES):
                stops = stops or own[i, EXCESS] < 0
            after = direction_after(own, direction, length)
            motion_at(waves, angle + length, at)
            stops = stops or _push(at, after)[0] < 0
            used = length
            if stops:
                used = _end_of_slip(waves, angle, length, direction, work, own)
                ends = True
                if used == 0.0:
                    stalled = True
                    break
                after = direction_after(own, direction, used)
            elif finish - angle - length < 1e-13:
                used = finish - angle
            step_matrix(own, used, matrix)
            factorise(matrix, pivots)
            for i in range(STAGES):
                right[i, 0] = -own[i, ALONG]
            solve_factorised(matrix, pivots, right)
            change = 0.0
            for i in range(STAGES):
                change += own[i, WEIGHT] * right[i, 0]
                moved_x += own[i, WEIGHT] * own[i, EXCESS] * math.cos(own[i, DIRECTION])
                moved_y += own[i, WEIGHT] * own[i, EXCESS] * math.sin(own[i, DIRECTION])
            shrink *= 1 + change
            piece = pieces[count]
            piece[KIND], piece[HOW], piece[BEGIN], piece[END] = SLIP, how, angle, angle + used
            piece[FIRST], piece[LAST], piece[NODE] = direction, after, n_nodes
            count, n_nodes = count + 1, n_nodes + STAGES
            how = GOES_ON
            angle, direction = angle + used, after
            length = used * min(_GROWTH, max(0.7, 0.8 * max(worst, 1e-30) ** (-1.0 / 16)))
        if finish - angle < 1e-13:
            angle = finish
        motion_at(waves, angle, at)
        c, s = math.cos(direction), math.sin(direction)
        c0, s0 = math.cos(first_direction), math.sin(first_direction)
        if limit_begin > 0:
            # A change of q before, across the force, is one across the force after.
            ratio = shrink * max(at[2, 0], 0.0) / limit_begin
            across_x = -s0 * transfer[0, 0] + c0 * transfer[1, 0]
            across_y = -s0 * transfer[0, 1] + c0 * transfer[1, 1]
            transfer[0, 0], transfer[0, 1] = -s * ratio * across_x, -s * ratio * across_y
            transfer[1, 0], transfer[1, 1] = c * ratio * across_x, c * ratio * across_y
        after_x, after_y = at[0, 0] - max(at[2, 0], 0.0) * c, at[1, 0] - max(at[2, 0], 0.0) * s
        # Across the force the integral keeps more digits, along it the positions themselves.
        rest = c * (after_x - q[0] - moved_x) + s * (after_y - q[1] - moved_y)
        transfer[0, 2] += moved_x + c * rest
        transfer[1, 2] += moved_y + s * rest
        q[0], q[1] = after_x, after_y
        if ends:
            slips, departs, length = False, True, 0.0
            if how != CLOSED:
                how = GOES_ON
    return count, n_nodes
