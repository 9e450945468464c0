"""Crossings of two branches of maxima, and points added for interpolation."""

from bisect import bisect_left

import numpy as np

from symhbm.numerics import bracketed_root
from symhbm.peaks.conditions import Conditions
from symhbm.peaks.tracking.branches import MaximumBranch, Parameter

_INTERPOLATION = 1e-5
"""Error allowed to cubic interpolation between two points: that which `peak_curve` promises."""
_INTERPOLATION_DEPTH = 6
"""Halvings of an interval: the error of a cubic falls sixteenfold with each."""
SHORTEST_INTERVAL = 1e-7
"""Length of an interval that holds no further point or event: derivatives over it are round-off of
solved values."""
_CROSSING_STEPS, _CROSSING_PRECISION = 8, 1e-9
"""Newton steps to a crossing, and the last of them: convergence is quadratic, so that its error is
round-off."""


def crossing(
    falling: MaximumBranch, rising: MaximumBranch, low: float, high: float
) -> float | None:
    """The value where one branch falls below another, both solved for; None without convergence.

    ``low`` and ``high`` enclose the crossing of the interpolated heights.
    """
    first = max(falling.values[0], rising.values[0])
    last = min(falling.values[-1], rising.values[-1])
    if first >= last:
        return None
    low, high = (min(max(value, first), last) for value in (low, high))

    def lead(value: float) -> tuple[float, float]:
        before, after = falling.at(value), rising.at(value)
        if before is None or after is None:
            raise ArithmeticError
        log_ratio = np.log(before.maximum.amplitude / after.maximum.amplitude)
        rates = [falling.parameter.slope(c) / c.maximum.amplitude for c in (before, after)]
        return float(log_ratio), rates[0] - rates[1]

    try:
        value = _estimated_crossing(falling, rising, low, high)
        for _ in range(_CROSSING_STEPS):
            log_ratio, rate = lead(value)
            step = -log_ratio / rate if rate < 0 else np.inf
            if not first <= value + step <= last or abs(step) > 2 * (high - low):
                break
            value += step
            if abs(step) <= _CROSSING_PRECISION * value:
                return value
        # Interpolated heights enclose the crossing only approximately: widen the interval.
        margin = 1e-6 * high
        while lead(low)[0] <= 0 and low > first:
            low, margin = max(low - margin, first), 4 * margin
        while lead(high)[0] >= 0 and high < last:
            high, margin = min(high + margin, last), 4 * margin
        if lead(low)[0] <= 0:
            return low
        if lead(high)[0] >= 0:
            return high
        return bracketed_root(lambda value: lead(value)[0], low, high, precision=1e-15)
    except (ArithmeticError, ValueError):
        return None


def _estimated_crossing(
    falling: MaximumBranch, rising: MaximumBranch, low: float, high: float
) -> float:
    """The value where interpolated heights are equal, or the middle of the interval."""

    def lead(value: float) -> float:
        at_value = np.array([value])
        return float((falling.heights(at_value) - rising.heights(at_value))[0])

    if lead(low) > 0 > lead(high):
        return bracketed_root(lead, low, high)
    return 0.5 * (low + high)


def fill(branch: MaximumBranch, start: float, end: float) -> None:
    """Add points to a branch until cubic interpolation is accurate."""
    parameter, values = branch.parameter, branch.values
    numbers = [i for i, value in enumerate(values) if start <= value <= end]
    pending = [(values[i], values[i + 1], 0) for i in numbers[:-1] if branch.event_after(i) is None]
    while pending:
        low, high, depth = pending.pop()
        maxima = [branch.conditions[bisect_left(values, value)] for value in (low, high)]
        accurate = _deviation(parameter, low, high, *maxima) <= _INTERPOLATION
        if accurate or depth > _INTERPOLATION_DEPTH:
            continue
        middle = parameter.value(low, high, 0.5)
        solved = branch.at(middle)
        if solved is not None:
            branch.insert(middle, solved)
            pending += [(low, middle, depth + 1), (middle, high, depth + 1)]


def _deviation(
    parameter: Parameter, low: float, high: float, first: Conditions, last: Conditions
) -> float:
    """Error of the cubic between two points, in logarithms of heights.

    Second derivatives give the correction that a polynomial of fifth order makes in the middle.
    """
    length = float(parameter.coordinate(high) - parameter.coordinate(low))
    if length <= SHORTEST_INTERVAL:
        return 0.0
    rise = np.log(last.maximum.amplitude / first.maximum.amplitude)
    (low_rate, low_curvature), (high_rate, high_curvature) = (
        parameter.rates(value, maximum) for value, maximum in ((low, first), (high, last))
    )
    low_curvature -= (6 * rise / length - 4 * low_rate - 2 * high_rate) / length
    high_curvature -= (2 * low_rate + 4 * high_rate - 6 * rise / length) / length
    deviation = length**2 / 64 * (abs(low_curvature) + abs(high_curvature))
    return float(deviation) if np.isfinite(deviation) else np.inf
