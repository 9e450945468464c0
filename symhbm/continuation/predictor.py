"""Where a path goes on: the cubic through its last two points and their tangents."""

from typing import NamedTuple

import numpy as np

from symhbm.continuation.point import PathPoint
from symhbm.numerics import FloatArray, length_of


class Predictor(NamedTuple):
    """Second and third derivative of a path by the arc length at a point, (n_unknowns + 1,)."""

    bend: FloatArray
    twist: FloatArray

    @classmethod
    def straight(cls, size: int) -> "Predictor":
        """That of a point without a past, as the first one and those beyond a corner."""
        return cls(np.zeros(size), np.zeros(size))

    @classmethod
    def through(cls, before: PathPoint, here: PathPoint) -> "Predictor":
        """At a point, from that before it."""
        chord = here.state - before.state
        distance = length_of(chord / here.scale)
        if here.events or distance == 0:
            return cls.straight(len(chord))
        tangent = before.after / length_of(before.after / here.scale)
        turn = here.after - tangent
        # The arc of a circle whose tangent turns as much.
        length = distance * (1 + np.sum((turn / here.scale) ** 2) / 24)
        slip_margin = here.after + tangent - 2 * chord / length
        return cls((turn + 3 * slip_margin) / length, 6 * slip_margin / length**2)

    def at(self, here: PathPoint, length: float) -> FloatArray:
        """Unknowns and parameter at an arc length beyond the point."""
        return here.state + length * (
            here.after + length / 2 * (self.bend + length / 3 * self.twist)
        )
