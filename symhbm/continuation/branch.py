"""The branch of solutions over a whole band, with its peaks and its solutions at given values."""

from functools import cached_property

import numpy as np
import scipy

from symhbm.balance import Evaluation
from symhbm.continuation.between import (
    LocatedPeaks,
    Peak,
    locate_peaks,
    solved_between,
    unbounded_peak,
)
from symhbm.continuation.correctors import Corrector, Hyperplane, unit_parameter
from symhbm.continuation.deflation import other_solution
from symhbm.continuation.newton import ACCEPTED, NewtonResult, slope_of
from symhbm.continuation.path import Path
from symhbm.continuation.point import EventKind, PathPoint
from symhbm.continuation.problem import ContinuationProblem
from symhbm.continuation.segment import PathState, Segment
from symhbm.continuation.start import linear_response, solve_point
from symhbm.continuation.status import Status
from symhbm.numerics import FloatArray, cubic

_RESTARTS = (1, 10, 100, 1000)
"""Distances beyond a pole at which a new path starts, over that of the last point before it."""

_MAX_DEPTH = 4
"""How often a segment is followed again because its step passed over events."""


class Branch:
    """Points, peaks and status of a curve from the first to the last value of a ``band``.

    An unbounded resonance ends a path, and another path starts beyond it. ``per_dof`` asks for the
    peaks of every degree of freedom instead of those of the largest response; ``guess``
    (n_unknowns,) [m] may be a response close to that at the first value.
    """

    def __init__(
        self,
        curve: ContinuationProblem,
        band: tuple[float, float],
        max_points: int,
        per_dof: bool,
        guess: FloatArray | None = None,
    ):
        self.curve = curve
        self.per_dof = per_dof
        self.corrector = self._corrector_of(curve)
        self.points: list[PathPoint] = []
        self.peaks: list[Peak] = []
        self.between: dict[int, list[tuple[PathState, int]]] = {}
        self.rejected = 0
        self.status = Status.NO_START
        self._heading = 1 if band[1] > band[0] else -1
        self._follow(*band, max_points, guess)

    def _follow(self, start: float, end: float, max_points: int, guess: FloatArray | None) -> None:
        """Follow one path after another, beyond each pole, and set points, peaks and status."""
        missed, points_left = 0, max_points
        if guess is None:
            solution = self._solve_from_scratch(start)
        else:
            solution = self.corrector.free(guess, start)
        if guess is not None and not solution.converged:
            solution = self._solve_from_scratch(start)
        if solution.status in (Status.SYSTEM_SINGULAR, Status.NOT_HELD):
            self.status = solution.status
        while solution.converged and (end - start) * self._heading > 0:
            # Without a solution beyond its pole the branch keeps the status of the path.
            path = Path(self.curve, solution.unknowns, start, end, self.corrector, points_left)
            path_points = list(path)
            points_left -= len(path_points)
            self.rejected += path.rejected
            self.status = path.status
            points, peaks, missed_here = self._searched(path_points)
            self.points += points
            self.peaks += sorted(peaks, key=lambda peak: (self.per_dof * peak.dof, peak.value))
            missed += missed_here
            if path.status != Status.UNBOUNDED:
                break
            last = path_points[-1]
            scale = self.curve.scale(last.state)
            tangent = self.corrector.tangent(last.state, scale, last.before / scale, last.slip)
            if tangent is None:
                break
            peak = unbounded_peak(self.curve.problem, last, tangent.direction * scale)
            to_pole, to_end = peak.value - last.value, end - last.value
            if not 0 < to_pole * self._heading < to_end * self._heading:
                break  # the band ends on the flank of the resonance, before its pole
            self.peaks.append(peak)
            for distance in np.array(_RESTARTS) * to_pole:
                start = peak.value + distance
                solution = self.corrector.free(-last.unknowns, start)
                if not solution.converged:
                    solution = self._solve_from_scratch(start)
                if solution.converged:
                    break
        if missed and self.status == Status.REACHED_END:
            self.status = Status.PEAK_NOT_LOCATED
        complete = self.status == Status.REACHED_END and not self.curve.single_valued
        if complete and any(self._has_other_solution(self.points[i]) for i in (0, -1)):
            self.status = Status.OTHER_SOLUTIONS
        if complete and any(e.kind == EventKind.BRANCH for p in self.points for e in p.events):
            self.status = Status.BRANCH_POINTS

    def _corrector_of(self, curve: ContinuationProblem) -> Corrector:
        return Corrector(curve)

    def fill(self) -> None:
        """Solve for what interpolation needs: ``between``, by the index of the point before.

        Segments in which this shows events or peaks that the path passed over are followed again.
        """
        self.between, passed = solved_between(self.points, self.corrector, self.per_dof)
        missed = 0
        for _ in range(_MAX_DEPTH):
            if not passed:
                break
            again = LocatedPeaks([], {}, missed, passed)
            self.points, peaks, missed = self._searched(self.points, again)
            known = {(peak.value, peak.dof) for peak in self.peaks}
            self.peaks += [peak for peak in peaks if (peak.value, peak.dof) not in known]
            self.between, passed = solved_between(self.points, self.corrector, self.per_dof)
        if (missed or passed) and self.status == Status.REACHED_END:
            self.status = Status.PEAK_NOT_LOCATED

    def _searched(
        self, points: list[PathPoint], located: LocatedPeaks | None = None, depth: int = 0
    ) -> tuple[list[PathPoint], list[Peak], int]:
        """A path with its peaks among its points, the peaks, and how many could not be solved for.

        A segment in which a contact has another state is followed again, through that state.
        """
        located = located or locate_peaks(points, self.corrector, self.per_dof)
        path, peaks, missed = [], located.peaks, located.lost
        for i, left in enumerate(points):
            path += [left, *located.between.get(i, ())]
            if i not in located.other_states:
                continue
            right, value = points[i + 1], located.other_states[i]
            added = self._points_through(left, right, value) if depth < _MAX_DEPTH else None
            if added is None:
                # The other state is one of round-off, next to the limit.
                pair = [left, right]
                alone = locate_peaks(pair, self.corrector, self.per_dof, ignore_states=True)
                path += alone.between.get(0, ())
                peaks += alone.peaks
                missed += alone.lost + len(alone.other_states)
                continue
            refined = self._searched([left, *added, right], depth=depth + 1)
            path += refined[0][1:-1]
            peaks += refined[1]
            missed += refined[2]
        return path, peaks, missed

    def _points_through(
        self, left: PathPoint, right: PathPoint, value: float
    ) -> list[PathPoint] | None:
        """The points between two others, one of them at a ``value`` that the path passed over."""
        followed = [left]
        for end in (value, right.value):
            base = followed[-1]
            path = Path(self.curve, left.unknowns, base.value, end, self.corrector, base=base)
            followed += list(path)[1:]
            self.rejected += path.rejected
            if path.status != Status.REACHED_END:
                return None
        # A contact still in another state at the right point changes there, but for round-off.
        return followed[1:-1] if np.array_equal(followed[-1].slip, left.slip) else None

    def _has_other_solution(self, point: PathPoint) -> bool:
        """Whether Newton's method finds another solution at the value of a point."""
        linear = linear_response(*self.curve.at(point.value))
        starts = [1.01 * point.unknowns, *([] if linear is None else [linear])]

        def balance(unknowns: FloatArray) -> Evaluation:
            self.corrector.solves += 1
            return self.curve.evaluate(unknowns, point.value)

        return other_solution(balance, point.unknowns, starts) is not None

    def at(self, value: float) -> list[tuple[PathState | None, int]]:
        """Solutions at a value of the band, in the order of the path.

        Each comes with the linear solves it took; None stands for one that could not be solved for.
        """
        solutions = []
        for left, right in self._segments(value):
            solves_before = self.corrector.solves
            solution = self._solve_between(left, right, value)
            if solution is not None and self._norm(solution.state[:-1], value) > ACCEPTED:
                # A contact is in another state for a moment between two points of the path.
                solution = self._path_state(self.corrector.free(solution.state[:-1], value), value)
            if solution is None and self.curve.single_valued:
                solution = self._path_state(self._solve_from_scratch(value), value)
            solutions.append((solution, self.corrector.solves - solves_before))
        if not solutions and self.points:
            result = self._solve_from_scratch(value)
            solutions = [(self._path_state(result, value), result.iterations)]
        return solutions or [(None, 0)]

    def _path_state(self, result: NewtonResult, value: float) -> PathState | None:
        """The solution of an iteration at a value, with its tangent, None without one."""
        if not result.converged:
            return None
        direction = np.append(slope_of(result.evaluation), 1.0)
        return PathState(np.append(result.unknowns, value), direction)

    @cached_property
    def _values(self) -> FloatArray:
        return np.array([point.value for point in self.points])

    def _segments(self, value: float) -> list[tuple[PathPoint, PathPoint]]:
        """Neighbouring points around the value; a point at the value is paired with itself."""
        side = np.sign(self._values - value)
        at_points = np.flatnonzero(side == 0)
        between = np.flatnonzero(side[1:] * side[:-1] < 0)
        pairs = sorted([(i, i) for i in at_points] + [(i, i + 1) for i in between])
        segments = [(self.points[i], self.points[j]) for i, j in pairs]
        return segments[:1] if self.curve.single_valued else segments

    def _solve_between(self, left: PathPoint, right: PathPoint, value: float) -> PathState | None:
        """The solution at a value between two points of the path."""
        if left is right:
            return PathState(left.state, left.after)
        if self.curve.single_valued:
            share = (value - left.value) / (right.value - left.value)
            guess = np.append(_interpolated(left, right, share), value)
            return self._solve_at_value(guess, left)
        segment = Segment(
            self.corrector,
            PathState(left.state, left.after),
            PathState(right.state, right.before),
            left.slip,
        )

        def distance(share: float) -> float:
            ends = {0.0: left.value, 1.0: right.value}
            if share in ends:
                return ends[share] - value
            return float(segment.interpolate(np.array([share]))[0][0, -1]) - value

        guess = segment.interpolate(np.array([scipy.optimize.brentq(distance, 0.0, 1.0)]))[0][0]
        near_fold = any(e.kind == EventKind.FOLD for p in (left, right) for e in p.events)
        return self._solve_along(segment, value) if near_fold else self._solve_at_value(guess, left)

    def _solve_at_value(self, guess: FloatArray, left: PathPoint) -> PathState | None:
        """The solution at the value of a guess, in the contact states of the point before."""
        scale = self.curve.scale(guess)
        plane = Hyperplane(guess, scale, unit_parameter(len(scale)))
        solution = self.corrector.correct(guess, scale, plane, left.slip)
        return None if solution is None else PathState(solution.point, solution.direction * scale)

    def _solve_along(self, segment: Segment, value: float) -> PathState | None:
        """The solution at a value, searched along the path; near a fold two are too close."""

        def distance(share: float) -> float:
            ends = {0.0: segment.left, 1.0: segment.right}
            solution = ends.get(share) or segment.solve(share)
            if solution is None:
                raise ArithmeticError
            return float(solution.state[-1]) - value

        try:
            share = float(scipy.optimize.brentq(distance, 0.0, 1.0, xtol=1e-15, rtol=1e-14))  # type: ignore
        except ArithmeticError:
            return None
        return segment.solve(share)

    def _norm(self, unknowns: FloatArray, value: float) -> float:
        return self.curve.evaluate(unknowns, value).norm

    def _solve_from_scratch(self, value: float) -> NewtonResult:
        result = solve_point(*self.curve.at(value))
        self.corrector.solves += result.iterations
        return result


def _interpolated(left: PathPoint, right: PathPoint, share: float) -> FloatArray:
    """Unknowns between two points of a path, by cubic interpolation over the parameter."""
    length, step = right.value - left.value, right.unknowns - left.unknowns
    first, last = (
        length * point[:-1] / point[-1] if point[-1] * length > 0 else step
        for point in (left.after, right.before)
    )
    return cubic(left.unknowns, right.unknowns, (first, last), share)
