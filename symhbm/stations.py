"""Solutions between two points of a path: interpolated to third order, and solved for.

Between two events the path is smooth and its tangent is known at every point, so that a cubic
tells where something happens and a correction across the path finds the solution there.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from symhbm.corrector import Corrected, Corrector, hyperplane, unit_parameter
from symhbm.events import crossed
from symhbm.fourier import FloatArray
from symhbm.hermite import cubic, cubic_slope
from symhbm.newton import newton


@dataclass(frozen=True)
class Station:
    """A solution and its tangent in the direction of the path, both (n_unknowns + 1,)."""

    state: FloatArray
    direction: FloatArray


class Between:
    """The path between two of its solutions, no event in between, contact states ``slip`` held."""

    def __init__(
        self, corrector: Corrector, left: Station, right: Station, slip: NDArray[np.bool_]
    ):
        self.corrector = corrector
        self.curve = corrector.curve
        self.left, self.right, self.slip = left, right, slip
        self.scale = self.curve.scale(left.state)
        normal = left.direction / self.scale
        normal /= np.linalg.norm(normal)
        chord = (right.state - left.state) / self.scale
        if self.curve.single_valued and np.dot(normal, chord) < np.linalg.norm(chord) / 2:
            # The path turns sharply in between: only the parameter tells where one is.
            normal = np.sign(left.direction[-1]) * unit_parameter(len(self.scale))
        self.normal, self.length = normal, float(np.dot(normal, chord))

    def interpolate(self, share: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Cubic interpolant at shares (n,) of the way, and its derivative by the share.

        Two arrays (n, n_unknowns + 1).
        """
        left, right = (
            self.length
            * station.direction
            / max(np.dot(self.normal, station.direction / self.scale), 1e-3)
            for station in (self.left, self.right)
        )
        ends = self.left.state, self.right.state, (left, right), share[:, None]
        return cubic(*ends), cubic_slope(*ends)

    def solve(self, share: float) -> Station | None:
        """The solution at a share of the way, None where there is none to be found."""
        left, right = self.left.state, self.right.state
        guess = self.interpolate(np.array([share]))[0][0]
        if self.curve.single_valued:
            guess[-1] = np.clip(guess[-1], *sorted((left[-1], right[-1])))
        anchor = left + share * self.length * self.normal * self.scale
        plane = hyperplane(anchor, self.scale, self.normal)
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
        return low <= found.point[-1] <= high and not crossed(found.evaluation, self.slip).any()
