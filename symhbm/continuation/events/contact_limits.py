"""Contact limits on a path: the points at which contacts begin or end to slip."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors import (
    BEYOND,
    ON_LIMIT,
    AtLimit,
    Corrected,
    Corrector,
    Hyperplane,
    crossed,
    unit_parameter,
)
from symhbm.continuation.point import PathPoint
from symhbm.numerics import FloatArray, cubic, cubic_top, first_zero
from symhbm.numerics.loops import Loop

_MAX_REFINEMENTS = 8
_PRECISION = 1e-8
"""Last step to a limit, relative to the response: the error of the limit is its square."""
_SHARP = 0.1
"""Cosine of the angle between both tangents below which the parameter measures the step."""
_FLAT = 1e-3
"""Component of a tangent along a step below which a cubic does not follow the path."""
_LARGEST_SHARE = 1.0001
"""Largest share of a step at which a limit lies on the step, above 1 by round-off."""


def first_limit(
    corrector: Corrector,
    base: PathPoint,
    past_limit: Corrected,
    scale: FloatArray,
    orientation: int,
) -> tuple[Corrected, NDArray[np.bool_]] | None:
    """Solve for the first limit crossed between ``base`` and ``past_limit``.

    ``orientation`` is the sign of tangents along the path. Returns the solution and which switches
    change state there (n_switches,), None if limits can be told apart only over a shorter step.
    """
    for _ in range(1 + len(base.margins)):
        contacts = np.flatnonzero(crossed(past_limit.margins, base.switches)).tolist()
        for contact in contacts:
            first, last = base.margins[contact], past_limit.margins[contact]
            # A contact that starts on its limit and is beyond it again slipped, or stuck, for a
            # part of the step only: the limit at the start is not the one to solve for.
            if not BEYOND < abs(first) < np.inf or first * last > 0:
                return None
        ahead = past_limit if past_limit.sign == orientation else past_limit.turned()
        step = _StepCubic(base, ahead, scale, corrector.curve.single_valued)
        share, contact = min((step.limit(contact), contact) for contact in contacts)
        limit = AtLimit(corrector.curve, contact, scale)
        solution = corrector.correct(step.state(share), scale, limit, base.switches, _PRECISION)
        if solution is None or not step.contains(solution.point):
            return None
        if not solution.crosses:
            at_limit = np.abs(solution.margins) <= ON_LIMIT
            return solution, at_limit & (base.switches == base.switches[contact])
        past_limit = solution
    return None


class _StepCubic:
    """Cubics of state and slip margins over one step, from their values and rates at both ends."""

    def __init__(
        self, base: PathPoint, ahead: Corrected, scale: FloatArray, single_valued: bool
    ) -> None:
        self._base, self._ahead, self._scale = base, ahead, scale
        chord = ahead.point - base.state
        tangent, tangent_ahead = base.after / scale, ahead.direction
        normal = tangent
        self._single_valued = single_valued
        if single_valued and normal.dot(tangent_ahead) < _SHARP:
            # Along a path that turns back on itself, only the parameter increases throughout.
            normal = np.copysign(unit_parameter(len(chord)), tangent[-1])
        self._normal = normal
        self._length = float(normal.dot(chord / scale))
        advances = float(normal.dot(tangent)), float(normal.dot(tangent_ahead))
        self._slopes, self._steps = (chord, chord), None
        if min(advances) >= _FLAT:
            first, last = self._steps = self._length / advances[0], self._length / advances[1]
            self._slopes = first * base.after, last * tangent_ahead * scale

    def contains(self, point: FloatArray) -> bool:
        """Whether a point of the path lies within the step."""
        share = self._normal.dot((point - self._base.state) / self._scale) / self._length
        forward = (point[-1] - self._base.value) * self._base.after[-1] > 0
        return bool(0 < share < _LARGEST_SHARE and (forward or not self._single_valued))

    def state(self, share: float) -> FloatArray:
        """The state at a share of the step."""
        return cubic(self._base.state, self._ahead.point, self._slopes, share)

    def limit(self, contact: int) -> float:
        """Share of the step at which a contact, beyond its limit at the end, first reaches it."""
        margins = self._base.margins, self._ahead.margins
        start, end = (float(margin[contact]) for margin in margins)
        slopes = end - start, end - start
        if self._steps is not None:
            first, last = self._steps
            rates = float(self._base.rate[contact]), float(self._ahead.rate[contact])
            slopes = first * rates[0], last * rates[1]
        return first_zero(start, end, slopes)


def brief_crossing(
    corrector: Corrector, base: PathPoint, ahead: Corrected, scale: FloatArray
) -> Corrected | None:
    """A point within a step at which a contact is beyond its limit, None if there is none.

    The slip margin of each contact is a cubic from its values and rates at both ends. Where its
    maximum comes close to the limit, points are added there until the crossing is decided.
    """
    turning = np.empty(len(base.switches), dtype=np.int64)
    of_base = base.state, base.after, base.switches, base.margins, base.rate
    of_ahead = ahead.point, ahead.direction, ahead.margins, ahead.rate
    count, length, advance = _turning(*of_base, *of_ahead, scale, turning)
    if not count:
        return None
    normal, start = base.after / scale, base.state
    outward = np.where(base.switches, -1.0, 1.0)
    for contact in turning[:count].tolist():
        sign = outward[contact]
        left = 0.0, float(sign * base.margins[contact]), float(sign * base.rate[contact])
        rate = float(sign * ahead.rate[contact] / advance)
        right = 1.0, float(sign * ahead.margins[contact]), rate
        for _ in range(_MAX_REFINEMENTS):
            width = right[0] - left[0]
            slopes = width * length * left[2], width * length * right[2]
            share, maximum = cubic_top(left[1], right[1], slopes)
            share = left[0] + width * share
            rise = maximum - max(left[1], right[1])
            if maximum < -0.5 * rise - BEYOND or rise <= 0:
                break
            guess = start + share * (ahead.point - start)
            plane = Hyperplane(start + share * length * base.after, scale, normal)
            solution = corrector.correct(guess, scale, plane, base.switches)
            if solution is None:
                break
            if crossed(solution.margins, base.switches)[contact]:
                return solution
            slope = solution.rate / max(float(np.dot(normal, solution.direction)), 1e-3)
            margins = float(outward[contact] * solution.margins[contact])
            if not np.isfinite(margins):
                break  # a contact that moves by round-off only
            inner = share, margins, float(outward[contact] * slope[contact])
            left, right = (inner, right) if inner[2] > 0 else (left, inner)
    return None


@Loop
def _turning(
    start: Any,
    after: Any,
    switches: Any,
    margins: Any,
    rate: Any,
    end: Any,
    direction: Any,
    margins_ahead: Any,
    rate_ahead: Any,
    scale: Any,
    turning: Any,
) -> Any:
    """Contacts whose margins may pass their limits within a step from ``start`` to ``end``.

    Their numbers are written into ``turning``. Returns how many they are, the length of the step
    and how far the path at its end goes along it.
    """
    length = advance = 0.0
    for i in range(len(start)):
        length += after[i] / scale[i] * ((end[i] - start[i]) / scale[i])
        advance += after[i] / scale[i] * direction[i]
    advance = max(advance, 1e-3)
    count = 0
    for contact in range(len(switches)):
        outward = -1.0 if switches[contact] else 1.0
        rises, falls = outward * rate[contact], outward * rate_ahead[contact]
        highest = max(outward * margins[contact], outward * margins_ahead[contact])
        known = math.isfinite(margins[contact]) and math.isfinite(margins_ahead[contact])
        # No cubic rises more than this above its ends.
        rise = 4 / 27 * length * (rises - falls / advance)
        if rises > 0 and falls < 0 and known and highest + 1.5 * rise >= -BEYOND:
            turning[count] = contact
            count += 1
    return count, length, advance
