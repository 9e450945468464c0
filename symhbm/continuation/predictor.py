"""Cubic predictor through the last two points of a path and their tangents."""

import math
from typing import Any, NamedTuple

import numpy as np

from symhbm.continuation.point import PathPoint
from symhbm.numerics import FloatArray
from symhbm.numerics.loops import Loop


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
        if point.events:
            return cls.straight(len(point.state))
        result = cls(*np.empty((2, len(point.state))))
        between = before.state, before.after, point.state, point.after
        _through(*between, point.scale, *result)
        return result

    def at(self, point: PathPoint, length: float) -> FloatArray:
        """Unknowns and parameter at an arc length beyond the point."""
        result = np.empty(len(point.state))
        _at(point.state, point.after, self.second, self.third, length, result)
        return result


@Loop
def _at(state: Any, after: Any, second: Any, third: Any, length: float, result: Any) -> None:
    """Write the cubic at an arc length, from its value and derivatives."""
    for i in range(len(state)):
        curved = second[i] + length / 3 * third[i]
        result[i] = state[i] + length * (after[i] + length / 2 * curved)


@Loop
def _through(
    first: Any, leaving: Any, last: Any, arriving: Any, scale: Any, second: Any, third: Any
) -> None:
    """Write the ``second`` and ``third`` derivative at the ``last`` of two points.

    ``leaving`` and ``arriving`` are the tangents at the two points by their own arc lengths.
    """
    square_of_chord = square_of_tangent = square_of_turn = 0.0
    for i in range(len(scale)):
        square_of_chord += ((last[i] - first[i]) / scale[i]) ** 2
        square_of_tangent += (leaving[i] / scale[i]) ** 2
    if square_of_chord == 0.0:
        second[:] = third[:] = 0.0
        return
    size = math.sqrt(square_of_tangent)
    for i in range(len(scale)):
        square_of_turn += ((arriving[i] - leaving[i] / size) / scale[i]) ** 2
    # The arc of a circle whose tangent turns as much.
    length = math.sqrt(square_of_chord) * (1 + square_of_turn / 24)
    for i in range(len(scale)):
        tangent = leaving[i] / size
        mismatch = arriving[i] + tangent - 2 * (last[i] - first[i]) / length
        second[i] = (arriving[i] - tangent + 3 * mismatch) / length
        third[i] = 6 * mismatch / length**2
