"""How far the slopes between two points of a path may be from what is interpolated.

The cubic through the two points before a stretch, or after it, tells what the far end of the
stretch should be like. As far as it is not like that, the path has more to it than a cubic.
"""

import numpy as np

from symhbm.fourier import FloatArray
from symhbm.hermite import cubic_slope
from symhbm.stations import Measure, Station, along

_INSIDE = 0.0962
"""A cubic's largest error of the slope between its points, over h^2 / ((h + a) (2 h + a)) and that
of the slope at ``h`` beyond points ``a`` apart, where the fourth derivative is constant."""
_CAUTION = 16.0
"""What the fourth derivative may be over that which the neighbours tell."""
_BEND = 0.5
"""Part of the third derivative's share in a slope that is doubted where no neighbour tells."""
_AHEAD = 0.3
"""Part of a neighbour's tangent along a stretch from which it tells something of it."""


def doubt(
    measured: Measure,
    left: Station,
    right: Station,
    scale: FloatArray,
    before: Station,
    after: Station,
    n_components: int,
) -> FloatArray:
    """Error of interpolated slopes of each degree of freedom, by the length, (..., n_dof).

    ``before`` and ``after`` are the points next to the stretches, NaN where there are none or an
    event stands between.
    """
    normal, length = measured.normal, np.where(measured.length == 0, 1.0, measured.length)
    ends = along(left, normal, scale), along(right, normal, scale)
    bend = 1.5 * ((right.state - left.state) / length - (ends[0] + ends[1]) / 2)
    found = [
        _unexpected(normal, length, left, ends[1], scale, before),
        _unexpected(-normal, length, _turned(right), -ends[0], scale, _turned(after)),
    ]
    told = np.isfinite(found).any(axis=(0, -1))[..., None]
    errors = [_of_each(error, n_components) for error in found]
    return np.where(told, np.fmax(errors[0], errors[1]), _BEND * _of_each(bend, n_components))


def _unexpected(
    normal: FloatArray,
    length: FloatArray,
    near: Station,
    slope: FloatArray,
    scale: FloatArray,
    beyond: Station,
) -> FloatArray:
    """What the slope at a far end tells of errors in between, NaN where a neighbour tells nothing.

    ``slope`` is that at the far end; ``beyond``, the point on the other side of the near end.
    """
    distance = np.sum(normal * (near.state - beyond.state) / scale, axis=-1, keepdims=True)
    ahead = np.sum(normal * beyond.direction / scale, axis=-1, keepdims=True)
    size = np.linalg.norm(beyond.direction / scale, axis=-1, keepdims=True)
    tells = (distance > 0) & (ahead > _AHEAD * size)
    distance = np.where(tells, distance, np.nan)
    tangents = tuple(distance * along(station, normal, scale) for station in (beyond, near))
    share = 1 + length / distance
    expected = cubic_slope(beyond.state, near.state, tangents, share) / distance
    weight = _INSIDE * length**2 / ((length + distance) * (2 * length + distance))
    return _CAUTION * weight * (slope - expected)


def _turned(station: Station) -> Station:
    return Station(station.state, -station.direction)


def _of_each(error: FloatArray, n_components: int) -> FloatArray:
    parts = error[..., :-1].reshape(*error.shape[:-1], -1, n_components)
    return np.linalg.norm(parts, axis=-1)
