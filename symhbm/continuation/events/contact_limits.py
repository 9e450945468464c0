"""Points of a path and the events between them: contacts that reach their limit."""

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

_MAX_REFINEMENTS = 8
_PRECISION = 1e-8
"""Last step to a limit, relative to the response: its square is what the limit is off by."""
_SHARP = 0.1
"""Cosine of the angle by which a path has turned from which the parameter tells its direction."""
_FLAT = 1e-3
"""Part of a tangent along a way below which a cubic does not follow the path."""
_END = 1.0001
"""Share of a way up to which limits are taken to be on it."""


def first_limit(
    corrector: Corrector, base: PathPoint, over: Corrected, scale: FloatArray, orientation: int
) -> tuple[Corrected, NDArray[np.bool_]] | None:
    """Solve for the first limit crossed between ``base`` and ``over``.

    ``orientation`` is the sign of tangents along the path. Returns the solution and which contacts
    change state there (n_contacts,), None if the step has to be shorter for the limit to be told
    apart.
    """
    for _ in range(1 + len(base.slip_margin)):
        beyond = np.flatnonzero(crossed(over.slip_margin, base.slip)).tolist()
        for contact in beyond:
            first, last = base.slip_margin[contact], over.slip_margin[contact]
            # A contact that starts on its limit and is back beyond it slipped, or stuck, only for
            # a part of the step: its limit at the start is not the crossing to find.
            if not BEYOND < abs(first) < np.inf or first * last > 0:
                return None
        ahead = over if over.sign == orientation else over.turned()
        way = _Way(base, ahead, scale, corrector.curve.single_valued)
        share, contact = min((way.limit(contact), contact) for contact in beyond)
        limit = AtLimit(corrector.curve, contact, scale)
        landed = corrector.correct(way.state(share), scale, limit, base.slip, _PRECISION)
        if landed is None or not way.has(landed.point):
            return None
        if not landed.crosses:
            near = np.abs(landed.slip_margin) <= ON_LIMIT
            return landed, near & (base.slip == base.slip[contact])
        over = landed
    return None


class _Way:
    """The cubics of state and slip margin from a point to one beyond it, with the rates at both."""

    def __init__(
        self, base: PathPoint, over: Corrected, scale: FloatArray, single_valued: bool
    ) -> None:
        self._base, self._over, self._scale = base, over, scale
        chord = over.point - base.state
        begin, end = base.after / scale, over.direction
        normal = begin
        self._single_valued = single_valued
        if single_valued and normal.dot(end) < _SHARP:
            # Where a path turns back on itself, only the parameter tells how far along it one is.
            normal = np.copysign(unit_parameter(len(chord)), begin[-1])
        self._normal = normal
        self._length = float(normal.dot(chord / scale))
        speeds = float(normal.dot(begin)), float(normal.dot(end))
        self._slopes, self._steps = (chord, chord), None
        if min(speeds) >= _FLAT:
            first, last = self._steps = self._length / speeds[0], self._length / speeds[1]
            self._slopes = first * base.after, last * end * scale

    def has(self, point: FloatArray) -> bool:
        """Whether a point of the path lies on the way."""
        share = self._normal.dot((point - self._base.state) / self._scale) / self._length
        ahead = (point[-1] - self._base.value) * self._base.after[-1] > 0
        return bool(0 < share < _END and (ahead or not self._single_valued))

    def state(self, share: float) -> FloatArray:
        """The state at a share of the way."""
        return cubic(self._base.state, self._over.point, self._slopes, share)

    def limit(self, contact: int) -> float:
        """Share at which a contact first reaches its limit, on the other side of it at the end."""
        left, right = float(self._base.slip_margin[contact]), float(self._over.slip_margin[contact])
        slopes = right - left, right - left
        if self._steps is not None:
            first, last = self._steps
            rates = float(self._base.rate[contact]), float(self._over.rate[contact])
            slopes = first * rates[0], last * rates[1]
        return first_zero(left, right, slopes)


def brief_crossing(
    corrector: Corrector, base: PathPoint, found: Corrected, scale: FloatArray
) -> Corrected | None:
    """A point between two others where a contact is beyond its limit, None if there is none.

    The slip margin of each contact is a cubic between its values and rates at both ends; where that
    comes close to the limit, points are added at its top until it has crossed or has not.
    """
    outward = np.where(base.slip, -1.0, 1.0)
    left_rate, right_rate = outward * base.rate, outward * found.rate
    turning = (left_rate > 0) & (right_rate < 0)
    if not turning.any():
        return None
    normal, start = base.after / scale, base.state
    left_excess, right_excess = outward * base.slip_margin, outward * found.slip_margin
    right_rate = right_rate / max(float(np.dot(normal, found.direction)), 1e-3)
    length = float(np.dot(normal, (found.point - start) / scale))
    turning &= np.isfinite(left_excess) & np.isfinite(right_excess)
    # No cubic rises more than this above its ends.
    rise = 4 / 27 * length * (left_rate - right_rate)
    turning &= np.maximum(left_excess, right_excess) + 1.5 * rise >= -BEYOND
    for contact in np.flatnonzero(turning):
        left = 0.0, left_excess[contact], left_rate[contact]
        right = 1.0, right_excess[contact], right_rate[contact]
        for _ in range(_MAX_REFINEMENTS):
            width = right[0] - left[0]
            slopes = width * length * left[2], width * length * right[2]
            share, top = cubic_top(left[1], right[1], slopes)
            share = left[0] + width * share
            rise = top - max(left[1], right[1])
            if top < -0.5 * rise - BEYOND or rise <= 0:
                break
            guess = start + share * (found.point - start)
            plane = Hyperplane(start + share * length * base.after, scale, normal)
            middle = corrector.correct(guess, scale, plane, base.slip)
            if middle is None:
                break
            if crossed(middle.slip_margin, base.slip)[contact]:
                return middle
            slope = middle.rate / max(float(np.dot(normal, middle.direction)), 1e-3)
            slip_margin = float(outward[contact] * middle.slip_margin[contact])
            if not np.isfinite(slip_margin):
                break  # a contact that does not move but by round-off
            here = share, slip_margin, float(outward[contact] * slope[contact])
            left, right = (here, right) if here[2] > 0 else (left, here)
    return None
