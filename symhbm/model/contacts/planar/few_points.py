"""The position that a few points of a motion ask least of: one, two or three of them determine it.

A point at ``x`` whose limit is ``r`` asks ``|x - q| - r`` of a position ``q``.
"""

import math
from typing import Any

import numpy as np

from symhbm.numerics.loops import Loop


@Loop
def _worst(points, count: int, x: float, y: float) -> Any:
    """Which of the points (n, 3) of ``x``, ``y`` and ``r`` asks most, and how much."""
    at, largest = 0, -np.inf
    for i in range(count):
        value = np.hypot(points[i, 0] - x, points[i, 1] - y) - points[i, 2]
        if value > largest:
            at, largest = i, value
    return at, largest


@Loop
def _of_three(points, i: int, j: int, k: int, out) -> bool:
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
def smallest_of(points, count: int, basis, out) -> int:
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
        # Round-off is that of the coordinates, however close to each other the points are.
        size = max(size, abs(points[i, 0]) + abs(points[i, 1]) + abs(points[i, 2]))
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
                apart = np.hypot(dx, dy)
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
                asks = np.hypot(points[b, 0] - tried[0], points[b, 1] - tried[1]) - points[b, 2]
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
