"""Loops over motions as Fourier series: the functions of their basis, and where they turn.

A basis is given by its orders, and by which of its components are sines.
"""

import math

import numpy as np

from symhbm.numerics.loops import series
from symhbm.numerics.machine_code import Loop

_ROUND_OFF = 4e-15
"""Error [rad] of the length of a period."""


@Loop
def as_series(order, is_sine, coefficients, cosine, sine) -> None:
    """Write coefficients (K) as a series, see `symhbm.numerics.loops.series`."""
    for h in range(len(cosine)):
        cosine[h] = sine[h] = 0.0
    for i in range(len(order)):
        if is_sine[i]:
            sine[order[i]] = coefficients[i]
        else:
            cosine[order[i]] = coefficients[i]


@Loop
def functions_at(order, is_sine, angle: float, derivative: int, row) -> None:
    """Write the basis functions at an angle [rad], or a derivative of them, into a row (K)."""
    turn_cosine, turn_sine = math.cos(angle), math.sin(angle)
    c, s, h = 1.0, 0.0, 0
    for i in range(len(order)):
        n = order[i]
        while h < n:
            c, s = c * turn_cosine - s * turn_sine, s * turn_cosine + c * turn_sine
            h += 1
        # Each derivative turns a wave by a quarter; a sine is a cosine turned back by one.
        quarter = (derivative - (1 if is_sine[i] else 0)) % 4
        wave = c if quarter % 2 == 0 else s
        sign = 1.0 if quarter == 0 or quarter == 3 else -1.0
        row[i] = sign * wave * n**derivative


@Loop
def moments(begin: float, end: float, result) -> None:
    """Write integrals of ``cos(k tau)`` and ``sin(k tau)`` over an interval into (2, 2 H + 1)."""
    half, middle = 0.5 * (end - begin), 0.5 * (begin + end)
    turn, shift = (math.cos(middle), math.sin(middle)), (math.cos(half), math.sin(half))
    result[0, 0], result[1, 0] = end - begin, 0.0
    if abs(end - begin - 2 * math.pi) < _ROUND_OFF:
        # A constant has no harmonics over a period: those by round-off may exceed a small motion.
        result[0, 0], shift = 2 * math.pi, (-1.0, 0.0)
    cosine, sine = turn
    half_cosine, half_sine = shift
    # Sines of the half width, and no differences: short intervals keep their digits.
    for k in range(1, result.shape[1]):
        size = 2 * half_sine / k
        result[0, k], result[1, k] = size * cosine, size * sine
        cosine, sine = cosine * turn[0] - sine * turn[1], sine * turn[0] + cosine * turn[1]
        half_cosine, half_sine = (
            half_cosine * shift[0] - half_sine * shift[1],
            half_sine * shift[0] + half_cosine * shift[1],
        )


@Loop
def add_products(sums, order, is_sine, norm, out) -> None:
    """Add the matrix that restricts a series to what the moments ``sums`` are of, transposed."""
    size = len(order)
    for i in range(size):
        for j in range(size):
            p, q = order[i], order[j]
            difference, total = abs(p - q), p + q
            if is_sine[i] and is_sine[j]:
                value = sums[0, difference] - sums[0, total]
            elif is_sine[i] or is_sine[j]:
                # sin(a) cos(b) = [sin(a + b) + sin(a - b)] / 2
                turn = p - q if is_sine[i] else q - p
                value = sums[1, total] + (sums[1, difference] if turn > 0 else -sums[1, difference])
            else:
                value = sums[0, difference] + sums[0, total]
            out[j, i] += 0.5 * norm[i] * value


DONE, NOT_FINITE, NOT_APART = range(3)
"""What came out: all points, coefficients that are no numbers, no two turning points."""
_SMALL, _LARGE = 1e-100, 1e100
"""Bounds of coefficients whose products neither vanish nor overflow."""


@Loop
def turning_points(cosine, sine, mirrors: bool, angle, value) -> tuple[int, int, int]:
    """Write where a series turns over one period [rad], ascending from its maximum, and its values.

    ``angle`` and ``value`` take twice the highest harmonic. ``mirrors`` tells that its second half
    is minus the first. Results are what came out, how many they are, and which is the minimum.
    A constant has none, and its value is written.
    """
    highest = len(cosine) - 1
    largest = 0.0
    for h in range(highest + 1):
        if not (math.isfinite(cosine[h]) and math.isfinite(sine[h])):
            return NOT_FINITE, 0, 0
        if h:
            largest = max(largest, abs(cosine[h]), abs(sine[h]))
    if largest == 0.0:
        angle[0], value[0] = 0.0, cosine[0]
        return DONE, 0, 0
    scale = 1.0 if _SMALL < largest < _LARGE else largest
    rate, rises = np.empty((2, highest + 1)), np.empty(2 * highest, dtype=np.bool_)
    for h in range(highest + 1):
        rate[0, h], rate[1, h] = h * (sine[h] / scale), -h * (cosine[h] / scale)
    found = np.empty((2, 2 * highest))
    count = series.sign_changes_in(rate[0], rate[1], 0.0, mirrors, found[0], rises)
    if count == 0 or (count % 2 == 1) != mirrors:
        return NOT_APART, 0, 0
    for i in range(count):
        found[1, i] = series.at(cosine, sine, found[0, i])[0]
    if mirrors:
        for i in range(count):
            found[0, count + i], found[1, count + i] = found[0, i] + math.pi, -found[1, i]
        count *= 2
    start, lowest = 0, 0
    for i in range(count):
        if found[1, i] > found[1, start]:
            start = i
    for i in range(count):
        source = start + i
        again = 0.0
        if source >= count:
            source -= count
            again = 2 * math.pi
        angle[i], value[i] = found[0, source] + again, found[1, source]
        if value[i] < value[lowest]:
            lowest = i
    return DONE, count, count // 2 if mirrors else lowest


@Loop
def turning_points_of(order, is_sine, mirrors: bool, motions, angle, value, counts, lowest) -> int:
    """Write the `turning_points` of motions (n, K), the last one again behind them.

    ``angle`` and ``value`` are (n, 2 H), ``counts`` and ``lowest`` (n,).
    """
    waves = np.empty((2, order[len(order) - 1] + 1))
    for j in range(len(motions)):
        as_series(order, is_sine, motions[j], waves[0], waves[1])
        status, count, low = turning_points(waves[0], waves[1], mirrors, angle[j], value[j])
        if status != DONE:
            return status
        counts[j], lowest[j] = count, low
        for i in range(max(count, 1), angle.shape[1]):
            angle[j, i], value[j, i] = angle[j, i - 1], value[j, i - 1]
    return DONE


@Loop
def largest(cosine, sine, both: bool) -> tuple[float, float]:
    """Largest value of a series, or magnitude of ``both`` signs, and its angle in [0, 2 pi].

    A cell of the period is left out where the cubic through values and slopes at its ends, with the
    error that the fourth derivative allows, stays below the largest value so far. Others are halved
    until the series is concave: its slope then has one zero.
    """
    if len(cosine) == 2:
        top = math.atan2(sine[1], cosine[1])
        size = np.hypot(cosine[1], sine[1])
        if both and cosine[0] < 0:
            return size - cosine[0], (top + math.pi) % (2 * math.pi)
        return size + cosine[0], top % (2 * math.pi)
    cells = series.CELLS * (len(cosine) - 1)
    bound = 0.0
    for h in range(len(cosine)):
        bound += (abs(cosine[h]) + abs(sine[h])) * float(h * h * h * h)
    ends, rate = np.empty((2, cells)), np.empty((2, len(cosine)))
    series.on_grid(cosine, sine, ends)
    series.derive(cosine, sine, rate[0], rate[1])
    start, sign = 0, 1.0
    for i in range(cells):
        for side in (1.0, -1.0):
            if (both or side > 0) and side * ends[0, i] > sign * ends[0, start]:
                start, sign = i, side
    best, angle = sign * ends[0, start], 2 * math.pi * start / cells
    stack = np.empty((40, 6))
    for side in range(2 if both else 1):
        sign = sign if side == 0 else -sign
        for k in range(cells):
            # Cells in turn on both sides of the largest value of the grid: it is likely there.
            i = (start + (k // 2 if k % 2 == 0 else -(k + 1) // 2)) % cells
            after = (i + 1) % cells
            series.put(
                stack, 0, 2 * math.pi * i / cells, 2 * math.pi * (i + 1) / cells,
                sign * ends[0, i], sign * ends[1, i], sign * ends[0, after], sign * ends[1, after],
            )  # fmt: skip
            depth = 1
            while depth:
                depth -= 1
                left, right = stack[depth, 0], stack[depth, 1]
                first, first_slope = stack[depth, 2], stack[depth, 3]
                last, last_slope = stack[depth, 4], stack[depth, 5]
                width = right - left
                error = bound * (width * width) * (width * width) / 384
                second, third = first + first_slope * width / 3, last - last_slope * width / 3
                if max(first, second, third, last) + error <= best:
                    continue
                # Second derivatives of the cubic at both ends bound that of the series.
                mean = 3 * (last - first) / width
                bend = max(mean - 2 * first_slope - last_slope, first_slope + 2 * last_slope - mean)
                concave = 2 * bend / width + bound * (width * width) / 12 < 0
                if first_slope <= 0 or last_slope >= 0 if concave else width <= series.CLOSEST:
                    continue
                middle = 0.5 * (left + right)
                if concave:
                    root = left + width * first_slope / (first_slope - last_slope)
                    middle = series.crossing_near(
                        rate[0], rate[1], 0.0, left, right, root, sign < 0
                    )
                value, slope = series.at(cosine, sine, middle)
                value, slope = sign * value, sign * slope
                if value > best:
                    best, angle = value, middle
                if not concave:
                    series.put(stack, depth, middle, right, value, slope, last, last_slope)
                    series.put(stack, depth + 1, left, middle, first, first_slope, value, slope)
                    depth += 2
    return best, angle


@Loop
def largest_of(order, is_sine, both: bool, motions, size, angle) -> int:
    """Write the `largest` magnitudes (n,) of motions (n, K), and where they are [rad]."""
    waves = np.empty((2, order[len(order) - 1] + 1))
    for j in range(len(motions)):
        for i in range(len(order)):
            if not math.isfinite(motions[j, i]):
                return NOT_FINITE
        as_series(order, is_sine, motions[j], waves[0], waves[1])
        size[j], angle[j] = largest(waves[0], waves[1], both)
    return DONE
