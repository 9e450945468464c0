"""Solutions between two points of a path: interpolated to third order, and solved for.

Between two events the path is smooth and its tangent is known at every point, so that a cubic
tells where something happens and a correction across the path finds the solution there.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors import Corrected, Corrector, Hyperplane, unit_parameter
from symhbm.numerics import FloatArray, cubic, cubic_slope

_ACROSS = 0.5
"""Part of a tangent along the mean of those at both ends below which planes do not tell places."""
_CLEARLY = 1e-7
"""Motion beyond its limit, relatively, of a contact that is in another state."""
_NEAR = 0.01
"""Distance as a share of the way below which a tangent tells more than the cubic."""


@dataclass(frozen=True)
class PathState:
    """A solution, or several, and its tangent along the path, both (..., n_unknowns + 1)."""

    state: FloatArray
    direction: FloatArray

    def __getitem__(self, index: Any) -> Self:
        return type(self)(*(getattr(self, field.name)[index] for field in fields(self)))

    def bare(self) -> "PathState":
        """Solution and tangent alone."""
        return PathState(self.state, self.direction)

    @classmethod
    def stacked(cls, several: Sequence[Self]) -> Self:
        """Single ones in one."""
        names = [field.name for field in fields(cls)]
        return cls(*(np.array([getattr(each, name) for each in several]) for name in names))

    @classmethod
    def joined(cls, several: Sequence[Self]) -> Self:
        """Several in one, of arrays along the first axis."""
        names = [field.name for field in fields(cls)]
        return cls(*(np.concatenate([getattr(s, name) for s in several]) for name in names))


class Measure(NamedTuple):
    """How stretches of a path are measured, arrays (..., n_unknowns + 1), ``length`` (..., 1).

    The scaled ``normal`` of the planes across a stretch, its ``length`` along it, and the
    derivatives of the state by the share of the way at both ends.
    """

    normal: FloatArray
    length: FloatArray
    left: FloatArray
    right: FloatArray

    def take(self, index: Any) -> Self:
        """Some of them."""
        return type(self)(*(values[index] for values in self))


def measure(single_valued: bool, left: PathState, right: PathState, scale: FloatArray) -> Measure:
    """The measure of one or several stretches, ``scale`` that of their left ends."""
    units = [_unit(station.direction / scale) for station in (left, right)]
    both = units[0] + units[1]
    # Planes across the mean of both tangents meet a path that turns by up to half a circle once.
    opposite = np.linalg.norm(both, axis=-1, keepdims=True) < 2 * _ACROSS
    normal = _unit(np.where(opposite, units[0], both))
    chord = (right.state - left.state) / scale
    length = np.sum(normal * chord, axis=-1, keepdims=True)
    if single_valued:
        # Where the path turns sharply in between only the parameter tells where one is.
        sharp = opposite | (length < np.linalg.norm(chord, axis=-1, keepdims=True) / 2)
        heading = np.sign(left.direction[..., -1:])
        normal = np.where(sharp, heading * unit_parameter(scale.shape[-1]), normal)
        length = np.where(sharp, heading * chord[..., -1:], length)
    slopes = [length * along(station, normal, scale) for station in (left, right)]
    return Measure(normal, length, *slopes)


def along(station: PathState, normal: FloatArray, scale: FloatArray) -> FloatArray:
    """Derivatives of the state by the distance along a ``normal``, (..., n_unknowns + 1)."""
    return station.direction / ahead(station, normal, scale)


def ahead(station: PathState, normal: FloatArray, scale: FloatArray) -> FloatArray:
    """Advance along a ``normal`` by the tangent of a station, (..., 1), no less than a little."""
    return np.maximum(np.sum(normal * station.direction / scale, axis=-1, keepdims=True), 1e-3)


def _unit(vectors: FloatArray) -> FloatArray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


class Segment:
    """The path between two of its solutions, no event in between, contact states ``slip`` held.

    ``other_states`` tells that a contact was found in another state there, for a moment.
    """

    def __init__(
        self,
        corrector: Corrector,
        left: PathState,
        right: PathState,
        slip: NDArray[np.bool_],
        scale: FloatArray | None = None,
        measured: Measure | None = None,
    ):
        self.corrector = corrector
        self.curve = corrector.curve
        self.left, self.right, self.slip = left, right, slip
        self.scale = self.curve.scale(left.state) if scale is None else scale
        if measured is None:
            measured = measure(self.curve.single_valued, left, right, self.scale)
        self.normal, self.length = measured.normal, float(measured.length[0])
        self.other_states = False
        self._slopes = measured.left, measured.right

    def interpolate(self, share: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Cubic interpolant at shares (n,) of the way, and its derivative by the share.

        Two arrays (n, n_unknowns + 1).
        """
        ends = self.left.state, self.right.state, self._slopes, share[:, None]
        return cubic(*ends), cubic_slope(*ends)

    def solve(
        self,
        share: float,
        near: tuple[float, PathState] | None = None,
        precision: float = 1e-10,
    ) -> PathState | None:
        """The solution at a share of the way, None where there is none to be found.

        ``near`` may be another share and the solution there. At an end it is the end itself, with
        its tangent computed anew.
        """
        if share in (0.0, 1.0):
            end = self.right if share else self.left
            return self._with_tangent(end.state, self.normal, self.slip)
        left, right = self.left.state, self.right.state
        guess = cubic(left, right, self._slopes, share)
        if near is not None and abs(share - near[0]) < _NEAR:
            way = (share - near[0]) * self.length
            guess = near[1].state + way * along(near[1], self.normal, self.scale)
        if self.curve.single_valued:
            guess[-1] = np.clip(guess[-1], *sorted((left[-1], right[-1])))
        anchor = left + share * self.length * self.normal * self.scale
        plane = Hyperplane(anchor, self.scale, self.normal)
        found = self.corrector.correct(guess, self.scale, plane, self.slip, precision)
        if found is None or not self._holds(found):
            return None
        return PathState(found.point, found.direction * self.scale)

    def solve_between(self, share: float) -> PathState | None:
        """A solution strictly between both ends, at or near a share of the way.

        Where planes across the path do not tell, at a value of the parameter, contacts free.
        """
        found = self.solve(share, precision=1e-6)
        if found is not None or not self.curve.single_valued:
            return found
        (guess, *_), _ = self.interpolate(np.array([share]))
        low, high = sorted((self.left.state[-1], self.right.state[-1]))
        if not low < guess[-1] < high:
            guess[-1] = (low + high) / 2
        result = self.corrector.free(guess[:-1], float(guess[-1]))
        if not result.converged:
            return None
        state = np.append(result.unknowns, guess[-1])
        row = np.sign(self.left.direction[-1]) * unit_parameter(len(self.scale))
        slip, slip_margin = result.evaluation.friction.slip, result.evaluation.friction.slip_margin
        self.other_states |= bool(np.any((slip != self.slip) & (np.abs(slip_margin) > _CLEARLY)))
        return self._with_tangent(state, row, slip)

    def _with_tangent(
        self, state: FloatArray, row: FloatArray, slip: NDArray[np.bool_]
    ) -> PathState | None:
        found = self.corrector.tangent(state, self.scale, row, slip)
        return None if found is None else PathState(state, found.direction * self.scale)

    def _holds(self, found: Corrected) -> bool:
        """Whether a solution lies between the two others, no contact beyond its limit."""
        if not self.curve.single_valued:
            return True
        low, high = sorted((self.left.state[-1], self.right.state[-1]))
        return low <= found.point[-1] <= high and not found.crosses
