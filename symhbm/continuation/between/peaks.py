"""Peaks of the response along a path: smooth ones, corners and unbounded ones.

A peak is a local maximum along the path of the largest response of all degrees of freedom, or of
the response of each. It is *smooth* where the slope vanishes, a *corner* where slopes of opposite
sign meet at an onset or end of slip. A maximum at an end of the path is an edge, not a peak.

States and tangents give a cubic between two points. Where its slope changes sign, or may do so
within the interpolation error, points are added until every maximum lies between slopes of
opposite sign.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation.between.goal_peaks import goal_peaks
from symhbm.continuation.between.maxima import CORNER_JUMP, LocatedMaximum, Maxima
from symhbm.continuation.between.missed_events import MissedEvents
from symhbm.continuation.between.segments import Segments
from symhbm.continuation.between.slopes import (
    FLAT_SLOPE,
    Peak,
    PeakKind,
    Slopes,
    amplitude_and_slope,
    leading,
)
from symhbm.continuation.correctors import Corrector
from symhbm.continuation.newton import ACCEPTED
from symhbm.continuation.point import PathPoint
from symhbm.continuation.problem import Corrected
from symhbm.continuation.segment import PathState
from symhbm.numerics import FloatArray

_SAME_SOLUTION = 1e-11
"""Distance of two solutions, relative to the response, that round-off explains."""


class LocatedPeaks(NamedTuple):
    """The peaks of a path, and their points ``between`` two path points by the index of the first.

    ``lost`` counts maxima that could not be solved for. ``other_states`` holds a parameter value
    where a contact is in another state than at both neighbouring points: events were missed, and
    no peaks are given for that segment.
    """

    peaks: list[Peak]
    between: dict[int, list[PathPoint]]
    lost: int
    other_states: dict[int, float]


def locate_peaks(
    points: list[PathPoint],
    corrector: Corrector,
    per_dof: bool = False,
    ignore_states: bool = False,
) -> LocatedPeaks:
    """Peaks between the first and the last of ``points``: of the largest response, or ``per_dof``.

    ``ignore_states`` accepts contacts that seem to be in another state in between. Of a curve that
    is not ``peaked`` they are all that is looked for.
    """
    if len(points) < 2:
        return LocatedPeaks([], {}, 0, {})
    peak_list = _PeakList(corrector, per_dof)
    problem = corrector.curve.problem
    maxima, segments = Maxima(corrector, per_dof, ignore_states), Segments.of(points)
    if not ignore_states:
        missed = MissedEvents(points, corrector)
        segments = missed.settled(segments)
        maxima.other_states |= missed.other_states
    if not corrector.curve.peaked:
        return LocatedPeaks([], {}, 0, maxima.other_states)
    state = np.array([point.state for point in points])
    before, after = (
        Slopes.of(problem, PathState(state, np.array([getattr(p, name) for p in points])))
        for name in ("before", "after")
    )
    peak_list.at_events(points, before, after)
    located = maxima.between(segments)
    between = {}
    for i, maxima_between in located.items():
        if i not in maxima.other_states:
            inner_points = peak_list.between(maxima_between, after[i], before[i + 1], points[i])
            if inner_points is None:
                maxima.other_states[i] = float(maxima_between[0].at.state[-1])
            else:
                between[i] = inner_points
    peaks = sorted(peak_list.peaks, key=lambda peak: (per_dof * peak.dof, peak.value))
    if problem.goal is not None:
        found = goal_peaks(problem.goal, points, corrector, maxima.other_states)
        return LocatedPeaks(found[0], between, found[1], maxima.other_states)
    return LocatedPeaks(peaks, between, maxima.lost, maxima.other_states)


def unbounded_peak(problem: HarmonicBalance, point: PathPoint, direction: FloatArray) -> Peak:
    """The pole of an unbounded response, extrapolated from the last point and its tangent.

    The response is proportional to ``1/(pole - value)``.
    """
    amplitude, slope = amplitude_and_slope(problem, point.unknowns, direction[:-1])
    dof = leading(amplitude)
    value = point.value + float(amplitude[dof] / slope[dof] * direction[-1])
    unknown = np.full_like(point.unknowns, np.nan)
    return Peak(value, np.inf, dof, PeakKind.UNBOUNDED, unknown, np.nan)


class _PeakList:
    """The peaks of one path."""

    def __init__(self, corrector: Corrector, per_dof: bool):
        self.curve = corrector.curve
        self.per_dof = per_dof
        self.peaks: list[Peak] = []

    def at_events(self, points: list[PathPoint], before: Slopes, after: Slopes) -> None:
        """Add the corners at events, where slopes change from positive to negative."""
        scale = np.maximum(np.abs(before.slope), np.abs(after.slope))
        corner = np.minimum(before.slope, -after.slope) > CORNER_JUMP * scale
        corner &= scale > FLAT_SLOPE * before.amplitude
        for i in np.flatnonzero(corner[1:-1].any(axis=1)) + 1:
            dofs = np.flatnonzero(corner[i])
            if not self.per_dof:
                dofs = dofs[dofs == leading(before.amplitude[i])]
            if points[i].events:
                self._add(before[i], dofs.tolist(), PeakKind.CORNER, points[i].residual_norm)

    def between(
        self, maxima: list[LocatedMaximum], left: Slopes, right: Slopes, point: PathPoint
    ) -> list[PathPoint] | None:
        """Add maxima between a point and the next; return the new path points.

        None, and no maximum added, where a contact leaves the state it was held in.
        """
        norms = [self._norm(maximum.solution) for maximum in maxima]
        if max(norms, default=0.0) > ACCEPTED:
            return None
        points: list[PathPoint] = []
        previous = left
        for maximum, norm in zip(maxima, norms, strict=True):
            at = next(
                (s for s in (previous, right) if self._is_same_solution(maximum.at, s)), maximum.at
            )
            self._add(at, maximum.dofs, maximum.kind, norm)
            if at is maximum.at:
                solution, scale = maximum.solution, maximum.scale
                given = point.switches, maximum.solves
                points.append(PathPoint.of(self.curve, solution, scale, *given))
                previous = at
        return points

    def _is_same_solution(self, at: Slopes, neighbour: Slopes) -> bool:
        """Whether two solutions are equal to round-off: two responses may peak at one point."""
        distance = np.linalg.norm((at.state - neighbour.state) / self.curve.scale(neighbour.state))
        same_value = self.curve.single_valued and at.state[-1] == neighbour.state[-1]
        return bool(distance <= _SAME_SOLUTION or same_value)

    def _add(self, at: Slopes, dofs: Iterable[int], kind: PeakKind, norm: float) -> None:
        """Add one solution as the peak of the responses ``dofs``."""
        unknowns, value = at.state[:-1], float(at.state[-1])
        for dof in dofs:
            self.peaks.append(Peak(value, float(at.amplitude[dof]), dof, kind, unknowns, norm))

    def _norm(self, solution: Corrected) -> float:
        """Residual norm with contact states evaluated freely."""
        if not solution.crosses:
            return solution.residual_norm  # they are those that were held
        return self.curve.evaluate(solution.point[:-1], float(solution.point[-1])).norm
