"""Error estimates for cubic interpolation between two points of a path, as loops.

The cubic through the two points before a segment, or the two after it, predicts the slope at the
far end of the segment. The difference from the actual slope measures the fourth derivative.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from symhbm.continuation.between.segments import Segments
from symhbm.continuation.segment import Measure, ahead
from symhbm.numerics import FloatArray
from symhbm.numerics.loops import Loop, interpolation

SAFETY_FACTOR = 8.0
"""Ratio by which the fourth derivative may exceed its estimate."""
_SLOPE_ERROR, _VALUE_ERROR = 0.0962, 1 / 32
"""Largest errors of slope and value of a cubic with a constant fourth derivative, over the result
of `extrapolation_error`."""
OF_SLOPE, OF_VALUE = SAFETY_FACTOR * _SLOPE_ERROR, SAFETY_FACTOR * _VALUE_ERROR
"""Error bounds of interpolated slopes per unit of length, and of values over the length, both over
the result of `extrapolation_error`."""
_LONE_SHARE = 0.5
"""Share of the third derivative's contribution taken as slope error where there is no neighbour."""
_MIN_ALIGNMENT = 0.3
"""Smallest cosine between the tangent of a neighbour and a segment for which its cubic is used."""

BEFORE, LEFT, RIGHT, AFTER = range(4)
"""Rows: the solution before a segment, those at both its ends, and the one after it."""
DISTANCE_BEFORE, DISTANCE_AFTER = 4, 5
"""Places of the distances between two solutions, behind the components of the four tangents."""


@Loop
def describe(
    states: tuple[Any, ...],
    directions: tuple[Any, ...],
    row: int,
    normal: Any,
    scale: Any,
    around: Any,
) -> None:
    """Write what `extrapolation_error` needs to know ``around`` (6,) one segment.

    The components of four tangents along its normal, and the distances from its ends to the
    solutions beside it, NaN where there is none or its tangent points elsewhere. ``states`` and
    ``directions`` are four arrays (n, n_unknowns + 1), NaN where there is no solution.
    """
    around[BEFORE] = ahead(directions[BEFORE][row], normal, scale)
    around[LEFT] = ahead(directions[LEFT][row], normal, scale)
    around[RIGHT] = ahead(directions[RIGHT][row], normal, scale)
    around[AFTER] = ahead(directions[AFTER][row], normal, scale)
    around[DISTANCE_BEFORE] = _distance(
        states[BEFORE][row], states[LEFT][row], directions[BEFORE][row], normal, scale
    )
    around[DISTANCE_AFTER] = _distance(
        states[RIGHT][row], states[AFTER][row], directions[AFTER][row], normal, scale
    )


@Loop
def _distance(first: Any, second: Any, direction: Any, normal: Any, scale: Any) -> float:
    """Distance of two solutions along a normal, NaN where a tangent leads elsewhere."""
    distance, along, size = 0.0, 0.0, 0.0
    for k in range(len(normal)):
        tangent = direction[k] / scale[k]
        distance += normal[k] * (second[k] - first[k]) / scale[k]
        along += normal[k] * tangent
        size += tangent**2
    valid = along > _MIN_ALIGNMENT * math.sqrt(size) and distance > 0
    return distance if valid else math.nan


@Loop
def extrapolation_error(
    around: Any,
    length: float,
    before: tuple[float, float],
    left: tuple[float, float],
    right: tuple[float, float],
    after: tuple[float, float],
) -> float:
    """Larger extrapolation error of both sides, scaled to the length of the segment.

    Of one quantity: its values at the four solutions, and its derivatives along their tangents.
    """
    first, last = left[1] / around[LEFT], right[1] / around[RIGHT]
    slope, far_slope = before[1] / around[BEFORE], -after[1] / around[AFTER]
    forward = _one_sided(
        around[DISTANCE_BEFORE], length, (before[0], slope), (left[0], first), last
    )
    backward = _one_sided(
        around[DISTANCE_AFTER], length, (after[0], far_slope), (right[0], -last), -first
    )
    if not math.isnan(forward):
        return forward if math.isnan(backward) else max(forward, backward)
    if not math.isnan(backward):
        return backward
    own_estimate = 1.5 * ((right[0] - left[0]) / length - (first + last) / 2)
    return _LONE_SHARE / OF_SLOPE * abs(own_estimate)


@Loop
def _one_sided(
    distance: float,
    length: float,
    neighbour: tuple[float, float],
    near: tuple[float, float],
    far_slope: float,
) -> float:
    """Scaled error of the slope at the far end, extrapolated from the near end and its neighbour.

    Those are values and slopes. NaN where there is no suitable neighbour.
    """
    slopes = distance * neighbour[1], distance * near[1]
    expected = (
        interpolation.cubic_slope_at(neighbour[0], near[0], slopes, 1 + length / distance)
        / distance
    )
    reach = length**2 / ((length + distance) * (2 * length + distance))
    return abs(reach * (far_slope - expected))


def errors_within(
    segments: Segments, measured: Measure, quantities: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """`extrapolation_error` (n, m) of ``quantities`` (.., m), linear in solutions (.., size)."""
    around = segments.before, segments.left, segments.right, segments.after
    states, directions = zip(*((at.state, at.direction) for at in around), strict=True)
    stacked = np.array([*states, *directions])
    found = quantities(stacked.reshape(-1, stacked.shape[-1])).reshape(*stacked.shape[:2], -1)
    of_each, error = tuple(np.ascontiguousarray(found)), np.empty(found.shape[1:])
    metric = measured.normal, measured.length, segments.scale
    write_errors(states, directions, of_each[:4], of_each[4:], *metric, error)
    return error


@Loop
def write_errors(
    states: tuple[Any, ...],
    directions: tuple[Any, ...],
    values: tuple[Any, ...],
    rates: tuple[Any, ...],
    normal: Any,
    length: Any,
    scale: Any,
    error: Any,
) -> None:
    """Write `extrapolation_error` (n, m) of quantities, whose four ``values`` and ``rates`` are so.

    ``states`` and ``directions`` are those of `describe`; ``normal`` and ``scale`` are
    (n, n_unknowns + 1), ``length`` (n, 1).
    """
    around = np.empty(6)
    for i in range(len(error)):
        describe(states, directions, i, normal[i], scale[i], around)
        distance = length[i, 0] if length[i, 0] != 0 else 1.0
        for k in range(error.shape[1]):
            error[i, k] = extrapolation_error(
                around,
                distance,
                (values[BEFORE][i, k], rates[BEFORE][i, k]),
                (values[LEFT][i, k], rates[LEFT][i, k]),
                (values[RIGHT][i, k], rates[RIGHT][i, k]),
                (values[AFTER][i, k], rates[AFTER][i, k]),
            )
