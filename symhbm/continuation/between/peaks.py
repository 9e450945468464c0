"""Peaks of the response over a path, solved for: smooth ones, corners and unbounded ones.

A peak is a local maximum over the path of the largest response of all degrees of freedom, or of
the response of each. It is *smooth* where the slope vanishes, a *corner* where slopes of opposite
sign meet at an onset or end of slip. A maximum at an end of the path is an edge, never a peak.

Between two points the path is known to third order; where that interpolant turns, or may turn by
as much as it may be wrong, points are added until every maximum stands between slopes of opposite
sign.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation.between.crests import FLAT, LocatedMaximum, PeakKind
from symhbm.continuation.between.divisions import Segments
from symhbm.continuation.between.maxima import Maxima
from symhbm.continuation.between.slopes import STILL, Slopes, amplitude_and_slope, leading
from symhbm.continuation.correctors import Corrector
from symhbm.continuation.newton import ACCEPTED
from symhbm.continuation.point import PathPoint
from symhbm.continuation.segment import PathState
from symhbm.numerics import FloatArray

_ONE_PLACE = 1e-11
"""Distance of two solutions, relative to the response, that round-off makes."""


@dataclass(frozen=True)
class Peak:
    """A peak: parameter ``value``, ``amplitude`` [m] of ``dof`` and the solution there."""

    value: float
    amplitude: float
    dof: int
    kind: PeakKind
    unknowns: FloatArray
    residual_norm: float


class Located(NamedTuple):
    """The peaks of a path, and the points of those ``between`` two points by the number before.

    ``lost`` counts maxima that could not be solved for; ``other_states`` has a value between two
    points at which a contact is in another state than at both: events were passed over, and
    nothing is told of that stretch.
    """

    peaks: list[Peak]
    between: dict[int, list[PathPoint]]
    lost: int
    other_states: dict[int, float]


def locate_peaks(
    points: list[PathPoint], corrector: Corrector, each: bool = False, regardless: bool = False
) -> Located:
    """Peaks between the first and the last of ``points``: of the largest or of each response.

    ``regardless`` of contacts that seem to be in another state in between.
    """
    if len(points) < 2:
        return Located([], {}, 0, {})
    found = _Peaks(corrector, each)
    problem = corrector.curve.problem
    state = np.array([point.state for point in points])
    before, after = (
        Slopes.of(problem, PathState(state, np.array([getattr(p, name) for p in points])))
        for name in ("before", "after")
    )
    for i, here in enumerate(points[1:-1], 1):
        if here.events:
            found.at_event(before[i], after[i])
    maxima = Maxima(corrector, each, regardless)
    crests = maxima.between(Segments.of(points, before, after))
    between = {}
    for i, several in crests.items():
        if i not in maxima.other_states:
            added = found.between(several, after[i], before[i + 1], points[i])
            if added is None:
                maxima.other_states[i] = float(several[0].at.state[-1])
            else:
                between[i] = added
    peaks = sorted(found.peaks, key=lambda peak: (each * peak.dof, peak.value))
    return Located(peaks, between, maxima.lost, maxima.other_states)


def unbounded_peak(problem: HarmonicBalance, point: PathPoint, direction: FloatArray) -> Peak:
    """The pole that a path climbs, from its last point and the tangent there.

    The response is ``1/(pole - value)``.
    """
    amplitude, slope = amplitude_and_slope(problem, point.unknowns, direction[:-1])
    dof = leading(amplitude)
    value = point.value + float(amplitude[dof] / slope[dof] * direction[-1])
    nothing = np.full_like(point.unknowns, np.nan)
    return Peak(value, np.inf, dof, PeakKind.UNBOUNDED, nothing, np.nan)


class _Peaks:
    def __init__(self, corrector: Corrector, each: bool):
        self.curve = corrector.curve
        self.corrector = corrector
        self.each = each
        self.peaks: list[Peak] = []

    def at_event(self, left: Slopes, right: Slopes) -> None:
        """Add those of an event where the slopes before and after it tell of one."""
        level = np.maximum(np.abs(left.slope), np.abs(right.slope))
        corner = np.minimum(left.slope, -right.slope) > FLAT * level
        corner &= level > STILL * left.amplitude
        if not self.each:
            corner &= np.arange(len(corner)) == leading(left.amplitude)
        if corner.any():
            self._add(left, np.flatnonzero(corner).tolist(), PeakKind.CORNER)

    def between(
        self, crests: list[LocatedMaximum], left: Slopes, right: Slopes, here: PathPoint
    ) -> list[PathPoint] | None:
        """Add maxima between a point and the next, and return those points that are no others.

        None, and none of them, where contacts are not in the states they were held in on the way.
        """
        norms = [self._norm(crest.at) for crest in crests]
        if max(norms, default=0.0) > ACCEPTED:
            return None
        points: list[PathPoint] = []
        last = left
        for crest in crests:
            at = next((s for s in (last, right) if self._is_one_place(crest.at, s)), crest.at)
            self._add(at, crest.dofs, crest.kind)
            if at is not crest.at:
                continue
            before, scale = self.corrector.solves, self.curve.scale(at.state)
            found = self.corrector.tangent(at.state, scale, at.direction / scale, here.slip)
            if found is not None:
                solves = crest.solves + self.corrector.solves - before
                points.append(PathPoint.of(self.curve, found, scale, here.slip, solves))
                last = at
        return points

    def _is_one_place(self, at: Slopes, other: Slopes) -> bool:
        """Whether two solutions are one to round-off; of those of two responses one is kept."""
        apart = np.linalg.norm((at.state - other.state) / self.curve.scale(other.state))
        same_value = self.curve.single_valued and at.state[-1] == other.state[-1]
        return bool(apart <= _ONE_PLACE or same_value)

    def _add(self, at: Slopes, dofs: Iterable[int], kind: PeakKind) -> None:
        """Add one solution as the peak of some responses."""
        unknowns, value, norm = at.state[:-1], float(at.state[-1]), self._norm(at)
        for dof in dofs:
            self.peaks.append(Peak(value, float(at.amplitude[dof]), dof, kind, unknowns, norm))

    def _norm(self, at: Slopes) -> float:
        """Residual with all contacts free."""
        return self.curve.evaluate(at.state[:-1], float(at.state[-1])).norm
