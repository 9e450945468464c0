"""Segments of a path between two of its points: cubic interpolation and solutions in between.

Between two events the path is smooth and its tangent is known at every point. So a cubic predicts
a solution between two points, and a correction across the path solves for it.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cache
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors import Corrector, Hyperplane, unit_parameter
from symhbm.continuation.newton import NewtonResult
from symhbm.continuation.point import PathPoint
from symhbm.continuation.problem import Corrected
from symhbm.numerics import FloatArray, bracketed_root
from symhbm.numerics.loops import Loop, interpolation

_ACROSS = 0.5
"""Cosine of half the angle between both tangents below which their mean is no normal of planes."""
_LEAST_AHEAD = 1e-3
"""Least component of a unit tangent along a normal that divides."""
_CLEARLY = 1e-7
"""Slip margin beyond which a contact is in another state, and not by round-off."""
_SAME = 0.999
"""Cosine of the angle between two tangents of one path at one point, at least."""
_ROUND_OFF = 1e-12
"""Distance beyond an end, in the unit of the parameter, of a solution that is the end."""
_CLOSE = 0.01
"""Share of the segment within which the tangent of a neighbour predicts better than the cubic."""


@dataclass(eq=False, slots=True)
class PathState:
    """One solution or several, with the tangent along the path, both (..., n_unknowns + 1)."""

    state: FloatArray
    direction: FloatArray

    def __getitem__(self, index: Any) -> Self:
        return type(self)(*[getattr(self, name)[index] for name in _names(type(self))])

    @classmethod
    def stacked(cls, states: Sequence[Self]) -> Self:
        """Several states of one solution each, along a new first axis."""
        return cls(*[np.array([getattr(state, name) for state in states]) for name in _names(cls)])

    @classmethod
    def joined(cls, states: Sequence[Self]) -> Self:
        """Several states of many solutions each, along the first axis."""
        return cls(*[np.concatenate([getattr(s, name) for s in states]) for name in _names(cls)])


@cache
def _names(kind: type[PathState]) -> list[str]:
    return [field.name for field in fields(kind)]


class Measure(NamedTuple):
    """Normals and lengths of one segment or several: (..., n_unknowns + 1), ``length`` (..., 1).

    The scaled ``normal`` of the planes across a segment, its ``length`` along the normal, and the
    derivatives of the state by the share of the length at both ends.
    """

    normal: FloatArray
    length: FloatArray
    left: FloatArray
    right: FloatArray


def measure(single_valued: bool, left: PathState, right: PathState, scale: FloatArray) -> Measure:
    """Normals and lengths of one segment or several, in the ``scale`` of their left ends."""
    states = left.state, left.direction, right.state, right.direction, scale
    given = [np.ascontiguousarray(array).reshape(-1, scale.shape[-1]) for array in states]
    normal, *slopes = np.empty((3, *given[0].shape))
    length = np.empty((len(normal), 1))
    _measure(single_valued, *given, normal, length, *slopes)
    shape = scale.shape
    return Measure(
        normal.reshape(shape), length.reshape(*shape[:-1], 1), *(s.reshape(shape) for s in slopes)
    )


@Loop
def _measure(
    single_valued: bool,
    left,
    left_direction,
    right,
    right_direction,
    scale,
    normal,
    length,
    first,
    last,
) -> None:
    """Write what `Measure` holds of segments (n, n_unknowns + 1)."""
    for i in range(len(normal)):
        begin, end, across = left_direction[i], right_direction[i], normal[i]
        length[i, 0] = _normal(single_valued, left[i], begin, right[i], end, scale[i], across)
        before, after = ahead(begin, across, scale[i]), ahead(end, across, scale[i])
        for k in range(len(across)):
            first[i, k] = length[i, 0] * begin[k] / before
            last[i, k] = length[i, 0] * end[k] / after


@Loop
def _normal(single_valued: bool, left, begin, right, end, scale, normal) -> float:
    """Write the normal of one segment; gives its length."""
    size, first, last, both = len(scale), 0.0, 0.0, 0.0
    for k in range(size):
        at_begin, at_end = begin[k] / scale[k], end[k] / scale[k]
        first += at_begin * at_begin
        last += at_end * at_end
    first, last = math.sqrt(first), math.sqrt(last)
    for k in range(size):
        normal[k] = begin[k] / scale[k] / first + end[k] / scale[k] / last
        both += normal[k] * normal[k]
    both = math.sqrt(both)
    # A path that turns by up to 180 degrees meets each plane across the mean tangent once.
    opposite = both < 2 * _ACROSS
    length, chord = 0.0, 0.0
    for k in range(size):
        normal[k] = begin[k] / scale[k] / first if opposite else normal[k] / both
        step = (right[k] - left[k]) / scale[k]
        length += normal[k] * step
        chord += step * step
    # Along a path that turns sharply, only the parameter increases throughout.
    if single_valued and (opposite or length < math.sqrt(chord) / 2):
        for k in range(size - 1):
            normal[k] = 0.0
        normal[size - 1] = heading = 1.0 if begin[size - 1] >= 0 else -1.0
        length = heading * (right[size - 1] - left[size - 1]) / scale[size - 1]
    return length


@Loop
def ahead(direction, normal, scale) -> float:
    """Component of a tangent along a ``normal``, no less than a small positive number."""
    result = 0.0
    for k in range(len(normal)):
        result += normal[k] * direction[k] / scale[k]
    return max(result, _LEAST_AHEAD)


class Segment:
    """The path between two of its solutions, without events, the contact states ``switches`` held.

    ``other_states`` tells that a contact is in another state for a part of the segment.
    """

    def __init__(
        self,
        corrector: Corrector,
        left: PathState,
        right: PathState,
        switches: NDArray[np.bool_],
        scale: FloatArray | None = None,
        measured: Measure | None = None,
    ):
        self.corrector = corrector
        self.curve = corrector.curve
        self.left, self.right, self.switches = left, right, switches
        self.scale = self.curve.scale(left.state) if scale is None else scale
        if measured is None:
            measured = measure(self.curve.single_valued, left, right, self.scale)
        self.normal, self.length = measured.normal, float(measured.length[0])
        self.other_states = False
        self._slopes = measured.left, measured.right
        self._known = {0.0: left, 1.0: right}

    @classmethod
    def of(cls, corrector: Corrector, left: PathPoint, right: PathPoint) -> "Segment":
        """The path between two neighbouring points of it."""
        ends = PathState(left.state, left.after), PathState(right.state, right.before)
        return cls(corrector, *ends, left.switches)

    def interpolate(self, share: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Cubic interpolant at shares (n,) of the length, and its derivative by the share.

        Two arrays (n, n_unknowns + 1).
        """
        ends = [array[None] for array in (self.left.state, self.right.state, *self._slopes)]
        values, rates = np.empty((2, 1, len(share), len(self.scale)))
        interpolation.interpolate(*ends, share, values)
        interpolation.differentiate(*ends, share, rates)
        return values[0], rates[0]

    def share_of(self, state: FloatArray) -> float:
        """Share of the length at which a state (n_unknowns + 1,) lies."""
        return float(np.dot(self.normal, (state - self.left.state) / self.scale)) / self.length

    def at_value(self, value: float, component: int = -1) -> tuple[float, FloatArray]:
        """Where the parameter of the cubic has a value between its ends: share and state.

        The parameter is the last component, or another one is meant.
        """
        ends = (float(end.state[component]) - value for end in (self.left, self.right))
        slopes = float(self._slopes[0][component]), float(self._slopes[1][component])
        guess = np.empty(len(self.scale))
        share = interpolation.first_zero(*ends, slopes)
        _at(self.left.state, self.right.state, *self._slopes, share, guess)
        guess[component] = value
        return share, guess

    def solve(self, share: float, precision: float = 1e-10) -> PathState | None:
        """The solution at a share of the length, None where the correction fails.

        At an end the solution is the end itself, its tangent computed again.
        """
        return self._path_state(self.corrected(share, precision=precision))

    def at(self, share: float) -> PathState:
        """The solution at a share of the length, solved for once; ends are as they are given.

        Raises ArithmeticError where it cannot be solved for.
        """
        if share not in self._known:
            solution = self.solve(share)
            if solution is None:
                raise ArithmeticError("the path between two points cannot be solved for")
            self._known[share] = solution
        return self._known[share]

    def zero(
        self, value: Callable[[PathState], float], low: float = 0.0, high: float = 1.0
    ) -> PathState:
        """The solution between two shares at which a value of solutions changes its sign.

        Its signs at both are opposite. Raises ArithmeticError as `at`.
        """
        return self.at(bracketed_root(lambda share: value(self.at(share)), low, high))

    def corrected(
        self,
        share: float,
        neighbour: tuple[float, PathState] | None = None,
        precision: float = 1e-10,
        patient: bool = False,
    ) -> Corrected | None:
        """As `solve`, the direction relative to the ``scale``.

        ``neighbour`` may be another share and the solution there; ``patient`` tells that steps are
        shortened where full ones fail.
        """
        if share in (0.0, 1.0):
            end = self.right if share else self.left
            found = self.corrector.tangent(end.state, self.scale, self.normal, self.switches)
            known = end.direction / self.scale / np.linalg.norm(end.direction / self.scale)
            if found is None or np.dot(found.direction, known) > _SAME:
                return found
            return found._replace(direction=known)  # a branch point, which has two
        guess, anchor = np.empty((2, len(self.scale)))
        close = neighbour is not None and abs(share - neighbour[0]) < _CLOSE
        if neighbour is not None and close:
            distance, near = (share - neighbour[0]) * self.length, neighbour[1]
            _beside(near.state, near.direction, self.normal, self.scale, distance, guess)
        else:
            _at(self.left.state, self.right.state, *self._slopes, share, guess)
        if self.curve.single_valued:
            low, high = sorted((self.left.state[-1], self.right.state[-1]))
            guess[-1] = min(max(guess[-1], low), high)
        _along(self.left.state, self.normal, self.scale, share * self.length, anchor)
        plane = Hyperplane(anchor, self.scale, self.normal)
        correct = self.corrector.reach if patient else self.corrector.correct
        solution = correct(guess, plane, self.switches, precision)
        if solution is None or not self._is_between(solution):
            return None
        if not self.curve.single_valued and solution.crosses:
            self.other_states |= is_beyond(solution.margins, self.switches, _CLEARLY)
        return solution

    def solve_between(self, share: float) -> PathState | None:
        """A solution strictly between both ends, at or near a share of the length.

        Where the correction across the path fails, at a value of the parameter, contacts free.
        """
        solution = self.solve(share, precision=1e-6)
        if solution is not None or not self.curve.single_valued:
            return solution
        guess = np.empty(len(self.scale))
        _at(self.left.state, self.right.state, *self._slopes, share, guess)
        low, high = sorted((self.left.state[-1], self.right.state[-1]))
        if not low < guess[-1] < high:
            guess[-1] = (low + high) / 2
        result = self.corrector.free(guess[:-1], float(guess[-1]))
        if not result.converged:
            return None
        state = np.append(result.unknowns, guess[-1])
        row = np.sign(self.left.direction[-1]) * unit_parameter(len(self.scale))
        self.other_states |= has_other_states(result, self.switches, _CLEARLY)
        switches = result.evaluation.states.switches
        return self._path_state(self.corrector.tangent(state, self.scale, row, switches))

    def _path_state(self, solution: Corrected | None) -> PathState | None:
        if solution is None:
            return None
        return PathState(solution.point, solution.direction * self.scale)

    def _is_between(self, solution: Corrected) -> bool:
        """Whether a solution lies between both ends, no contact beyond its limit."""
        if not self.curve.single_valued:
            return True
        low, high = sorted((self.left.state[-1], self.right.state[-1]))
        beyond = max(low - solution.point[-1], solution.point[-1] - high)
        return beyond <= _ROUND_OFF * self.scale[-1] and not solution.crosses


@Loop
def _at(left, right, first, last, share: float, result) -> None:
    """Write the cubic at a share of a segment."""
    for k in range(len(left)):
        result[k] = interpolation.cubic_at(left[k], right[k], (first[k], last[k]), share)


@Loop
def _beside(state, direction, normal, scale, distance: float, result) -> None:
    """Write what the tangent of a solution predicts at a distance along a normal."""
    step = distance / ahead(direction, normal, scale)
    for k in range(len(state)):
        result[k] = state[k] + step * direction[k]


@Loop
def _along(start, normal, scale, distance: float, result) -> None:
    """Write the point at a distance from a start along a scaled normal."""
    for k in range(len(start)):
        result[k] = start[k] + distance * normal[k] * scale[k]


def is_beyond(margins: FloatArray, switches: NDArray[np.bool_], tolerance: float) -> bool:
    """Whether a margin is beyond the limit of its held state by more than a tolerance."""
    outward = np.where(switches, -margins, margins)
    return bool((np.isfinite(margins) & (outward > tolerance)).any())


def has_other_states(result: NewtonResult, switches: NDArray[np.bool_], tolerance: float) -> bool:
    """Whether a contact is in another state at a free solution, by more than a tolerance."""
    states = result.evaluation.states
    return bool((states.switches != switches)[np.abs(states.margins) > tolerance].any())
