"""How far what is interpolated between two points of a path may be from the path.

The cubic through the two points before a stretch, or after it, tells what the far end of the
stretch should be like. As far as it is not like that, the path has more to it than a cubic.
"""

from typing import Any, NamedTuple

import numpy as np

from symhbm.continuation.segment import Measure, PathState, ahead
from symhbm.numerics import FloatArray, cubic_slope

CAUTION = 8.0
"""What the fourth derivative may be over that which the neighbours tell."""
_SLOPE, _VALUE = 0.0962, 1 / 32
"""Largest errors of the slope and the value of a cubic between its points, if its fourth derivative
is constant, over what is told by `unforeseen`."""
_BEND = 0.5
"""Part of the third derivative's share in a slope that is doubted where no neighbour tells."""
_AHEAD = 0.3
"""Part of a neighbour's tangent along a stretch from which it tells something of it."""


class Known(NamedTuple):
    """Quantities at a solution, or several, and their derivatives along its tangent, (..., n)."""

    station: PathState
    value: FloatArray
    rate: FloatArray

    def turned(self) -> "Known":
        """The same, looking the other way."""
        station = PathState(self.station.state, -self.station.direction)
        return Known(station, self.value, -self.rate)


def slope_errors(measured: Measure, scale: FloatArray, *known: Any) -> FloatArray:
    """Errors that interpolated slopes may have, by the length, (..., n).

    ``known``: before a stretch, at both its ends and after it, NaN where there is nothing or an
    event stands between.
    """
    return CAUTION * _SLOPE * _unforeseen(measured, scale, *known)


def value_errors(measured: Measure, scale: FloatArray, *known: Any) -> FloatArray:
    """Errors that interpolated values may have, (..., n); arguments as of `slope_errors`."""
    error = _unforeseen(measured, scale, *known)
    return CAUTION * _VALUE * np.abs(measured.length) * error


def _unforeseen(
    measured: Measure,
    scale: FloatArray,
    before: Known,
    left: Known,
    right: Known,
    after: Known,
) -> FloatArray:
    """Slopes at an end that neighbours do not foretell, weighed by how far these reach."""
    normal, length = measured.normal, np.where(measured.length == 0, 1.0, measured.length)
    onward = _not_foretold(normal, length, scale, before, left, right)
    back = _not_foretold(-normal, length, scale, after.turned(), right.turned(), left.turned())
    slopes = [each.rate / ahead(each.station, normal, scale) for each in (left, right)]
    alone = 1.5 * ((right.value - left.value) / length - (slopes[0] + slopes[1]) / 2)
    largest = np.fmax(np.abs(onward), np.abs(back))
    return np.where(np.isnan(largest), _BEND / (CAUTION * _SLOPE) * np.abs(alone), largest)


def _not_foretold(
    normal: FloatArray,
    length: FloatArray,
    scale: FloatArray,
    beyond: Known,
    near: Known,
    far: Known,
) -> FloatArray:
    """The same at the far end by what is beyond the near end, NaN where that tells nothing."""
    chord = (near.station.state - beyond.station.state) / scale
    distance = np.sum(normal * chord, axis=-1, keepdims=True)
    tangent = beyond.station.direction / scale
    along = np.sum(normal * tangent, axis=-1, keepdims=True)
    tells = along > _AHEAD * np.linalg.norm(tangent, axis=-1, keepdims=True)
    distance = np.where(tells & (distance > 0), distance, np.nan)
    slopes = [each.rate / ahead(each.station, normal, scale) for each in (beyond, near, far)]
    tangents = distance * slopes[0], distance * slopes[1]
    expected = cubic_slope(beyond.value, near.value, tangents, 1 + length / distance) / distance
    reach = length**2 / ((length + distance) * (2 * length + distance))
    return reach * (slopes[2] - expected)
