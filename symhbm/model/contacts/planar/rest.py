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

from symhbm.model.contacts.planar.series import LAST_STEP, motion_at
from symhbm.numerics import FloatArray
from symhbm.numerics.loops import Loop

_ROUNDS = 40
_SETTLED = 1e-15
_FLAT = 1e-9
"""Relative curvature below which an active instant does not move: all of a circle are active."""


@Loop
def _worst(points: Any, count: int, x: float, y: float) -> Any:
    """Which of the points (n, 3) of ``x``, ``y`` and ``r`` asks most, and how much."""
    at, largest = 0, -np.inf
    for i in range(count):
        value = math.hypot(points[i, 0] - x, points[i, 1] - y) - points[i, 2]
        if value > largest:
            at, largest = i, value
    return at, largest


@Loop
def _of_three(points: Any, i: int, j: int, k: int, out: Any) -> bool:
    """The position that three points ask for as much, into ``out`` (3) with how much that is."""
    ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
    bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
    determinant = ax * by - ay * bx
    size = (abs(ax) + abs(ay)) * (abs(bx) + abs(by))
    if abs(determinant) <= 1e-13 * size:
        return False
    # With rho = m + r of the first, q is linear in rho: differences of squared distances.
    da, db = points[j, 2] - points[i, 2], points[k, 2] - points[i, 2]
    ca, cb = 0.5 * (ax * ax + ay * ay - da * da), 0.5 * (bx * bx + by * by - db * db)
    x0, y0 = (ca * by - cb * ay) / determinant, (ax * cb - bx * ca) / determinant
    x1, y1 = -(da * by - db * ay) / determinant, -(ax * db - bx * da) / determinant
    a, b, c = x1 * x1 + y1 * y1 - 1, x0 * x1 + y0 * y1, x0 * x0 + y0 * y0
    root = b * b - a * c
    if root < 0:
        return False
    root = math.sqrt(root)
    found, least = False, np.inf
    for sign in (-1.0, 1.0):
        # Roots of a rho^2 + 2 b rho + c, without cancellation.
        large = -b + sign * root
        if abs(a) > 1e-14 and abs(large) > 0:
            rho = large / a
        elif -b - sign * root != 0:
            rho = c / (-b - sign * root)
        else:
            continue
        if rho < 0 or rho + da < 0 or rho + db < 0 or rho >= least:
            continue
        found, least = True, rho
        out[0] = points[i, 0] + x0 + x1 * rho
        out[1] = points[i, 1] + y0 + y1 * rho
        out[2] = rho - points[i, 2]
    return found


@Loop
def smallest_of(points: Any, count: int, basis: Any, out: Any) -> int:
    """Solve the problem of a few points (n, 3): position and value into ``out`` (3).

    ``basis`` (4) takes the numbers of the active ones; the result is how many they are.
    """
    tried = np.empty(3)
    n = 1
    basis[0] = 0
    for i in range(count):
        if points[i, 2] < points[basis[0], 2]:
            basis[0] = i
    out[0], out[1], out[2] = points[basis[0], 0], points[basis[0], 1], -points[basis[0], 2]
    size = 0.0
    for i in range(count):
        apart = abs(points[i, 0] - out[0]) + abs(points[i, 1] - out[1])
        size = max(size, apart + abs(points[i, 2]))
    chosen = np.empty(4, dtype=np.int64)
    for _ in range(10 * count + 20):
        worst, value = _worst(points, count, out[0], out[1])
        if value <= out[2] + 4e-16 * size:
            break
        basis[n] = worst
        total = n + 1
        before, best, members_of_best = out[2], np.inf, 0
        for mask in range(1, 1 << total):
            members = 0
            for i in range(total):
                if mask >> i & 1:
                    if members < 3:
                        chosen[members] = basis[i]
                    members += 1
            if members > 3:
                continue
            i = chosen[0]
            if members == 1:
                tried[0], tried[1], tried[2] = points[i, 0], points[i, 1], -points[i, 2]
            elif members == 2:
                j = chosen[1]
                dx, dy = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
                apart = math.hypot(dx, dy)
                if apart <= abs(points[i, 2] - points[j, 2]):
                    continue
                tried[2] = 0.5 * (apart - points[i, 2] - points[j, 2])
                share = (tried[2] + points[i, 2]) / apart
                tried[0], tried[1] = points[i, 0] + share * dx, points[i, 1] + share * dy
            elif not _of_three(points, i, chosen[1], chosen[2], tried):
                continue
            if tried[2] >= best:
                continue
            allowed = True
            for k in range(total):
                b = basis[k]
                asks = math.hypot(points[b, 0] - tried[0], points[b, 1] - tried[1]) - points[b, 2]
                if asks > tried[2] + 1e-14 * size:
                    allowed = False
            if allowed:
                best, members_of_best = tried[2], mask
                out[0], out[1], out[2] = tried[0], tried[1], tried[2]
        if members_of_best == 0:
            break
        n = 0
        for i in range(total):
            if members_of_best >> i & 1:
                chosen[n] = basis[i]
                n += 1
        for i in range(n):
            basis[i] = chosen[i]
        # Each point that is added asks for more: round-off alone would go around in circles.
        if best <= before:
            break
    return n


@Loop
def _asks(waves: Any, angle: float, x: float, y: float, at: Any) -> Any:
    """What an instant asks of a position, with its first and second derivative by the angle."""
    motion_at(waves, angle, at)
    tx, ty = at[0, 0] - x, at[1, 0] - y
    size = math.hypot(tx, ty)
    if size == 0:
        return -at[2, 0], -at[2, 1], -at[2, 2]
    nx, ny = tx / size, ty / size
    along = at[0, 1] * nx + at[1, 1] * ny
    across = at[1, 1] * nx - at[0, 1] * ny
    bend = at[0, 2] * nx + at[1, 2] * ny + across * across / size - at[2, 2]
    return size - at[2, 0], along - at[2, 1], bend


@Loop
def _highest(waves: Any, left: float, right: float, x: float, y: float, at: Any) -> float:
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
def _polish(waves: Any, angles: Any, n: int, out: Any, at: Any) -> bool:
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
            length = math.hypot(tx, ty)
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
def resting_place(waves: Any, angles: Any, out: Any) -> int:
    """Write ``q*`` and ``m`` into ``out`` (3), the active instants [rad] into ``angles`` (3).

    The result is the number of active instants.
    """
    samples = 16 * waves.shape[2] + 16
    cell = 2 * math.pi / samples
    at = np.empty((3, 3))
    grid, points = np.empty((samples, 3)), np.empty((samples + 4, 3))
    instants = np.empty(samples + 4)
    asked = np.empty(samples)
    basis, kept = np.empty(4, dtype=np.int64), np.empty(3)
    trial, polished = np.empty(3), np.empty(3)
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
            asked[i] = math.hypot(grid[i, 0] - out[0], grid[i, 1] - out[1]) - grid[i, 2]
        count, largest = 0, -np.inf
        for i in range(samples):
            if asked[i] >= asked[i - 1] and asked[i] >= asked[(i + 1) % samples]:
                angle = _highest(waves, (i - 1) * cell, (i + 1) * cell, out[0], out[1], at)
                largest = max(largest, _asks(waves, angle, out[0], out[1], at)[0])
                motion_at(waves, angle, at)
                for k in range(3):
                    points[count, k] = at[k, 0]
                instants[count] = angle
                count += 1
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
            if _polish(waves, kept, n, polished, at):
                worst = -np.inf
                for i in range(samples):
                    value = math.hypot(grid[i, 0] - polished[0], grid[i, 1] - polished[1])
                    worst = max(worst, value - grid[i, 2])
                near = abs(polished[2] - out[2]) <= 1e-3 * size
                if near and worst <= polished[2] + 1e-14 * size:
                    for k in range(3):
                        angles[k], out[k] = kept[k], polished[k]
    return n


@Loop
def weights_of(waves: Any, angles: Any, n: int, place: Any, sides: Any) -> None:
    """Write of each active instant into ``sides`` (n, 8) what slopes need.

    ``n_x``, ``n_y``, the weight with which it counts, ``x' . n_perp``, the length of ``x - q``, the
    second derivative of what it asks by the angle (minus infinity where it has none).
    """
    at = np.empty((3, 3))
    size = 0.0
    for i in range(n):
        _, _, bend = _asks(waves, angles[i], place[0], place[1], at)
        tx, ty = at[0, 0] - place[0], at[1, 0] - place[1]
        length = math.hypot(tx, ty)
        nx, ny = (tx / length, ty / length) if length > 0 else (0.0, 0.0)
        sides[i, 0], sides[i, 1], sides[i, 2] = nx, ny, 1.0 / n
        sides[i, 3], sides[i, 4] = at[1, 1] * nx - at[0, 1] * ny, length
        size = max(size, length, math.hypot(at[0, 1], at[1, 1]))
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


def middle_of(samples: FloatArray) -> FloatArray:
    """Where a slider rests, (2,), of samples (3, n) over a period of ``x``, ``y`` and ``r``."""
    count = samples.shape[1]
    waves = np.fft.rfft(samples)[:, : count // 4] / count
    waves[:, 1:] *= 2
    place = np.empty(3)
    resting_place(np.stack([waves.real, -waves.imag], axis=1), np.empty(3), place)
    return place[:2]
