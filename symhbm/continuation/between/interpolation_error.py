"""Error estimates for cubic interpolation between two points of a path.

The cubic through the two points before a segment, or the two after it, predicts the slope at the
far end of the segment. The difference from the actual slope measures the fourth derivative.
"""

from typing import Any, NamedTuple

import numpy as np

from symhbm.continuation.segment import Measure, PathState, ahead
from symhbm.numerics import FloatArray, cubic_slope

SAFETY_FACTOR = 8.0
"""Ratio by which the fourth derivative may exceed its estimate."""
_SLOPE_ERROR, _VALUE_ERROR = 0.0962, 1 / 32
"""Largest errors of slope and value of a cubic with a constant fourth derivative, over the result
of `_extrapolation_error`."""
_LONE_SHARE = 0.5
"""Share of the third derivative's contribution taken as slope error where there is no neighbour."""
_MIN_ALIGNMENT = 0.3
"""Smallest cosine between the tangent of a neighbour and a segment for which its cubic is used."""


class ValueAndRate(NamedTuple):
    """Quantities at one or several solutions, and their derivatives along the tangent, (..., n)."""

    path_state: PathState
    value: FloatArray
    rate: FloatArray

    def reversed(self) -> "ValueAndRate":
        """The same with the path run through backwards."""
        path_state = PathState(self.path_state.state, -self.path_state.direction)
        return ValueAndRate(path_state, self.value, -self.rate)


def slope_errors(measured: Measure, scale: FloatArray, *samples: Any) -> FloatArray:
    """Error bounds of interpolated slopes per unit of length, (..., n).

    ``samples`` are those before a segment, at both its ends and after it; NaN where there is none
    or an event lies between.
    """
    return SAFETY_FACTOR * _SLOPE_ERROR * _extrapolation_error(measured, scale, *samples)


def value_errors(measured: Measure, scale: FloatArray, *samples: Any) -> FloatArray:
    """Error bounds of interpolated values, (..., n); arguments as of `slope_errors`."""
    error = _extrapolation_error(measured, scale, *samples)
    return SAFETY_FACTOR * _VALUE_ERROR * np.abs(measured.length) * error


def _extrapolation_error(
    measured: Measure,
    scale: FloatArray,
    before: ValueAndRate,
    left: ValueAndRate,
    right: ValueAndRate,
    after: ValueAndRate,
) -> FloatArray:
    """Larger extrapolation error of both sides, scaled to the length of the segment."""
    normal, length = measured.normal, np.where(measured.length == 0, 1.0, measured.length)
    forward = _one_sided_error(normal, length, scale, before, left, right)
    backward = _one_sided_error(
        -normal, length, scale, after.reversed(), right.reversed(), left.reversed()
    )
    slopes = [sample.rate / ahead(sample.path_state, normal, scale) for sample in (left, right)]
    own_estimate = 1.5 * ((right.value - left.value) / length - (slopes[0] + slopes[1]) / 2)
    largest = np.fmax(np.abs(forward), np.abs(backward))
    return np.where(
        np.isnan(largest),
        _LONE_SHARE / (SAFETY_FACTOR * _SLOPE_ERROR) * np.abs(own_estimate),
        largest,
    )


def _one_sided_error(
    normal: FloatArray,
    length: FloatArray,
    scale: FloatArray,
    neighbour: ValueAndRate,
    near: ValueAndRate,
    far: ValueAndRate,
) -> FloatArray:
    """Scaled error of the slope at the far end, extrapolated from the near end and its neighbour.

    NaN where there is no suitable neighbour.
    """
    chord = (near.path_state.state - neighbour.path_state.state) / scale
    distance = np.sum(normal * chord, axis=-1, keepdims=True)
    tangent = neighbour.path_state.direction / scale
    along = np.sum(normal * tangent, axis=-1, keepdims=True)
    valid = along > _MIN_ALIGNMENT * np.linalg.norm(tangent, axis=-1, keepdims=True)
    distance = np.where(valid & (distance > 0), distance, np.nan)
    slopes = [
        sample.rate / ahead(sample.path_state, normal, scale) for sample in (neighbour, near, far)
    ]
    tangents = distance * slopes[0], distance * slopes[1]
    expected = cubic_slope(neighbour.value, near.value, tangents, 1 + length / distance) / distance
    reach = length**2 / ((length + distance) * (2 * length + distance))
    return reach * (slopes[2] - expected)
