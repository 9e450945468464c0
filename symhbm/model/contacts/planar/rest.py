"""Where the slider rests if the contact never slips, and how far it is from slipping.

A contact sticks all the time at the slider's position ``q`` where ``|x(tau) - q| <= r(tau)`` for
all ``tau``. That is possible where

    m = min over q of max over tau of (|x(tau) - q| - r(tau))

is not above zero; its solution ``q*`` lies in the middle of all positions possible. The problem is
convex in two variables: one, two or three *active* instants determine it. For a constant limit
``q*`` is the centre of the smallest circle around the motion, and of a motion along a line the
middle between its ends.
"""

import math
from typing import Any

import numpy as np

from symhbm.model.contacts.planar.collocation import LAST_STEP, motion_at
from symhbm.model.contacts.planar.few_points import smallest_of
from symhbm.numerics import FloatArray
from symhbm.numerics.loops import Loop

_ROUNDS = 40
_SETTLED = 1e-15
_SAME = 1e-9
"""Distance [rad] of two active instants that are one."""
_FLAT = 1e-9
"""Relative curvature below which an active instant does not move: all of a circle are active."""


@Loop
def _asks(waves, angle: float, x: float, y: float, at) -> Any:
    """What an instant asks of a position, with its first and second derivative by the angle."""
    motion_at(waves, angle, at)
    tx, ty = at[0, 0] - x, at[1, 0] - y
    size = np.hypot(tx, ty)
    if size == 0:
        return -at[2, 0], -at[2, 1], -at[2, 2]
    nx, ny = tx / size, ty / size
    along = at[0, 1] * nx + at[1, 1] * ny
    across = at[1, 1] * nx - at[0, 1] * ny
    bend = at[0, 2] * nx + at[1, 2] * ny + across * across / size - at[2, 2]
    return size - at[2, 0], along - at[2, 1], bend


@Loop
def _highest(waves, left: float, right: float, x: float, y: float, at) -> float:
    """The instant between two that asks most: Newton's method in a bracket."""
    angle = 0.5 * (left + right)
    for _ in range(60):
        _, slope, bend = _asks(waves, angle, x, y, at)
        if slope > 0:
            left = angle
        else:
            right = angle
        new, last = 0.5 * (left + right), _SETTLED
        if bend < 0 and left <= angle - slope / bend <= right:
            new, last = angle - slope / bend, LAST_STEP
        step = abs(new - angle)
        angle = new
        if step <= last:
            break
    return angle


@Loop
def _closest(waves, angle: float, cell: float, x: float, y: float, at) -> Any:
    """The instant near an ``angle`` at which the motion is closest to a position, and its scale.

    Beside it what is asked changes within that scale [rad]; infinite where it is not within a cell.
    """
    centre, slow = angle, 0.0
    for _ in range(8):
        motion_at(waves, centre, at)
        tx, ty = at[0, 0] - x, at[1, 0] - y
        slow = at[0, 1] * at[0, 1] + at[1, 1] * at[1, 1]
        bend = slow + tx * at[0, 2] + ty * at[1, 2]
        if bend <= 0 or tx * tx + ty * ty > 4 * cell * cell * slow:
            return centre, np.inf
        step = -(tx * at[0, 1] + ty * at[1, 1]) / bend
        centre += step
        if not abs(centre - angle) <= cell:
            return centre, np.inf
        if abs(step) <= 1e-3 * cell:
            break
    motion_at(waves, centre, at)
    length = np.hypot(at[0, 0] - x, at[1, 0] - y)
    return centre, max(length / math.sqrt(slow), 1e-9 * cell)


@Loop
def _beyond(waves, centre: float, scale: float, cell: float, x: float, y: float, at) -> float:
    """The instant beside a ``centre`` within a ``cell`` that asks most, NaN where there is none.

    A negative cell is one before the centre.
    """
    step = math.copysign(0.25 * scale, cell)
    while abs(step) < abs(cell):
        _, slope, _ = _asks(waves, centre + step, x, y, at)
        if slope * cell > 0:
            first, last = min(step, cell), max(step, cell)
            return _highest(waves, centre + first, centre + last, x, y, at)
        step *= 2
    return np.nan


@Loop
def _distinct(waves, angles, n: int, x: float, y: float, at) -> int:
    """Take instants to the highest ones beside them; of those that meet one is left.

    The result is how many are left.
    """
    count = 0
    for i in range(n):
        angle = angles[i]
        for _ in range(8):
            _, slope, bend = _asks(waves, angle, x, y, at)
            if bend >= 0 or abs(slope) > -0.1 * bend:
                angle = angles[i]
                break
            angle -= slope / bend
        known = False
        for k in range(count):
            known = known or abs(angle - angles[k]) <= _SAME
        if not known:
            angles[count] = angle
            count += 1
    return count


@Loop
def _polish(waves, angles, n: int, out, at) -> bool:
    """Newton's method on the position with the instants that are active; whether it settles."""
    sides = np.empty((3, 6))
    x, y = out[0], out[1]
    size = 0.0
    for _ in range(12):
        for i in range(n):
            for _ in range(8):
                _, slope, bend = _asks(waves, angles[i], x, y, at)
                if bend >= 0:
                    return False
                angles[i] -= slope / bend
                if abs(slope / bend) <= LAST_STEP:
                    break
            value, slope, bend = _asks(waves, angles[i], x, y, at)
            tx, ty = at[0, 0] - x, at[1, 0] - y
            length = np.hypot(tx, ty)
            if length == 0:
                return False
            size = max(size, length)
            nx, ny = tx / length, ty / length
            across = at[1, 1] * nx - at[0, 1] * ny
            # By how much n turns with the position across it.
            turn = (across * across / (length * bend) - 1) / length
            sides[i, 0], sides[i, 1], sides[i, 2] = nx, ny, value
            sides[i, 3] = turn
        if n == 2:
            a, b = sides[0], sides[1]
            cross = a[0] * b[1] - a[1] * b[0]
            dot = a[0] * b[0] + a[1] * b[1]
            first_x, first_y = b[0] - a[0], b[1] - a[1]
            second_x = dot * (-b[1] * b[3] + a[1] * a[3])
            second_y = dot * (b[0] * b[3] - a[0] * a[3])
            f, g = a[2] - b[2], cross
            determinant = first_x * second_y - first_y * second_x
            if determinant == 0:
                return False
            dx = -(f * second_y - g * first_y) / determinant
            dy = -(first_x * g - second_x * f) / determinant
        else:
            a, b, c = sides[0], sides[1], sides[2]
            # All three ask for as much: two differences.
            first_x, first_y = a[0] - b[0], a[1] - b[1]
            second_x, second_y = a[0] - c[0], a[1] - c[1]
            f, g = a[2] - b[2], a[2] - c[2]
            determinant = first_x * second_y - first_y * second_x
            if abs(determinant) < 1e-12:
                return False
            dx = (f * second_y - g * first_y) / determinant
            dy = (first_x * g - second_x * f) / determinant
        x, y = x + dx, y + dy
        if abs(dx) + abs(dy) <= 4 * _SETTLED * size:
            break
    else:
        return False
    out[0], out[1] = x, y
    out[2] = 0.0
    for i in range(n):
        out[2] += _asks(waves, angles[i], x, y, at)[0] / n
    return True


@Loop
def weights_of(waves, angles, n: int, place, sides) -> None:
    """Write of each active instant into ``sides`` (n, 8) what slopes need.

    ``n_x``, ``n_y``, the weight with which it counts, ``x' . n_perp``, the length of ``x - q``, the
    second derivative of what it asks by the angle (minus infinity where it has none).
    """
    at = np.empty((3, 3))
    size = 0.0
    for i in range(n):
        _, _, bend = _asks(waves, angles[i], place[0], place[1], at)
        tx, ty = at[0, 0] - place[0], at[1, 0] - place[1]
        length = np.hypot(tx, ty)
        nx, ny = (tx / length, ty / length) if length > 0 else (0.0, 0.0)
        sides[i, 0], sides[i, 1], sides[i, 2] = nx, ny, 1.0 / n
        sides[i, 3], sides[i, 4] = at[1, 1] * nx - at[0, 1] * ny, length
        size = max(size, length, np.hypot(at[0, 1], at[1, 1]))
        sides[i, 5] = bend
    for i in range(n):
        if sides[i, 5] > -_FLAT * size:
            sides[i, 5] = -np.inf
    if n == 3:
        # Weights of which the directions n are in balance.
        for i in range(3):
            a, b = sides[(i + 1) % 3], sides[(i + 2) % 3]
            sides[i, 2] = a[0] * b[1] - a[1] * b[0]
        total = sides[0, 2] + sides[1, 2] + sides[2, 2]
        for i in range(3):
            sides[i, 2] = sides[i, 2] / total if total != 0 else 1.0 / 3


@Loop
def resting_place(waves, angles, out) -> int:
    """Write ``q*`` and ``m`` into ``out`` (3), the active instants [rad] into ``angles`` (3).

    The result is the number of active instants.
    """
    samples = 16 * waves.shape[2] + 16
    cell = 2 * math.pi / samples
    at = np.empty((3, 3))
    # A cell may hold two instants that ask most, one on either side of the closest position.
    grid, points = np.empty((samples, 3)), np.empty((2 * samples + 4, 3))
    instants = np.empty(2 * samples + 4)
    asked = np.empty(samples)
    basis, kept = np.empty(4, dtype=np.int64), np.empty(3)
    trial, polished, sides = np.empty(3), np.empty(3), np.empty((3, 8))
    # Without the mean of the limit, which moves no place, a small motion keeps its digits.
    mean, waves[2, 0, 0] = waves[2, 0, 0], 0.0
    for i in range(samples):
        motion_at(waves, i * cell, at)
        for k in range(3):
            grid[i, k] = at[k, 0]
    n = smallest_of(grid, samples, basis, out)
    for i in range(n):
        angles[i] = basis[i] * cell
    size = 0.0
    for i in range(samples):
        size = max(size, abs(grid[i, 0] - out[0]) + abs(grid[i, 1] - out[1]) + abs(grid[i, 2]))
    for _ in range(_ROUNDS):
        for i in range(samples):
            asked[i] = np.hypot(grid[i, 0] - out[0], grid[i, 1] - out[1]) - grid[i, 2]
        count, largest = 0, -np.inf
        for i in range(samples):
            if asked[i] >= asked[i - 1] and asked[i] >= asked[(i + 1) % samples]:
                angle = _highest(waves, (i - 1) * cell, (i + 1) * cell, out[0], out[1], at)
                instants[count] = angle
                count += 1
                centre, scale = _closest(waves, angle, cell, out[0], out[1], at)
                for side in range(2 if scale < cell else 0):
                    reach = cell if side else -cell
                    angle = _beyond(waves, centre, scale, reach, out[0], out[1], at)
                    if not np.isnan(angle):
                        instants[count] = angle
                        count += 1
        for i in range(count):
            largest = max(largest, _asks(waves, instants[i], out[0], out[1], at)[0])
            for k in range(3):
                points[i, k] = at[k, 0]
        if largest <= out[2] + 4e-16 * size:
            break
        for i in range(n):
            motion_at(waves, angles[i], at)
            for k in range(3):
                points[count, k] = at[k, 0]
            instants[count] = angles[i]
            count += 1
        n = smallest_of(points, count, basis, trial)
        moved = abs(trial[0] - out[0]) + abs(trial[1] - out[1])
        for k in range(3):
            out[k] = trial[k]
        for i in range(n):
            angles[i] = instants[basis[i]]
        if moved <= _SETTLED * size:
            break
        if n >= 2:
            for k in range(3):
                kept[k], polished[k] = angles[k], out[k]
            left = _distinct(waves, kept, n, out[0], out[1], at)
            settles = left >= 2 and _polish(waves, kept, left, polished, at)
            if settles and left == 3:
                # One that would have to pull is not active.
                weights_of(waves, kept, 3, polished, sides)
                for i in range(3):
                    if sides[i, 2] < 0:
                        kept[i], left = kept[2], 2
                settles = left == 3 or _polish(waves, kept, 2, polished, at)
            if settles:
                worst = -np.inf
                for i in range(samples):
                    value = np.hypot(grid[i, 0] - polished[0], grid[i, 1] - polished[1])
                    worst = max(worst, value - grid[i, 2])
                near = abs(polished[2] - out[2]) <= 1e-3 * size
                if near and worst <= polished[2] + 1e-14 * size:
                    n = left
                    for k in range(3):
                        angles[k], out[k] = kept[k], polished[k]
    waves[2, 0, 0] = mean
    out[2] -= mean
    return n


def middle_of(samples: FloatArray) -> FloatArray:
    """Where a slider rests, (2,), of samples (3, n) over a period of ``x``, ``y`` and ``r``."""
    count = samples.shape[1]
    waves = np.fft.rfft(samples)[:, : count // 4] / count
    waves[:, 1:] *= 2
    place = np.empty(3)
    resting_place(np.stack([waves.real, -waves.imag], axis=1), np.empty(3), place)
    return place[:2]
