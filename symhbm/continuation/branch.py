"""A branch of solutions over a whole band, with its peaks and its solutions at given values."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from symhbm.continuation.between import Peak
from symhbm.continuation.correctors import Corrector, Hyperplane, unit_parameter
from symhbm.continuation.newton import ACCEPTED, NewtonResult, slope_of
from symhbm.continuation.point import EventKind, PathPoint
from symhbm.continuation.problem import ContinuationProblem
from symhbm.continuation.segment import PathState, Segment
from symhbm.continuation.status import Status
from symhbm.numerics import FloatArray
from symhbm.numerics.loops import interpolation


@dataclass(frozen=True)
class Branch:
    """Points, peaks and status of a curve from the first to the last value of a band.

    ``peaks`` are those of every degree of freedom where ``per_dof``, else those of the largest
    response; ``rejected`` counts rejected steps. ``solve_from_scratch`` solves at a value without a
    neighbouring solution; ``between`` are solutions with the solves they took, by the index of the
    point before. `symhbm.continuation.following.follow_branch` makes branches.
    """

    corrector: Corrector
    solve_from_scratch: Callable[[float], NewtonResult]
    per_dof: bool
    points: list[PathPoint]
    peaks: list[Peak]
    status: Status
    rejected: int
    between: dict[int, list[tuple[PathState, int]]] = field(default_factory=dict)

    @property
    def curve(self) -> ContinuationProblem:
        """The equations that its points solve."""
        return self.corrector.curve

    def at(self, value: float) -> list[tuple[PathState | None, int]]:
        """Solutions at a value of the band, in the order of the path.

        Each comes with the linear solves it took; None stands for one that could not be solved for.
        """
        if self.curve.at_rest:
            return [(self._path_state(self.solve_from_scratch(value), value), 1)]
        solutions = []
        for left, right in self._segments(value):
            solves_before = self.corrector.solves
            solution = self._solve_between(left, right, value)
            if solution is not None and self._norm(solution.state[:-1], value) > ACCEPTED:
                # A contact is in another state for a moment between two points of the path.
                solution = self._path_state(self.corrector.free(solution.state[:-1], value), value)
            if solution is None and self.curve.single_valued:
                solution = self._path_state(self.solve_from_scratch(value), value)
            solutions.append((solution, self.corrector.solves - solves_before))
        if not solutions:
            result = self.solve_from_scratch(value)
            solutions = [(self._path_state(result, value), result.iterations)]
        return solutions

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
        segment = Segment.of(self.corrector, left, right)
        kinds = {event.kind for point in (left, right) for event in point.events}
        near = not kinds.isdisjoint((EventKind.FOLD, EventKind.BRANCH))
        solution = None if near else self._solve_at_value(segment.at_value(value)[1], left)
        # Next to a sharp bend Newton's method at one value may find nothing.
        if solution is None:
            with suppress(ArithmeticError):
                # Near a fold two solutions are too close: along the path they are apart.
                return segment.zero(lambda at: at.state[-1] - value)
        return solution

    def _solve_at_value(self, guess: FloatArray, left: PathPoint) -> PathState | None:
        """The solution at the value of a guess, in the contact states of the point before."""
        scale = self.curve.scale(guess)
        plane = Hyperplane(guess, scale, unit_parameter(len(scale)))
        solution = self.corrector.correct(guess, plane, left.switches)
        return None if solution is None else PathState(solution.point, solution.direction * scale)

    def _norm(self, unknowns: FloatArray, value: float) -> float:
        return self.curve.evaluate(unknowns, value).norm


def _interpolated(left: PathPoint, right: PathPoint, share: float) -> FloatArray:
    """Unknowns between two points of a path, by cubic interpolation over the parameter."""
    length, step = right.value - left.value, right.unknowns - left.unknowns
    first, last = (
        length * point[:-1] / point[-1] if point[-1] * length > 0 else step
        for point in (left.after, right.before)
    )
    return interpolation.cubic(left.unknowns, right.unknowns, (first, last), share)
