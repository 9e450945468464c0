"""Small loops within a hysteresis loop, and where a contact just reaches its limit on one.

A contact whose motion reverses more than twice may stick from one turning point, where its force is
at a limit, to another, where it just reaches one: the limit on the other side, after a travel of
``2 mu F_n / k_d``, or the same again, as it is back where it was. Beyond it slips before it turns,
short of it it does not: there the force has a corner, as at the onset of slip.
"""

from dataclasses import dataclass, replace

import numpy as np

from symhbm.numerics import FloatArray, FourierBasis, turning_points

_NOTHING = 1e-12
"""Share of a motion that is nothing but round-off."""


@dataclass(frozen=True)
class Loop:
    """Stick of a ``contact`` between two turning points, at ``begin`` and ``end`` [rad].

    ``sides``: signs of the limit at which the force is at the begin, and which it just reaches.
    """

    contact: int
    begin: float
    end: float
    sides: tuple[int, int]

    @property
    def returns(self) -> bool:
        """Whether the force comes back to the same limit."""
        return self.sides[0] == self.sides[1]

    def on(self, basis: FourierBasis, motion: FloatArray) -> "Loop":
        """The same loop of a motion (n_components,) that is close to the one it was found on."""
        points = turning_points(basis, motion[None])
        angle = points.angle[0, : points.count[0]]
        begin, end = (float(angle[np.argmin(apart(angle, at))]) for at in (self.begin, self.end))
        return replace(self, begin=begin, end=end)


def images(basis: FourierBasis, motion: FloatArray) -> int:
    """How often a loop comes in a period: a motion (n_components,) may repeat, or mirror."""
    even = basis.order // basis.divisor % 2 == 0
    largest = np.abs(motion).max()
    mirrors = np.abs(motion[even]).max(initial=0.0) <= _NOTHING * largest
    return basis.divisor * (2 if mirrors else 1)


def apart(one: FloatArray, other: float) -> FloatArray:
    """Distance of angles on a circle [rad]."""
    return np.abs((one - other + np.pi) % (2 * np.pi) - np.pi)


def loops_near_limit(
    basis: FourierBasis, motion: FloatArray, contact: int, stiffness: float, limit: float
) -> list[tuple[float, Loop]]:
    """Loops of a contact that slips, each with the distance from its limit, relatively.

    ``motion`` (n_components,) [m]; each loop once, however often motions repeat or mirror.
    """
    points = turning_points(basis, motion[None])
    n = int(points.count[0])
    if n <= 2:
        return []
    angle, value = points.angle[0, :n], points.value[0, :n]
    force, start, side = limit, 0, 1
    result = []
    for k in range(n // images(basis, motion)):
        end = (k + 1) % n
        trial = force + stiffness * (value[end] - value[k])
        goal = 1 if trial > 0 else -1
        loop = Loop(contact, float(angle[start]), float(angle[end]), (side, goal))
        result.append((abs(abs(trial) / limit - 1), loop))
        force = float(np.clip(trial, -limit, limit))
        if abs(trial) > limit or end == points.lowest[0]:
            force, start, side = goal * limit, end, goal
    return result
