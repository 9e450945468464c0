"""Interpolation between two points with known slopes: cubics, and the amplitude of a path.

Pictures draw this amplitude, and points of a path are dense enough for it.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from symhbm.numerics.arrays import FloatArray
from symhbm.numerics.loops import Loop, interpolation

cubic, cubic_top, first_zero = (
    interpolation.cubic,
    interpolation.cubic_top,
    interpolation.first_zero,
)


def amplitude_between(
    left: ArrayLike, right: ArrayLike, slopes: tuple[ArrayLike, ArrayLike], share: ArrayLike
) -> FloatArray:
    """Amplitude at a ``share`` of the way from one point to the next; all arguments broadcast.

    ``slopes`` are the derivatives by the share at both ends, infinite at a fold. The logarithm is
    cubic, which suits a resonance and its flanks. Between a fall and a rise the square is cubic, as
    for a motion that passes close to zero; next to a fold the amplitude follows the root.
    """
    each = np.broadcast_arrays(left, right, *slopes, share)
    result = np.empty(each[0].shape)
    _amplitudes(*(np.array(values, dtype=float).ravel() for values in each), result.reshape(-1))
    return result


@Loop
def _amplitudes(left: Any, right: Any, first: Any, last: Any, share: Any, result: Any) -> None:
    for i in range(len(result)):
        result[i] = interpolation.amplitude_at(left[i], right[i], first[i], last[i], share[i])
