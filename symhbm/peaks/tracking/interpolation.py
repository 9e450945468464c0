"""Between two points of branches: where heights are equal, and points for interpolation."""

from bisect import bisect_left

import numpy as np
import scipy

from symhbm.peaks.conditions import Conditions
from symhbm.peaks.tracking.branches import Branch, Parameter

_NEWTON, _SOLVED = 8, 1e-9
"""Steps to where two heights are equal, and the last one, relative: convergence is quadratic."""
_CLOSE = 1e-5
"""How far, relative, cubic interpolation between two points may be off."""
_SHORT = 1e-7
"""Length below which no point is added."""
_DEEPEST = 6


def crossing(one: Branch, other: Branch, low: float, high: float) -> float | None:
    """Where a branch falls below another, both solved for; None where they are not.

    The lead changes around ``low`` to ``high``, as far as interpolated heights tell.
    """
    first, last = max(one.values[0], other.values[0]), min(one.values[-1], other.values[-1])
    if first >= last:
        return None
    low, high = (min(max(value, first), last) for value in (low, high))

    def lead(value: float) -> tuple[float, float]:
        found = [branch.at(value) for branch in (one, other)]
        solved = [conditions for conditions in found if conditions is not None]
        if len(solved) < 2:
            raise ArithmeticError
        heights = [c.summit.amplitude for c in solved]
        rates = [one.parameter.slope(c) / c.summit.amplitude for c in solved]
        return float(np.log(heights[0] / heights[1])), rates[0] - rates[1]

    try:
        value = _meeting(one, other, low, high)
        for _ in range(_NEWTON):
            height, rate = lead(value)
            step = -height / rate if rate < 0 else np.inf
            if not first <= value + step <= last or abs(step) > 2 * (high - low):
                break
            value += step
            if abs(step) <= _SOLVED * value:
                return value
        # Interpolated heights tell only about where it is.
        reach = 1e-6 * high
        while lead(low)[0] <= 0 and low > first:
            low, reach = max(low - reach, first), 4 * reach
        while lead(high)[0] >= 0 and high < last:
            high, reach = min(high + reach, last), 4 * reach
        if lead(low)[0] <= 0:
            return low
        if lead(high)[0] >= 0:
            return high
        return float(
            scipy.optimize.brentq(lambda value: lead(value)[0], low, high, xtol=1e-300, rtol=1e-15)  # type: ignore
        )
    except (ArithmeticError, ValueError):
        return None


def _meeting(one: Branch, other: Branch, low: float, high: float) -> float:
    """Where the interpolated heights of two branches are equal, or somewhere close."""

    def lead(value: float) -> float:
        there = np.array([value])
        return float((one.heights(there) - other.heights(there))[0])

    if lead(low) > 0 > lead(high):
        return float(scipy.optimize.brentq(lead, low, high))  # type: ignore
    return 0.5 * (low + high)


def fill(branch: Branch, start: float, end: float) -> None:
    """Add points wherever cubic interpolation between two would be too far off."""
    parameter, values = branch.parameter, branch.values
    inside = [i for i, value in enumerate(values) if start <= value <= end]
    pending = [(values[i], values[i + 1], 0) for i in inside[:-1] if i not in branch.joints]
    while pending:
        low, high, depth = pending.pop()
        ends = [branch.found[bisect_left(values, value)] for value in (low, high)]
        if depth > _DEEPEST or _deviation(parameter, low, high, *ends) <= _CLOSE:
            continue
        middle = parameter.value(low, high, 0.5)
        found = branch.at(middle)
        if found is not None:
            branch.insert(middle, found)
            pending += [(low, middle, depth + 1), (middle, high, depth + 1)]


def _deviation(
    parameter: Parameter, low: float, high: float, one: Conditions, other: Conditions
) -> float:
    """How far the cubic through two points is from the curve, in logarithms of heights.

    Second derivatives tell what a polynomial of fifth order would add in the middle.
    """
    length = float(parameter.measure(high) - parameter.measure(low))
    if length <= _SHORT:
        return 0.0
    rise = np.log(other.summit.amplitude / one.summit.amplitude)
    (left, bend), (right, turn) = (
        parameter.rates(value, found) for value, found in ((low, one), (high, other))
    )
    bend -= (6 * rise / length - 4 * left - 2 * right) / length
    turn -= (2 * left + 4 * right - 6 * rise / length) / length
    deviation = length**2 / 64 * (abs(bend) + abs(turn))
    return float(deviation) if np.isfinite(deviation) else np.inf
