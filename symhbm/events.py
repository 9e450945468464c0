"""Points of a path and the events between them: contacts that reach their limit."""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.constraints import BEYOND, ON_LIMIT, AtLimit, Corrected, Hyperplane, crossed
from symhbm.corrector import Corrector
from symhbm.curve import Curve
from symhbm.fourier import FloatArray
from symhbm.hermite import cubic
from symhbm.linear import length_of

_SHARES = np.linspace(0, 1, 17)
_MAX_REFINEMENTS = 8


class EventKind(StrEnum):
    """What happens at an event."""

    ONSET = "onset of slip"
    END = "end of slip"
    FOLD = "fold"


@dataclass(frozen=True)
class Event:
    """Change of state of one ``contact``, or a fold of the path (contact -1)."""

    kind: EventKind
    contact: int = -1


def state_changes(before: NDArray[np.bool_], after: NDArray[np.bool_]) -> tuple[Event, ...]:
    """The changes between two sets of contact states (n_contacts,)."""
    return tuple(
        Event(EventKind.ONSET if after[j] else EventKind.END, int(j))
        for j in np.flatnonzero(before != after)
    )


class PathPoint(NamedTuple):
    """A converged point of a path.

    ``state`` (n_unknowns + 1,), unknowns [m] and parameter, and ``scale``, what measures lengths
    there; ``before`` and ``after`` (n_unknowns + 1,), its derivatives by the local arc length on
    either side, equal except at an event; ``slip`` (n_contacts,), the contact states after the
    point; ``excess`` (n_contacts,), the logarithm of the motion over its limit, and ``rate``
    (n_contacts,), its derivative by arc length after the point; ``amplification`` and ``below`` as
    of `Corrected`; ``solves``, the linear solves spent since the point before.
    """

    state: FloatArray
    scale: FloatArray
    before: FloatArray
    after: FloatArray
    slip: NDArray[np.bool_]
    excess: FloatArray
    rate: FloatArray
    residual_norm: float
    amplification: float
    below: int | None
    solves: int
    events: tuple[Event, ...] = ()

    @classmethod
    def of(
        cls,
        curve: Curve,
        found: Corrected,
        scale: FloatArray,
        slip: NDArray[np.bool_],
        solves: int,
        events: tuple[Event, ...] = (),
        beyond: Corrected | None = None,
    ) -> "PathPoint":
        """A point from a solution in a ``scale``.

        ``beyond`` is that with the tangent after it where that is another.
        """
        beyond = beyond or found
        here = curve.scale(found.point)
        ratio = scale / here
        length = length_of(beyond.direction * ratio)
        after = beyond.direction * scale / length
        before = after
        if beyond is not found:
            before = found.direction * scale / length_of(found.direction * ratio)
        return cls(
            state=found.point,
            scale=here,
            before=before,
            after=after,
            slip=slip,
            excess=found.excess,
            rate=beyond.rate / length,
            residual_norm=found.residual_norm,
            amplification=found.amplification,
            below=beyond.below,
            solves=solves,
            events=events,
        )

    @property
    def unknowns(self) -> FloatArray:
        """The coefficients, ``(n_unknowns,)`` [m]."""
        return self.state[:-1]

    @property
    def value(self) -> float:
        """The parameter."""
        return float(self.state[-1])


def first_limit(
    corrector: Corrector, base: PathPoint, over: Corrected, scale: FloatArray
) -> tuple[Corrected, NDArray[np.bool_]] | None:
    """Solve for the first limit crossed between ``base`` and ``over``.

    Returns the solution and which contacts change state there (n_contacts,), None if the step has
    to be shorter for the limit to be told apart.
    """
    start = base.state
    along = np.dot((over.point - start) / scale, base.after / scale)
    for _ in range(1 + len(base.excess)):
        beyond = crossed(over.excess, base.slip)
        high = over.excess
        share = np.full(len(base.excess), np.inf)
        share[beyond] = base.excess[beyond] / (base.excess[beyond] - high[beyond])
        contact = int(np.argmin(share))
        # A contact that starts on its limit and is back beyond it slipped, or stuck, only for
        # a part of the step: its limit at the start is not the crossing to find.
        if not 0 < share[contact] <= 1 or abs(base.excess[contact]) <= BEYOND:
            return None
        landed = corrector.correct(
            start + share[contact] * (over.point - start),
            scale,
            AtLimit(corrector.curve, contact, scale),
            base.slip,
        )
        if landed is None:
            return None
        progress = np.dot((landed.point - start) / scale, base.after / scale) / along
        if not 0 < progress < 1.0001:
            return None
        if not landed.crosses:
            near = np.abs(landed.excess) <= ON_LIMIT
            return landed, near & (base.slip == base.slip[contact])
        over = landed
    return None


def brief_crossing(
    corrector: Corrector, base: PathPoint, found: Corrected, scale: FloatArray
) -> Corrected | None:
    """A point between two others where a contact is beyond its limit, None if there is none.

    The excess of each contact is a cubic between its values and rates at both ends; where that
    comes close to the limit, points are added at its top until it has crossed or has not.
    """
    outward = np.where(base.slip, -1.0, 1.0)
    left_rate, right_rate = outward * base.rate, outward * found.rate
    turning = (left_rate > 0) & (right_rate < 0)
    if not turning.any():
        return None
    normal, start = base.after / scale, base.state
    left_excess, right_excess = outward * base.excess, outward * found.excess
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
            share, top = _top_of_cubic(left, right, length)
            rise = top - max(left[1], right[1])
            if top < -0.5 * rise - BEYOND or rise <= 0:
                break
            guess = start + share * (found.point - start)
            plane = Hyperplane(start + share * length * base.after, scale, normal)
            middle = corrector.correct(guess, scale, plane, base.slip)
            if middle is None:
                break
            if crossed(middle.excess, base.slip)[contact]:
                return middle
            slope = middle.rate / max(float(np.dot(normal, middle.direction)), 1e-3)
            excess = float(outward[contact] * middle.excess[contact])
            if not np.isfinite(excess):
                break  # a contact that does not move but by round-off
            here = share, excess, float(outward[contact] * slope[contact])
            left, right = (here, right) if here[2] > 0 else (left, here)
    return None


def _top_of_cubic(left: tuple, right: tuple, length: float) -> tuple[float, float]:
    """Where the cubic through (share, value, rate) at both ends is largest, and how large."""
    width = right[0] - left[0]
    h = _SHARES
    values = cubic(left[1], right[1], (width * length * left[2], width * length * right[2]), h)
    at = int(np.argmax(values))
    if 0 < at < len(h) - 1:
        # The vertex of the parabola through the three largest.
        below, top, above = values[at - 1 : at + 2]
        bend = below - 2 * top + above
        shift = 0.5 * (below - above) / bend if bend < 0 else 0.0
        return left[0] + width * float(h[at] + shift * (h[1] - h[0])), float(top)
    return left[0] + width * float(h[at]), float(values[at])
