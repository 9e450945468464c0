"""The largest value of one truncated Fourier series, without its other turning points."""

import math
from typing import Any

import numpy as np

from symhbm.numerics.loops import series
from symhbm.numerics.loops.series import CELLS, CLOSEST
from symhbm.numerics.machine_code import Loop


@Loop
def largest(cosine: Any, sine: Any, both: bool) -> tuple[float, float]:
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
    cells = CELLS * (len(cosine) - 1)
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
                if first_slope <= 0 or last_slope >= 0 if concave else width <= CLOSEST:
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
