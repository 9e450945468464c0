"""Solutions between two points of a path: interpolated to third order, and solved for.

Between two events the path is smooth and its tangent is known at every point, so that a cubic
tells where something happens and a correction across the path finds the solution there.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.constraints import Corrected, Hyperplane, unit_parameter
from symhbm.corrector import Corrector
from symhbm.fourier import FloatArray
from symhbm.hermite import cubic, cubic_slope
from symhbm.newton import newton

_NEAR = 0.01
"""Distance as a share of the way below which a tangent tells more than the cubic."""


@dataclass(frozen=True)
class Station:
    """A solution and its tangent in the direction of the path, both (n_unknowns + 1,)."""

    state: FloatArray
    direction: FloatArray


class Measure(NamedTuple):
    """How stretches of a path are measured, arrays (..., n_unknowns + 1), ``length`` (..., 1).

    The scaled ``normal`` of the planes across a stretch, its ``length`` along it, and the
    derivatives of the state by the share of the way at both ends.
    """

    normal: FloatArray
    length: FloatArray
    left: FloatArray
    right: FloatArray


def measure(single_valued: bool, left: Station, right: Station, scale: FloatArray) -> Measure:
    """The measure of one or several stretches, ``scale`` that of their left ends."""
    normal = left.direction / scale
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    chord = (right.state - left.state) / scale
    length = np.sum(normal * chord, axis=-1, keepdims=True)
    if single_valued:
        # Where the path turns sharply in between only the parameter tells where one is.
        sharp = length < np.linalg.norm(chord, axis=-1, keepdims=True) / 2
        heading = np.sign(left.direction[..., -1:])
        normal = np.where(sharp, heading * unit_parameter(scale.shape[-1]), normal)
        length = np.where(sharp, heading * chord[..., -1:], length)
    slopes = [
        length
        * station.direction
        / np.maximum(np.sum(normal * station.direction / scale, axis=-1, keepdims=True), 1e-3)
        for station in (left, right)
    ]
    return Measure(normal, length, *slopes)


class Between:
    """The path between two of its solutions, no event in between, contact states ``slip`` held."""

    def __init__(
        self, corrector: Corrector, left: Station, right: Station, slip: NDArray[np.bool_]
    ):
        self.corrector = corrector
        self.curve = corrector.curve
        self.left, self.right, self.slip = left, right, slip
        self.scale = self.curve.scale(left.state)
        measured = measure(self.curve.single_valued, left, right, self.scale)
        self.normal, self.length = measured.normal, float(measured.length[0])
        self._slopes = measured.left, measured.right

    def interpolate(self, share: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Cubic interpolant at shares (n,) of the way, and its derivative by the share.

        Two arrays (n, n_unknowns + 1).
        """
        ends = self.left.state, self.right.state, self._slopes, share[:, None]
        return cubic(*ends), cubic_slope(*ends)

    def solve(self, share: float, near: tuple[float, Station] | None = None) -> Station | None:
        """The solution at a share of the way, None where there is none to be found.

        ``near`` may be another share and the solution there.
        """
        left, right = self.left.state, self.right.state
        guess = cubic(left, right, self._slopes, share)
        if near is not None and abs(share - near[0]) < _NEAR:
            along = near[1].direction
            ahead = max(float(np.dot(self.normal, along / self.scale)), 1e-3)
            guess = near[1].state + (share - near[0]) * self.length / ahead * along
        if self.curve.single_valued:
            guess[-1] = np.clip(guess[-1], *sorted((left[-1], right[-1])))
        anchor = left + share * self.length * self.normal * self.scale
        plane = Hyperplane(anchor, self.scale, self.normal)
        found = self.corrector.correct(guess, self.scale, plane, self.slip, precision=1e-10)
        if found is not None and self._holds(found):
            return Station(found.point, found.direction * self.scale)
        if not self.curve.single_valued:
            return None
        result = newton(lambda unknowns: self.curve.evaluate(unknowns, guess[-1]), guess[:-1])
        self.corrector.solves += result.iterations
        if not result.converged:
            return None
        state = np.append(result.unknowns, guess[-1])
        row = np.sign(self.left.direction[-1]) * unit_parameter(len(self.scale))
        slip = result.evaluation.friction.slip
        tangent = self.corrector.tangent(state, self.scale, row, slip)
        return None if tangent is None else Station(state, tangent.direction * self.scale)

    def _holds(self, found: Corrected) -> bool:
        """Whether a solution lies between the two others, no contact beyond its limit."""
        if not self.curve.single_valued:
            return True
        low, high = sorted((self.left.state[-1], self.right.state[-1]))
        return low <= found.point[-1] <= high and not found.crosses
