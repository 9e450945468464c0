"""A path over a whole band: taken up again beyond poles, with its peaks, and asked for values."""

from functools import cached_property

import numpy as np
import scipy

from symhbm.balance import Evaluation
from symhbm.continuation.between import Peak, find_missed_events, locate_peaks, unbounded_peak
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
"""Distances from a pole, relative to that of the last point before it, to take a path up at."""

_MAX_DEPTH = 4
"""How often a stretch is walked anew for events that were passed over."""


class Branch:
    """Points, peaks and status of a curve from the first to the last value of a ``band``.

    A resonance that nothing bounds ends a path; it is taken up again beyond. ``each`` asks for the
    peaks of every degree of freedom instead of those of the largest response; ``guess``
    (n_unknowns,) [m] may be a response close to that at the first value.
    """

    def __init__(
        self,
        curve: ContinuationProblem,
        band: tuple[float, float],
        max_points: int,
        each: bool,
        guess: FloatArray | None = None,
    ):
        self.curve = curve
        self.each = each
        self.corrector = self._corrector_of(curve)
        self.points: list[PathPoint] = []
        self.peaks: list[Peak] = []
        self.rejected = 0
        self.status = Status.NO_START
        self._heading = 1 if band[1] > band[0] else -1
        self._go(*band, max_points, guess)

    def _go(self, start: float, end: float, max_points: int, guess: FloatArray | None) -> None:
        lost, room = 0, max_points
        found = self._solve_anew(start) if guess is None else self.corrector.free(guess, start)
        if guess is not None and not found.converged:
            found = self._solve_anew(start)
        if found.status in (Status.SYSTEM_SINGULAR, Status.NOT_HELD):
            self.status = found.status
        while found.converged and (end - start) * self._heading > 0:
            # A path that cannot be taken up beyond its pole keeps the status it ended with.
            path = Path(self.curve, found.unknowns, start, end, self.corrector, room)
            segment = list(path)
            room -= len(segment)
            self.rejected += path.rejected
            self.status = path.status
            points, peaks, missing = self._located(self._completed(segment))
            self.points += points
            self.peaks += sorted(peaks, key=lambda peak: (self.each * peak.dof, peak.value))
            lost += missing
            if path.status != Status.UNBOUNDED:
                break
            last = segment[-1]
            scale = self.curve.scale(last.state)
            tangent = self.corrector.tangent(last.state, scale, last.before / scale, last.slip)
            if tangent is None:
                break
            peak = unbounded_peak(self.curve.problem, last, tangent.direction * scale)
            if (
                not 0
                < (peak.value - last.value) * self._heading
                < (end - last.value) * self._heading
            ):
                break  # the band ends on the way up: an edge
            self.peaks.append(peak)
            for distance in np.array(_RESTARTS) * (peak.value - last.value):
                start = peak.value + distance
                found = self.corrector.free(-last.unknowns, start)
                if not found.converged:
                    found = self._solve_anew(start)
                if found.converged:
                    break
        if lost and self.status == Status.REACHED_END:
            self.status = Status.PEAK_NOT_LOCATED
        complete = self.status == Status.REACHED_END and not self.curve.single_valued
        if complete and any(self._has_others(self.points[end]) for end in (0, -1)):
            self.status = Status.OTHER_SOLUTIONS
        if complete and any(e.kind == EventKind.BRANCH for p in self.points for e in p.events):
            self.status = Status.BRANCH_POINTS

    def _corrector_of(self, curve: ContinuationProblem) -> Corrector:
        return Corrector(curve)

    def _completed(self, points: list[PathPoint], depth: int = 0) -> list[PathPoint]:
        """A path with the events that its steps passed over."""
        passed = find_missed_events(points, self.corrector) if self.curve.single_valued else {}
        path = []
        for i, here in enumerate(points):
            path.append(here)
            if i in passed and depth < _MAX_DEPTH:
                between = self._walked_anew(here, points[i + 1], passed[i]) or []
                path += self._completed([here, *between, points[i + 1]], depth + 1)[1:-1]
        return path

    def _located(
        self, points: list[PathPoint], depth: int = 0
    ) -> tuple[list[PathPoint], list[Peak], int]:
        """A path with its peaks among its points, the peaks, and the number of those not found.

        Where they tell of events that were passed over, the path is walked anew.
        """
        located = locate_peaks(points, self.corrector, self.each)
        path, peaks, lost = [], located.peaks, located.lost
        for i, here in enumerate(points):
            path += [here, *located.between.get(i, ())]
            if i not in located.other_states:
                continue
            there = points[i + 1]
            value = located.other_states[i]
            passed = self._walked_anew(here, there, value) if depth < _MAX_DEPTH else None
            if passed is None:
                # That state is one of round-off, next to the limit.
                alone = locate_peaks([here, there], self.corrector, self.each, ignore_states=True)
                path += alone.between.get(0, ())
                peaks += alone.peaks
                lost += alone.lost + len(alone.other_states)
                continue
            inner, others, missing = self._located([here, *passed, there], depth + 1)
            path += inner[1:-1]
            peaks += others
            lost += missing
        return path, peaks, lost

    def _walked_anew(
        self, here: PathPoint, there: PathPoint, value: float
    ) -> list[PathPoint] | None:
        """The points between two others, with one at a ``value`` that the path passed over."""
        walked = [here]
        for end in (value, there.value):
            path = Path(
                self.curve, here.unknowns, walked[-1].value, end, self.corrector, base=walked[-1]
            )
            walked += list(path)[1:]
            self.rejected += path.rejected
            if path.status != Status.REACHED_END:
                return None
        # A contact that is in another state up to the next point changed it there, to round-off.
        return walked[1:-1] if np.array_equal(walked[-1].slip, here.slip) else None

    def _has_others(self, point: PathPoint) -> bool:
        """Whether another solution is found at the value of a point."""
        linear = linear_response(*self.curve.at(point.value))
        starts = [1.01 * point.unknowns, *([] if linear is None else [linear])]

        def balance(unknowns: FloatArray) -> Evaluation:
            self.corrector.solves += 1
            return self.curve.evaluate(unknowns, point.value)

        return other_solution(balance, point.unknowns, starts) is not None

    def at(self, value: float) -> list[tuple[PathState | None, int]]:
        """Solutions at a value of the band, in the order of the path.

        Each comes with the linear solves it took; None stands for one that was not found.
        """
        found = []
        for here, there in self._segments(value):
            before = self.corrector.solves
            station = self._between(here, there, value)
            if station is not None and self._norm(station.state[:-1], value) > ACCEPTED:
                # A contact changes its state for a moment between two points of the path.
                station = self._station(self.corrector.free(station.state[:-1], value), value)
            if station is None and self.curve.single_valued:
                station = self._station(self._solve_anew(value), value)
            found.append((station, self.corrector.solves - before))
        if not found and self.points:
            anew = self._solve_anew(value)
            found = [(self._station(anew, value), anew.iterations)]
        return found or [(None, 0)]

    def _station(self, found: NewtonResult, value: float) -> PathState | None:
        """What an iteration at a value ended at, None if that is no solution."""
        if not found.converged:
            return None
        direction = np.append(slope_of(found.evaluation), 1.0)
        return PathState(np.append(found.unknowns, value), direction)

    @cached_property
    def _values(self) -> FloatArray:
        return np.array([point.value for point in self.points])

    def _segments(self, value: float) -> list[tuple[PathPoint, PathPoint]]:
        """Neighbours on the path between which the value lies, a point on it with itself."""
        beyond = np.sign(self._values - value)
        at = np.flatnonzero(beyond == 0)
        between = np.flatnonzero(beyond[1:] * beyond[:-1] < 0)
        pairs = sorted([(i, i) for i in at] + [(i, i + 1) for i in between])
        found = [(self.points[i], self.points[j]) for i, j in pairs]
        return found[:1] if self.curve.single_valued else found

    def _between(self, here: PathPoint, there: PathPoint, value: float) -> PathState | None:
        if here is there:
            return PathState(here.state, here.after)
        if self.curve.single_valued:
            share = (value - here.value) / (there.value - here.value)
            guess = np.append(_between(here, there, share), value)
            return self._correct(guess, here)
        path = Segment(
            self.corrector,
            PathState(here.state, here.after),
            PathState(there.state, there.before),
            here.slip,
        )

        def distance(share: float) -> float:
            ends = {0.0: here.value, 1.0: there.value}
            at = ends[share] if share in ends else path.interpolate(np.array([share]))[0][0, -1]
            return float(at) - value

        guess = path.interpolate(np.array([scipy.optimize.brentq(distance, 0.0, 1.0)]))[0][0]
        near_fold = any(e.kind == EventKind.FOLD for p in (here, there) for e in p.events)
        return self._along(path, value) if near_fold else self._correct(guess, here)

    def _correct(self, guess: FloatArray, here: PathPoint) -> PathState | None:
        scale = self.curve.scale(guess)
        plane = Hyperplane(guess, scale, unit_parameter(len(scale)))
        found = self.corrector.correct(guess, scale, plane, here.slip)
        return None if found is None else PathState(found.point, found.direction * scale)

    def _along(self, path: Segment, value: float) -> PathState | None:
        """Solve along the path: next to a fold two solutions at one value are too close."""

        def distance(share: float) -> float:
            ends = {0.0: path.left, 1.0: path.right}
            station = ends.get(share) or path.solve(share)
            if station is None:
                raise ArithmeticError
            return float(station.state[-1]) - value

        try:
            share = float(scipy.optimize.brentq(distance, 0.0, 1.0, xtol=1e-15, rtol=1e-14))  # type: ignore
        except ArithmeticError:
            return None
        return path.solve(share)

    def _norm(self, unknowns: FloatArray, value: float) -> float:
        return self.curve.evaluate(unknowns, value).norm

    def _solve_anew(self, value: float) -> NewtonResult:
        found = solve_point(*self.curve.at(value))
        self.corrector.solves += found.iterations
        return found


def _between(here: PathPoint, there: PathPoint, share: float) -> FloatArray:
    """Unknowns between two points of a path by cubic interpolation over the parameter."""
    length, step = there.value - here.value, there.unknowns - here.unknowns
    left, right = (
        length * point[:-1] / point[-1] if point[-1] * length > 0 else step
        for point in (here.after, there.before)
    )
    return cubic(here.unknowns, there.unknowns, (left, right), share)
