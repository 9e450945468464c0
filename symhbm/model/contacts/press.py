"""Loops over what presses a contact: where it is closed, and margins with their derivatives.

The *variables* of a contact, that its forces are homogeneous in, are the coefficients of ``k_t u``,
direction by direction, then ``mu N0`` and the coefficients of ``mu k_n v``: (P). With them go
``N0`` and the coefficients of ``k_n v``, (1 + K), that its normal force is made of. A contact of
constant load has ``mu N0`` alone.
"""

import math
from typing import Any

import numpy as np

from symhbm.numerics.loops import Loop, fourier, series

SLIPS, OPENS, TOUCHES = range(3)
"""Switches of a contact: its margins."""
STICK_SHARE, OPEN_SHARE, MEAN, LEAST, LARGEST, SLIP_DISTANCE = range(6)
"""What a contact does over a period: shares of it, normal forces [N], path of the slider [m]."""
_DOUBLE = 1e-14
"""Relative size below which a smallest load is a zero: it opens for no time."""


@Loop
def extremes(waves, derivative_zeros, count: int) -> Any:
    """Largest and smallest value of a series, and where [rad], from the zeros of its derivative."""
    high, low = -np.inf, np.inf
    at_high, at_low = 0.0, 0.0
    for i in range(count):
        value = series.at(waves[0], waves[1], derivative_zeros[i])[0]
        if value > high:
            high, at_high = value, derivative_zeros[i]
        if value < low:
            low, at_low = value, derivative_zeros[i]
    if count == 0:
        high = low = series.at(waves[0], waves[1], 0.0)[0]
    return high, at_high, low, at_low


@Loop
def closed_intervals(press, turning, closed) -> int:
    """Write where the load is above zero [rad]; their number, -1 where it always is.

    Intervals (2, n) ascend, the first begins in ``[0, 2 pi)``; an interval ends after its begin.
    ``turning`` (2, 2) takes the smallest and the largest load with their angles.
    """
    highest, size = press.shape[1] - 1, 0.0
    for h in range(highest + 1):
        size += np.hypot(press[0, h], press[1, h])
    rate, zeros = np.empty((2, highest + 1)), np.empty(2 * highest)
    rises = np.empty(2 * highest, dtype=np.bool_)
    series.derive(press[0], press[1], rate[0], rate[1])
    count = series.sign_changes(rate[0], rate[1], 0.0, zeros, rises)
    high, at_high, low, at_low = extremes(press, zeros, count)
    turning[0, 0], turning[0, 1], turning[1, 0], turning[1, 1] = low, at_low, high, at_high
    tiny = _DOUBLE * size
    if low > tiny:
        return -1
    count = series.sign_changes(press[0], press[1], 0.0, zeros, rises) if low <= -tiny else 0
    if high <= tiny or (count == 0 and press[0, 0] < 0):
        return 0
    if count == 0:
        # It touches zero and is above it all the same.
        closed[0, 0], closed[1, 0] = at_low, at_low + 2 * math.pi
        return 1
    intervals = 0
    for i in range(count):
        if rises[i]:
            end = zeros[(i + 1) % count]
            closed[0, intervals] = zeros[i]
            closed[1, intervals] = end if end > zeros[i] else end + 2 * math.pi
            intervals += 1
    return intervals


@Loop
def variables_of(motion, values, load: int, variables) -> None:
    """Write the variables of a contact, of which ``load`` are coefficients of ``k_t u``.

    ``values`` (4) are ``k_t``, ``k_n``, ``mu`` and ``N0``.
    """
    size = len(motion) - load
    for i in range(load):
        variables[i] = values[0] * motion[i]
    variables[load] = values[2] * values[3]
    if size:
        variables[load + 1 + size] = values[3]
    for i in range(size):
        push = values[1] * motion[load + i]
        variables[load + 1 + i], variables[load + 2 + size + i] = values[2] * push, push


@Loop
def over_size(order, variables, load: int, value: float, slope) -> float:
    """A value over the size of variables, without means of motions; minus infinity without any.

    Of as many as ``slope`` has, which is that of the value and then of the result.
    """
    size, square, mean, by = len(order), 0.0, variables[load], np.zeros(len(slope))
    for j in range(len(slope)):
        component = (j if j < load else j - load - 1) % size
        if j != load and order[component] > 0:
            by[j] = variables[j]
            square += variables[j] * variables[j]
        elif j > load:
            mean += variables[j]
    by[load] = mean
    if len(slope) > load + 1 and order[0] == 0:
        by[load + 1] = mean
    scale = math.sqrt(square + mean * mean)
    for j in range(len(slope)):
        slope[j] = (slope[j] - value / scale * by[j] / scale) / scale if scale > 0 else 0.0
    return value / scale if scale > 0 else -np.inf


@Loop
def press_margins(order, is_sine, variables, normal: float, turning, margins, slopes) -> None:
    """Write the margins of opening and touch, the extremes of the load over its size.

    Of ``N0`` and the coefficients of ``k_n v`` behind the other ``variables``, by which their
    ``slopes`` (q, P + 1 + K) are written; ``normal`` is ``k_n``.
    """
    first = len(variables) - 1 - len(order)
    for k in range(2):
        sign, slope = 2.0 * k - 1.0, slopes[OPENS + k, first:]
        if normal == 0.0:
            margins[OPENS + k] = np.inf if (k == 1) == (variables[first] > 0) else -np.inf
            continue
        slope[0] = 1.0
        fourier.functions_at(order, is_sine, turning[k, 1], 0, slope[1:])
        for i in range(len(slope)):
            slope[i] *= sign
        value = sign * turning[k, 0]
        margins[OPENS + k] = over_size(order, variables[first:], 0, value, slope)


@Loop
def chained(motion, values, load: int, slopes, by_motion, by_values) -> None:
    """Write derivatives by motion (q, m K) and by ``k_t, k_n, mu, N0`` (q, 4) from ``slopes``.

    Those are by the variables, of which ``load`` are coefficients of ``k_t u``.
    """
    size, friction = len(motion) - load, values[2]
    by_values[:] = 0.0
    for k in range(len(slopes)):
        for i in range(load):
            by_motion[k, i] = values[0] * slopes[k, i]
            by_values[k, 0] += slopes[k, i] * motion[i]
        limit = slopes[k, load]
        by_values[k, 2], by_values[k, 3] = limit * values[3], friction * limit
        if size:
            by_values[k, 3] += slopes[k, load + 1 + size]
        for i in range(size):
            wall, push = slopes[k, load + 1 + i], motion[load + i]
            press = friction * wall + slopes[k, load + 2 + size + i]
            by_motion[k, load + i] = values[1] * press
            by_values[k, 1] += press * push
            by_values[k, 2] += values[1] * wall * push
