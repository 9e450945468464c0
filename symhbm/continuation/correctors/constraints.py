"""Constraints that close the system of a path point: a hyperplane or a contact limit."""

import math
from typing import Any, NamedTuple, Protocol

import numpy as np

from symhbm.balance import Evaluation
from symhbm.continuation.problem import ContinuationProblem
from symhbm.numerics import FloatArray
from symhbm.numerics.loops import Loop

ON_LIMIT = 1e-9
"""Margin up to which contacts are on their limits, and change state together."""
BEYOND = 1e-11
"""Margin beyond which a contact is in the wrong state."""
ROUND_OFF = 1e-15
"""Error of a margin by those of the unknowns, relative to the sum of its terms by each of them."""


class Constraint(Protocol):
    """One equation in addition to those of the curve."""

    def __call__(self, point: FloatArray, evaluation: Evaluation) -> tuple[float, FloatArray]:
        """Value at (unknowns, parameter) and its gradient by these scaled, (n_unknowns + 1,)."""
        ...


class Hyperplane(NamedTuple):
    """The plane through ``anchor`` with the scaled ``normal``, all (n_unknowns + 1,)."""

    anchor: FloatArray
    scale: FloatArray
    normal: FloatArray

    def __call__(self, point: FloatArray, evaluation: Evaluation) -> tuple[float, FloatArray]:
        """Scaled distance from the plane, and its normal."""
        return float(np.dot(self.normal, (point - self.anchor) / self.scale)), self.normal


class AtLimit(NamedTuple):
    """The limit of one switch, numbered ``contact`` among those of all contacts."""

    curve: ContinuationProblem
    contact: int
    scale: FloatArray

    def __call__(self, point: FloatArray, evaluation: Evaluation) -> tuple[float, FloatArray]:
        """The margin of the switch, 0 where that is round-off, and its gradient."""
        row = self.curve.margin_gradient(evaluation, self.contact)
        margin = float(evaluation.states.margins[self.contact])
        known = abs(margin) > ROUND_OFF * float(np.dot(np.abs(row), np.abs(point)))
        return margin if known else 0.0, row * self.scale


class Corrected(NamedTuple):
    """A solution of the equations and a constraint.

    ``point`` (n_unknowns + 1,), the unknowns [m] and the parameter; ``direction``
    (n_unknowns + 1,), the unit tangent of the curve in scaled variables, along the gradient of
    the constraint; ``sign``, that of ``det [J; direction^T]`` up to a factor constant along the
    curve. ``error`` is the scaled distance from the guess; ``margins`` (n_switches,) the
    margins of the switches and ``rate`` (n_switches,) their derivatives along the direction;
    ``crosses`` tells whether one is beyond the limit of its held state;
    ``amplification`` is the largest inertia force over the largest exciting one;
    ``resonances_below`` counts the resonances below each harmonic of the frequency, None where they
    were not counted; ``springs`` are those of the contacts in this motion where they are known, as
    of `contact_springs`.
    """

    point: FloatArray
    direction: FloatArray
    sign: int
    residual_norm: float
    amplification: float
    error: float
    margins: FloatArray
    rate: FloatArray
    crosses: bool
    resonances_below: tuple[int, ...] | None
    springs: FloatArray | None = None

    def turned(self) -> "Corrected":
        """The same point with the opposite tangent."""
        return self._replace(direction=-self.direction, sign=-self.sign, rate=-self.rate)


@Loop
def crossed(margins: Any, switches: Any) -> Any:
    """Which switches are beyond the limit of their held state ``switches``, all (n_switches,)."""
    result = np.empty(len(margins), dtype=np.bool_)
    for i in range(len(margins)):
        outward = -margins[i] if switches[i] else margins[i]
        result[i] = BEYOND < outward < math.inf
    return result


def unit_parameter(size: int) -> FloatArray:
    """The unit vector of the parameter among ``size`` scaled variables."""
    vector = np.zeros(size)
    vector[-1] = 1.0
    return vector
