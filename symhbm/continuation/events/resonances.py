"""Resonance finder: narrow resonances between two points of a path that neither point shows.

Where the response is smooth, steps are long, and a step may pass over a lightly damped mode. The
modes of the structure with its contacts at their present stiffness place such resonances.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors import Corrected
from symhbm.continuation.events.modes import Modes, modes
from symhbm.continuation.point import PathPoint
from symhbm.continuation.problem import ContinuationProblem
from symhbm.numerics import FloatArray

_FELT = 2.0
"""Distance from a resonance ahead, in half widths, up to which it changes the path."""
_AT_RESONANCE = 0.3
"""Distance from a resonance, in half widths, up to which a point represents it."""
_SPANNED = 3.0
"""Longest step between both flanks of a resonance without a point at its peak, in half widths."""


class ResonanceFinder:
    """Finds resonances between the last point of a path and the next."""

    def __init__(self, curve: ContinuationProblem):
        self._curve = curve
        self._cached: list[tuple[FloatArray, Any, Modes | None]] = []

    def first_passed(self, base: PathPoint, solution: Corrected) -> float | None:
        """Share of a step at which the first resonance lies that neither of its ends shows."""
        if base.resonances_below is None or base.resonances_below == solution.resonances_below:
            return None  # as many natural frequencies below each harmonic: none was passed
        passed = None
        if solution.resonances_below is not None:
            below = zip(base.resonances_below, solution.resonances_below, strict=True)
            passed = [(min(both), max(both)) for both in below]
        before = self._modes_at(base.state, base.switches, base.springs, passed)
        after = self._modes_at(solution.point, base.switches, solution.springs, passed)
        if before is None or after is None:
            return None
        # A mode near only one end keeps the natural frequency that it has there.
        change = after.exciting - before.exciting
        left = np.where(after.near & ~before.near, after.detuning + change, before.detuning)
        right = np.where(before.near & ~after.near, before.detuning - change, after.detuning)
        width = np.minimum(before.width, after.width)
        # A point beside the peak, on either side, represents it.
        nearest = np.minimum(np.abs(left), np.abs(right))
        passed = (left * right < 0) & (nearest > _AT_RESONANCE * width)
        passed &= (np.abs(left) > _FELT * width) | (np.abs(left - right) > _SPANNED * width)
        passed &= before.excited | after.excited
        if not passed.any():
            return None
        distance, width = np.abs(left[passed]), width[passed]
        # The flank first, then the peak: its two flanks change the response in opposite senses.
        aim = np.where(distance > 2 * _FELT * width, distance - 1.5 * _FELT * width, distance)
        return float((aim / np.abs(left - right)[passed]).min())

    def _modes_at(
        self,
        state: FloatArray,
        switches: NDArray[np.bool_],
        springs: FloatArray | None,
        passed: list[tuple[int, int]] | None,
    ) -> Modes | None:
        for known, of, at_state in self._cached:
            if of == passed and np.array_equal(known, state):
                return at_state
        at_state = modes(self._curve, state[:-1], float(state[-1]), switches, springs, passed)
        # A shorter step starts at the same point.
        self._cached = [(state, passed, at_state), *self._cached[:2]]
        return at_state
