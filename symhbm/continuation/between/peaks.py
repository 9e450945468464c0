"""Peaks of the response along a path: smooth ones, corners and unbounded ones.

A peak is a local maximum along the path of the largest response of all degrees of freedom, or of
the response of each. It is *smooth* where the slope vanishes, a *corner* where slopes of opposite
sign meet at an onset or end of slip. A maximum at an end of the path is an edge, not a peak.

States and tangents give a cubic between two points. Where its slope changes sign, or may do so
within the interpolation error, points are added until every maximum lies between slopes of
opposite sign. Values and slopes of a goal give a cubic as well; where the goal half way is another
than that of the cubic, points are added, until slopes tell where it turns.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from symhbm.balance import HarmonicBalance, ValueOf
from symhbm.balance.goals import Goal
from symhbm.continuation.between.doubts import MissedEvents
from symhbm.continuation.between.maxima import CORNER_JUMP, LocatedMaximum, Maxima
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
from symhbm.continuation.segment import PathState, Segment
from symhbm.numerics import FloatArray, bracketed_root

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


_CUBIC = 1e-3
"""Error of a cubic half way, over the larger of both values, up to which it tells slopes."""
_MAX_HALVINGS = 8
_SHARES = np.linspace(0, 1, 9)
_NONE = 1e-7
"""Slope at an end, over the largest of a segment, that is 0: a path has a point at each peak."""
_CONSTANT = 1e-9
"""Change along a segment, over the goal, that is none."""


class _At(NamedTuple):
    """The goal at a share of a segment: ``slope`` by that share."""

    state: FloatArray
    value: float
    slope: float


def goal_peaks(
    goal: Goal, points: list[PathPoint], corrector: Corrector, left_out: Collection[int]
) -> tuple[list[Peak], int]:
    """The peaks of a goal between points of a frequency response, corners at points among them.

    Segments whose first points are ``left_out`` have none. With it, in how many it is not known.
    """
    peaks: list[Peak] = []
    before: _At | None = None
    lost = 0
    for number, (left, right) in enumerate(pairwise(points)):
        along = _Along(Segment.of(corrector, left, right), goal)
        if not along.segment.length > 0:
            continue
        first, last = along.at(0.0), along.at(1.0)
        if left.events and before and before.slope > _CONSTANT * before.value and first.slope < 0:
            along.add(first, PeakKind.CORNER)
        try:
            if number not in left_out:
                along.search(0.0, 1.0, _MAX_HALVINGS)
        except ArithmeticError:
            lost += 1
        peaks += along.peaks
        before = last
    return peaks, lost


@dataclass
class _Along:
    """A goal along a segment, where it is ``known``, and its ``peaks`` that were found."""

    segment: Segment
    goal: Goal
    known: dict[float, _At] = field(default_factory=dict)
    peaks: list[Peak] = field(default_factory=list)

    def at(self, share: float) -> _At:
        """The goal at a share of the segment; ArithmeticError where there is no solution."""
        if share not in self.known:
            segment, problem = self.segment, self.segment.curve.problem
            ends = {0.0: segment.left, 1.0: segment.right}
            path_state = ends.get(share) or segment.solve(share) or segment.solve_between(share)
            if path_state is None:
                raise ArithmeticError("a solution between two points of the path is not known")
            state, direction = path_state.state, path_state.direction
            solution = state[:-1], float(state[-1])
            # A contact may be in another state for a moment between two points of the path.
            states = problem.locate(*solution, segment.switches if share in ends else None)
            found = ValueOf.at(self.goal, problem, *solution, states)
            found = found.checked(self.goal, solution[1])
            ahead = segment.normal @ (direction / segment.scale)
            slope = float(found.slope @ direction * segment.length / ahead)
            self.known[share] = _At(state, found.value, slope)
        return self.known[share]

    def search(self, low: float, high: float, halvings: int) -> None:
        """Find the peaks between two shares."""
        first, last, width = self.at(low), self.at(high), high - low
        rise, t = last.value - first.value, _SHARES
        slopes = 6 * t * (1 - t) * rise / width
        slopes += first.slope * (1 - t) * (1 - 3 * t) + last.slope * t * (3 * t - 2)
        size, largest = np.abs(slopes).max(), max(first.value, last.value)
        falls = np.where(np.abs(slopes) <= _NONE * size, True, slopes < 0)
        turns = np.count_nonzero(np.diff(falls))
        if width * size <= _CONSTANT * largest:
            return
        if halvings:
            middle = self.at((low + high) / 2)
            cubic = (first.value + last.value) / 2 + width * (first.slope - last.slope) / 8
            if turns > 1 or abs(middle.value - cubic) > _CUBIC * largest:
                self.search(low, (low + high) / 2, halvings - 1)
                self.search((low + high) / 2, high, halvings - 1)
                return
        if falls[-1] and not falls[0]:
            self.add(self._turn(low, high), PeakKind.SMOOTH)

    def add(self, at: _At, kind: PeakKind) -> None:
        """Add a peak."""
        unknowns, value = at.state[:-1], float(at.state[-1])
        norm = self.segment.curve.evaluate(unknowns, value).norm
        self.peaks.append(Peak(value, at.value, -1, kind, unknowns, norm))

    def _turn(self, low: float, high: float) -> _At:
        """Where the slope falls through 0 between two shares."""
        first, last = self.at(low), self.at(high)
        if last.slope >= 0:
            return last
        start = low + (high - low) * first.slope / (first.slope - last.slope)
        return self.at(bracketed_root(lambda share: self.at(share).slope, low, high, start))
