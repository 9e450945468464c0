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
of `errors_within`."""
OF_SLOPE, OF_VALUE = SAFETY_FACTOR * _SLOPE_ERROR, SAFETY_FACTOR * _VALUE_ERROR
"""Error bounds of interpolated slopes per unit of length, and of values over the length, both over
the result of `errors_within`."""
_LONE_SHARE = 0.5
"""Share of the third derivative's contribution taken as slope error where there is no neighbour."""
_MIN_ALIGNMENT = 0.3
"""Smallest cosine between the tangent of a neighbour and a segment for which its cubic is used."""


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
    """Extrapolation errors (n, m) of ``quantities`` (.., m), linear in solutions (.., size).

    The larger one of both sides, scaled to the length of the segment.
    """
    around = segments.before, segments.left, segments.right, segments.after
    solutions = np.array([*(at.state for at in around), *(at.direction for at in around)])
    found = quantities(solutions.reshape(-1, solutions.shape[-1]))
    found = np.ascontiguousarray(found).reshape(*solutions.shape[:2], -1)
    error = np.empty(found.shape[1:])
    write_errors(solutions, found, measured.normal, measured.length, segments.scale, error)
    return error


@Loop
def write_errors(
    solutions: Any, quantities: Any, normal: Any, length: Any, scale: Any, error: Any
) -> None:
    """Write the `errors_within` (n, m) of segments.

    ``solutions`` (8, n, n_unknowns + 1) are the one before a segment, those at its ends and the one
    after it, then their tangents, NaN where there are none; so are the ``quantities`` (8, n, m)
    with their derivatives along the tangents. ``normal`` and ``scale`` are (n, n_unknowns + 1),
    ``length`` (n, 1).
    """
    along = np.empty(4)
    for i in range(len(error)):
        across, unit = normal[i], scale[i]
        for k in range(4):
            along[k] = ahead(solutions[4 + k, i], across, unit)
        left, right = solutions[1, i], solutions[2, i]
        to_before = _distance(solutions[0, i], left, solutions[4, i], across, unit)
        to_after = _distance(right, solutions[3, i], solutions[7, i], across, unit)
        width = length[i, 0] if length[i, 0] != 0 else 1.0
        for k in range(error.shape[1]):
            value, rate = quantities[:4, i, k], quantities[4:, i, k]
            first, last = rate[1] / along[1], rate[2] / along[2]
            before, after = rate[0] / along[0], -rate[3] / along[3]
            error[i, k] = _larger(
                _one_sided(to_before, width, (value[0], before), (value[1], first), last),
                _one_sided(to_after, width, (value[3], after), (value[2], -last), -first),
                1.5 * ((value[2] - value[1]) / width - (first + last) / 2),
            )


@Loop
def _larger(forward: float, backward: float, alone: float) -> float:
    """The larger one of both errors that are numbers, or that of a segment without neighbours."""
    if math.isnan(forward) and math.isnan(backward):
        return _LONE_SHARE / OF_SLOPE * abs(alone)
    if math.isnan(forward) or math.isnan(backward):
        return backward if math.isnan(forward) else forward
    return max(forward, backward)
