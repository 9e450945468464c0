"""Segments of a path between two of its points: cubic interpolation and solutions in between.

Between two events the path is smooth and its tangent is known at every point. So a cubic predicts
a solution between two points, and a correction across the path solves for it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors import Corrected, Corrector, Hyperplane, unit_parameter
from symhbm.numerics import FloatArray, cubic, cubic_slope

_ACROSS = 0.5
"""Cosine of half the angle between both tangents below which their mean is no normal of planes."""
_CLEARLY = 1e-7
"""Slip margin beyond which a contact is in another state, and not by round-off."""
_ROUND_OFF = 1e-12
"""Distance beyond an end, relative to the parameter, of a solution that is the end."""
_CLOSE = 0.01
"""Share of the segment within which the tangent of a neighbour predicts better than the cubic."""


@dataclass(frozen=True)
class PathState:
    """One solution or several, with the tangent along the path, both (..., n_unknowns + 1)."""

    state: FloatArray
    direction: FloatArray

    def __getitem__(self, index: Any) -> Self:
        return type(self)(*(getattr(self, field.name)[index] for field in fields(self)))

    def bare(self) -> "PathState":
        """Solution and tangent alone."""
        return PathState(self.state, self.direction)

    @classmethod
    def stacked(cls, states: Sequence[Self]) -> Self:
        """Several states of one solution each, along a new first axis."""
        names = [field.name for field in fields(cls)]
        return cls(*(np.array([getattr(state, name) for state in states]) for name in names))

    @classmethod
    def joined(cls, states: Sequence[Self]) -> Self:
        """Several states of many solutions each, along the first axis."""
        names = [field.name for field in fields(cls)]
        return cls(*(np.concatenate([getattr(s, name) for s in states]) for name in names))


class Measure(NamedTuple):
    """Normals and lengths of one segment or several: (..., n_unknowns + 1), ``length`` (..., 1).

    The scaled ``normal`` of the planes across a segment, its ``length`` along the normal, and the
    derivatives of the state by the share of the length at both ends.
    """

    normal: FloatArray
    length: FloatArray
    left: FloatArray
    right: FloatArray

    def take(self, index: Any) -> Self:
        """Those of some of the segments."""
        return type(self)(*(values[index] for values in self))


def measure(single_valued: bool, left: PathState, right: PathState, scale: FloatArray) -> Measure:
    """Normals and lengths of one segment or several, in the ``scale`` of their left ends."""
    units = [_unit(end.direction / scale) for end in (left, right)]
    both = units[0] + units[1]
    # A path that turns by up to 180 degrees meets each plane across the mean tangent once.
    opposite = np.linalg.norm(both, axis=-1, keepdims=True) < 2 * _ACROSS
    normal = _unit(np.where(opposite, units[0], both))
    chord = (right.state - left.state) / scale
    length = np.sum(normal * chord, axis=-1, keepdims=True)
    if single_valued:
        # Along a path that turns sharply, only the parameter increases throughout.
        sharp = opposite | (length < np.linalg.norm(chord, axis=-1, keepdims=True) / 2)
        heading = np.sign(left.direction[..., -1:])
        normal = np.where(sharp, heading * unit_parameter(scale.shape[-1]), normal)
        length = np.where(sharp, heading * chord[..., -1:], length)
    slopes = [length * along(end, normal, scale) for end in (left, right)]
    return Measure(normal, length, *slopes)


def along(solution: PathState, normal: FloatArray, scale: FloatArray) -> FloatArray:
    """Derivatives of the state by the distance along a ``normal``, (..., n_unknowns + 1)."""
    return solution.direction / ahead(solution, normal, scale)


def ahead(solution: PathState, normal: FloatArray, scale: FloatArray) -> FloatArray:
    """Component of a tangent along a ``normal``, (..., 1), no less than a small positive number."""
    return np.maximum(np.sum(normal * solution.direction / scale, axis=-1, keepdims=True), 1e-3)


def _unit(vectors: FloatArray) -> FloatArray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


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

    def interpolate(self, share: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Cubic interpolant at shares (n,) of the length, and its derivative by the share.

        Two arrays (n, n_unknowns + 1).
        """
        ends = self.left.state, self.right.state, self._slopes, share[:, None]
        return cubic(*ends), cubic_slope(*ends)

    def solve(
        self,
        share: float,
        neighbour: tuple[float, PathState] | None = None,
        precision: float = 1e-10,
    ) -> PathState | None:
        """The solution at a share of the length, None where the correction fails.

        ``neighbour`` may be another share and the solution there. At an end the solution is the end
        itself, its tangent computed again.
        """
        if share in (0.0, 1.0):
            end = self.right if share else self.left
            return self._with_tangent(end.state, self.normal, self.switches)
        left, right = self.left.state, self.right.state
        guess = cubic(left, right, self._slopes, share)
        if neighbour is not None and abs(share - neighbour[0]) < _CLOSE:
            distance = (share - neighbour[0]) * self.length
            guess = neighbour[1].state + distance * along(neighbour[1], self.normal, self.scale)
        if self.curve.single_valued:
            guess[-1] = np.clip(guess[-1], *sorted((left[-1], right[-1])))
        anchor = left + share * self.length * self.normal * self.scale
        plane = Hyperplane(anchor, self.scale, self.normal)
        solution = self.corrector.correct(guess, self.scale, plane, self.switches, precision)
        if solution is None or not self._is_between(solution):
            return None
        if not self.curve.single_valued and solution.crosses:
            self.other_states |= self._is_beyond(solution.margins)
        return PathState(solution.point, solution.direction * self.scale)

    def solve_between(self, share: float) -> PathState | None:
        """A solution strictly between both ends, at or near a share of the length.

        Where the correction across the path fails, at a value of the parameter, contacts free.
        """
        solution = self.solve(share, precision=1e-6)
        if solution is not None or not self.curve.single_valued:
            return solution
        (guess, *_), _ = self.interpolate(np.array([share]))
        low, high = sorted((self.left.state[-1], self.right.state[-1]))
        if not low < guess[-1] < high:
            guess[-1] = (low + high) / 2
        result = self.corrector.free(guess[:-1], float(guess[-1]))
        if not result.converged:
            return None
        state = np.append(result.unknowns, guess[-1])
        row = np.sign(self.left.direction[-1]) * unit_parameter(len(self.scale))
        switches, margins = result.evaluation.states.switches, result.evaluation.states.margins
        self.other_states |= bool((switches != self.switches)[np.abs(margins) > _CLEARLY].any())
        return self._with_tangent(state, row, switches)

    def _with_tangent(
        self, state: FloatArray, row: FloatArray, switches: NDArray[np.bool_]
    ) -> PathState | None:
        tangent = self.corrector.tangent(state, self.scale, row, switches)
        return None if tangent is None else PathState(state, tangent.direction * self.scale)

    def _is_beyond(self, margins: FloatArray) -> bool:
        """Whether a contact is beyond a limit of its held states, and not by round-off."""
        outward = np.where(self.switches, -1.0, 1.0) * margins
        return bool(np.any(np.isfinite(margins) & (outward > _CLEARLY)))

    def _is_between(self, solution: Corrected) -> bool:
        """Whether a solution lies between both ends, no contact beyond its limit."""
        if not self.curve.single_valued:
            return True
        low, high = sorted((self.left.state[-1], self.right.state[-1]))
        beyond = max(low - solution.point[-1], solution.point[-1] - high)
        return beyond <= _ROUND_OFF * abs(high) and not solution.crosses
