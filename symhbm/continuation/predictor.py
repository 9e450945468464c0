"""Cubic predictor through the last two points of a path and their tangents."""

from typing import NamedTuple

import numpy as np

from symhbm.continuation.point import PathPoint
from symhbm.numerics import FloatArray, length_of


class Predictor(NamedTuple):
    """``second`` and ``third`` derivative of a path by arc length at a point, (n_unknowns + 1,)."""

    second: FloatArray
    third: FloatArray

    @classmethod
    def straight(cls, size: int) -> "Predictor":
        """The tangent alone, for the first point of a path and for corners."""
        return cls(np.zeros(size), np.zeros(size))

    @classmethod
    def through(cls, before: PathPoint, point: PathPoint) -> "Predictor":
        """The predictor at a ``point``, from that point and the one ``before`` it."""
        chord = point.state - before.state
        distance = length_of(chord / point.scale)
        if point.events or distance == 0:
            return cls.straight(len(chord))
        tangent = before.after / length_of(before.after / point.scale)
        turn = point.after - tangent
        # The arc of a circle whose tangent turns as much.
        length = distance * (1 + np.sum((turn / point.scale) ** 2) / 24)
        mismatch = point.after + tangent - 2 * chord / length
        return cls((turn + 3 * mismatch) / length, 6 * mismatch / length**2)

    def at(self, point: PathPoint, length: float) -> FloatArray:
        """Unknowns and parameter at an arc length beyond the point."""
        return point.state + length * (
            point.after + length / 2 * (self.second + length / 3 * self.third)
        )
