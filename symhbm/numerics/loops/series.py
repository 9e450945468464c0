"""Loops over one truncated Fourier series: its values, its sign changes, its level crossings.

A series is two arrays, the coefficients of ``cos(h tau)`` and ``sin(h tau)`` for all ``h`` from 0
to the highest harmonic.
"""

import math

import numpy as np

from symhbm.numerics.machine_code import Loop

CELLS = 4
"""First cells per period of the highest harmonic: a multiple of four, see `on_grid`."""
CLOSEST = 1e-8
"""Width [rad] of a cell below which a pair of zeros does not count."""
_CLOSE = 1e-3
"""Angle [rad] times the highest harmonic up to which three terms of a power series are exact."""
_STEPS = 60
"""Most steps to a zero, each at least a bisection."""
_LAST_STEP = 1e-6
"""Last step to a zero [rad] times the highest harmonic: what is left is about its cube."""


@Loop
def at(cosine, sine, angle: float) -> tuple[float, float]:
    """Value and slope of a series at an angle [rad]."""
    turn_cosine, turn_sine = math.cos(angle), math.sin(angle)
    c, s, value, slope = 1.0, 0.0, 0.0, 0.0
    for h in range(len(cosine)):
        value += cosine[h] * c + sine[h] * s
        slope += h * (sine[h] * c - cosine[h] * s)
        c, s = c * turn_cosine - s * turn_sine, s * turn_cosine + c * turn_sine
    return value, slope


@Loop
def bent_at(cosine, sine, angle: float) -> tuple[float, float, float]:
    """Value, slope and second derivative of a series at an angle [rad]."""
    turn_cosine, turn_sine = math.cos(angle), math.sin(angle)
    c, s, value, slope, bend = 1.0, 0.0, 0.0, 0.0, 0.0
    for h in range(len(cosine)):
        wave = cosine[h] * c + sine[h] * s
        value += wave
        slope += h * (sine[h] * c - cosine[h] * s)
        bend -= h * h * wave
        c, s = c * turn_cosine - s * turn_sine, s * turn_cosine + c * turn_sine
    return value, slope, bend


@Loop
def derive(cosine, sine, of_cosine, of_sine) -> None:
    """Write the coefficients of the derivative of a series."""
    for h in range(len(cosine)):
        of_cosine[h], of_sine[h] = h * sine[h], -h * cosine[h]


@Loop
def on_grid(cosine, sine, values) -> None:
    """Write values and slopes (2, 4 n) of a series at equidistant angles of a period.

    Four angles that mirror each other in both axes share their cosines and sines.
    """
    n_angles = values.shape[1]
    half = n_angles // 2
    for i in range(n_angles // 4 + 1):
        angle = 2 * math.pi * i / n_angles
        turn_cosine, turn_sine = math.cos(angle), math.sin(angle)
        c, s = 1.0, 0.0
        even, even_turned, odd, odd_turned = 0.0, 0.0, 0.0, 0.0
        rate, rate_turned, odd_rate, odd_rate_turned = 0.0, 0.0, 0.0, 0.0
        for h in range(len(cosine)):
            if h % 2 == 0:
                even += cosine[h] * c
                even_turned += sine[h] * s
                rate += h * sine[h] * c
                rate_turned -= h * cosine[h] * s
            else:
                odd += cosine[h] * c
                odd_turned += sine[h] * s
                odd_rate += h * sine[h] * c
                odd_rate_turned -= h * cosine[h] * s
            c, s = c * turn_cosine - s * turn_sine, s * turn_cosine + c * turn_sine
        opposite, mirrored, last = i + half, half - i, n_angles - i if i else 0
        values[0, i] = even + odd + even_turned + odd_turned
        values[1, i] = rate + odd_rate + rate_turned + odd_rate_turned
        values[0, opposite] = even - odd + even_turned - odd_turned
        values[1, opposite] = rate - odd_rate + rate_turned - odd_rate_turned
        values[0, mirrored] = even - odd - even_turned + odd_turned
        values[1, mirrored] = rate - odd_rate - rate_turned + odd_rate_turned
        values[0, last] = even + odd - even_turned - odd_turned
        values[1, last] = rate + odd_rate - rate_turned - odd_rate_turned


@Loop
def crossing(cosine, sine, level: float, left: float, right: float, rises: bool) -> float:
    """Where a series passes a level between two angles, between which it is monotone."""
    low, low_slope = at(cosine, sine, left)
    high, high_slope = at(cosine, sine, right)
    low, high = low - level, high - level
    if low * high >= 0 and (low >= 0) == rises:
        return left
    root = 0.5 * (left + right)
    if low * high < 0:
        root = _start(left, right, low, low_slope, high, high_slope)
    return crossing_near(cosine, sine, level, left, right, root, rises)


@Loop
def _start(
    left: float, right: float, low: float, low_slope: float, high: float, high_slope: float
) -> float:
    """About where a monotone function is 0: the angle as a cubic of the value, or a secant."""
    rise, width = high - low, right - left
    share = -low / rise
    root = left + share * width
    if low_slope * high_slope > 0:
        rest = 1 - share
        bow = rest * (rise / low_slope - width) - share * (rise / high_slope - width)
        bent = root + share * rest * bow
        if left <= bent <= right:
            root = bent
    return root


@Loop
def crossing_near(
    cosine, sine, level: float, left: float, right: float, root: float, rises: bool
) -> float:
    """As `crossing`, from a ``root`` nearby: Halley's method, guarded."""
    last = _LAST_STEP / (len(cosine) - 1)
    for _ in range(_STEPS):
        value, slope, bend = bent_at(cosine, sine, root)
        value -= level
        if (value > 0) == rises:
            right = root
        else:
            left = root
        new = 0.5 * (left + right)
        near = False
        if slope != 0.0:
            newton = value / slope
            bow = 0.5 * newton * bend / slope
            # Where the slope changes by as much as itself, Newton's step is the safer one.
            halley = root - (newton / (1 - bow) if abs(bow) < 0.5 else newton)
            if left <= halley <= right:
                new, near = halley, abs(bow) < 1e-3
        step = abs(new - root)
        root = new
        if step <= 1e-15 * (1 + abs(root)) or (near and step <= last):
            break
    return root


@Loop
def gone(cosine, sine, start: float, way: float) -> float:
    """How far [rad] beyond a turning point a series has gone a ``way``, 0 where that is not close.

    Next to it differences of values are round-off, and few terms of a power series are exact.
    """
    highest = len(cosine) - 1
    turn_cosine, turn_sine = math.cos(start), math.sin(start)
    c, s, second, third, fourth = 1.0, 0.0, 0.0, 0.0, 0.0
    for h in range(highest + 1):
        wave = h * h * (cosine[h] * c + sine[h] * s)
        second -= wave
        third -= h * h * h * (sine[h] * c - cosine[h] * s)
        fourth += h * h * wave
        c, s = c * turn_cosine - s * turn_sine, s * turn_cosine + c * turn_sine
    if second * way <= 0.0:
        return 0.0
    first = math.sqrt(2 * way / second)
    skew, rest = third / (3 * second), fourth / (12 * second)
    if max(highest * first, abs(skew) * first, abs(rest) * first * first) > _CLOSE:
        return 0.0
    step = first
    for _ in range(3):
        step = first / math.sqrt(1 + step * (skew + step * rest))
    return step


@Loop
def _of_one_harmonic(cosine, sine, noise: float, half: bool, angles, rises) -> int:
    """As `sign_changes_in`, in closed form."""
    size, mean = np.hypot(cosine[1], sine[1]), cosine[0]
    if size - abs(mean) <= noise:
        return 0
    top = math.atan2(sine[1], cosine[1])
    wide = math.atan2(math.sqrt((size - mean) * (size + mean)), -mean)
    if 2 * min(wide, math.pi - wide) <= CLOSEST:
        return 0
    falls, rises_at = (top + wide) % (2 * math.pi), (top - wide) % (2 * math.pi)
    first = 0 if rises_at < falls else 1
    if half:
        angles[0], rises[0] = min(rises_at, falls), first == 0
        return 1
    angles[first], rises[first] = rises_at, True
    angles[1 - first], rises[1 - first] = falls, False
    return 2


@Loop
def put(
    stack,
    depth: int,
    left: float,
    right: float,
    first: float,
    first_slope: float,
    last: float,
    last_slope: float,
) -> None:
    """Write a cell: its ends, and values and slopes there."""
    stack[depth, 0], stack[depth, 1] = left, right
    stack[depth, 2], stack[depth, 3] = first, first_slope
    stack[depth, 4], stack[depth, 5] = last, last_slope


@Loop
def sign_changes(cosine, sine, noise: float, angles, rises) -> int:
    """Changes of sign of a series in ``[0, 2 pi)``, ascending; values up to ``noise`` are 0.

    They are written into ``angles`` [rad] and ``rises``, of twice the highest harmonic at least;
    the result is their number.
    """
    return sign_changes_in(cosine, sine, noise, False, angles, rises)


@Loop
def sign_changes_in(cosine, sine, noise: float, half: bool, angles, rises) -> int:
    """As `sign_changes`, or in ``[0, pi)`` of a series whose second half is minus the first.

    No series changes its sign more often than twice its highest harmonic: where more changes are
    seen they are round-off, and what counts as noise is raised until it covers them.
    """
    highest = len(cosine) - 1
    bound, size = 0.0, 0.0
    for h in range(highest + 1):
        amplitude = abs(cosine[h]) + abs(sine[h])
        size += amplitude
        bound += amplitude * float(h * h * h * h)
    if size <= noise:
        return 0
    if highest == 1:
        return _of_one_harmonic(cosine, sine, noise, half, angles, rises)
    ends = np.empty((2, CELLS * max(highest, 2)))
    on_grid(cosine, sine, ends)
    most = highest if half else 2 * highest
    count = _scan(cosine, sine, bound, noise, half, ends, most, angles, rises)
    while count > most:
        noise = max(8 * noise, 1e-16 * size)
        count = _scan(cosine, sine, bound, noise, half, ends, most, angles, rises)
    return _without_pairs(math.pi if half else 2 * math.pi, count, angles, rises)


@Loop
def _without_pairs(period: float, count: int, angles, rises) -> int:
    """Leave out neighbours closer than counts, whose order is that of round-off."""
    kept = 0
    for i in range(count):
        if kept and angles[i] - angles[kept - 1] <= CLOSEST:
            kept -= 1
        else:
            angles[kept], rises[kept] = angles[i], rises[i]
            kept += 1
    if kept > 1 and angles[0] + period - angles[kept - 1] <= CLOSEST:
        kept -= 2
        for i in range(kept):
            angles[i], rises[i] = angles[i + 1], rises[i + 1]
    return kept


@Loop
def _scan(
    cosine, sine, bound: float, noise: float, half: bool, ends, most: int, angles, rises
) -> int:
    """Sign changes from values and slopes (2, n) at the ends of cells, above ``most`` no more.

    On each cell a cubic through values and slopes at both ends, with the error that the ``bound``
    of the fourth derivative allows, tells that there is no zero or that the function is monotone,
    else the cell is halved: no pair of zeros is passed over unless it is closer than 1e-8 rad.
    A sign changes between two angles in a row whose values are more than noise.
    """
    cells = ends.shape[1]
    count = 0
    # The last angle whose sign is known, and the first: angle, value and slope.
    seen, seen_value, seen_slope = 0.0, ends[0, 0], ends[1, 0]
    origin, origin_value, origin_slope = seen, seen_value, seen_slope
    known = from_begin = abs(seen_value) > noise
    stack = np.empty((40, 6))
    for i in range(cells // 2 if half else cells):
        left, right = 2 * math.pi * i / cells, 2 * math.pi * (i + 1) / cells
        # The end of the last cell is the begin of the first, to the bit.
        after = (i + 1) % cells
        put(stack, 0, left, right, ends[0, i], ends[1, i], ends[0, after], ends[1, after])
        depth = 1
        while depth:
            depth -= 1
            left, right = stack[depth, 0], stack[depth, 1]
            first, first_slope = stack[depth, 2], stack[depth, 3]
            last, last_slope = stack[depth, 4], stack[depth, 5]
            width = right - left
            error = bound * (width * width) * (width * width) / 384 + noise
            # Coefficients of the cubic in the Bernstein basis bound it, and those of its slope.
            second, third = first + first_slope * width / 3, last - last_slope * width / 3
            lowest, largest = min(first, second, third, last), max(first, second, third, last)
            if lowest <= error and largest >= -error:
                steepest = bound * (width * width * width) / 96
                inner = 3 * (third - second) / width
                gentlest = min(first_slope, inner, last_slope)
                monotone = gentlest > steepest or max(first_slope, inner, last_slope) < -steepest
                if not monotone and width > CLOSEST and max(largest, -lowest) > noise:
                    middle = 0.5 * (left + right)
                    value, slope = at(cosine, sine, middle)
                    put(stack, depth, middle, right, value, slope, last, last_slope)
                    put(stack, depth + 1, left, middle, first, first_slope, value, slope)
                    depth += 2
                    continue
            if abs(last) <= noise:
                continue
            if not known:
                origin, origin_value, origin_slope, known = right, last, last_slope, True
            elif (last > 0) != (seen_value > 0):
                if count == most:
                    return most + 1
                start = _start(seen, right, seen_value, seen_slope, last, last_slope)
                angles[count] = crossing_near(cosine, sine, 0.0, seen, right, start, last > 0)
                rises[count] = last > 0
                count += 1
            seen, seen_value, seen_slope = right, last, last_slope
    if from_begin or not known:
        return count
    # On to the first angle whose sign is known, in the next period.
    period, sign = (math.pi, -1.0) if half else (2 * math.pi, 1.0)
    if (sign * origin_value > 0) != (seen_value > 0):
        if count == most:
            return most + 1
        right, last, last_slope = origin + period, sign * origin_value, sign * origin_slope
        start = _start(seen, right, seen_value, seen_slope, last, last_slope)
        angle, up = crossing_near(cosine, sine, 0.0, seen, right, start, last > 0), last > 0
        place = count
        if angle >= period:
            angle, up, place = angle - period, up != half, 0
            for k in range(count, 0, -1):
                angles[k], rises[k] = angles[k - 1], rises[k - 1]
        angles[place], rises[place] = angle, up
        count += 1
    return count
