"""Angles where motions, or their derivatives, cross a level in monotone intervals."""

from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from symhbm.numerics.arrays import FloatArray
from symhbm.numerics.fourier import FourierBasis

MACHINE = np.finfo(float).eps
"""Round-off of double precision."""
_STEPS = 6
"""Free steps before the search is bracketed: one to three suffice."""


class Motions:
    """Motions (n_motions, n_components), with their phasors and bounds.

    ``phasors`` (n_motions, n_harmonics) are those of `FourierBasis.phasors`; ``bounds``
    (n_motions, 5), those of the derivatives 0 to 4.
    """

    def __init__(self, basis: FourierBasis, coefficients: FloatArray):
        self.basis = basis
        self.coefficients = coefficients
        self.bounds = basis.bounds(coefficients)

    @cached_property
    def phasors(self) -> NDArray[np.complex128]:
        """Complex amplitudes."""
        return self.basis.phasors(self.coefficients)

    def of(self, motions: NDArray[np.intp] | slice) -> "Motions":
        """The chosen motions alone."""
        return Motions(self.basis, self.coefficients[motions])

    def crossings(
        self,
        owner: NDArray[np.intp],
        derivative: int,
        level: FloatArray,
        left: FloatArray,
        right: FloatArray,
        rising: NDArray[np.bool_],
        start: FloatArray,
    ) -> FloatArray:
        """Angles [rad] between ``left`` and ``right`` where a derivative crosses a level.

        All arrays are of shape ``(n,)``: ``owner`` tells the motion, ``rising`` on which side of
        the level the left end is. The crossing is unique in its interval: one that
        free steps of third order reach inside it is correct, all others are bracketed.
        """
        basis, phasors, bounds = self.basis, self.phasors[owner], self.bounds[owner]
        # The next error is that of a parabola: a sixth of the third derivative times step cubed.
        tolerance = 6 * MACHINE / bounds[:, derivative + 3]
        root, settled = start, np.zeros(len(start), dtype=bool)
        with np.errstate(divide="ignore", invalid="ignore"):
            for _ in range(_STEPS):
                value, slope, bend = basis.derivatives(phasors, root, derivative).T
                newton = (level - value) / slope
                # To the root of the parabola: next to a turning point a tangent overshoots.
                step = 2 * newton / (1 + np.sqrt(np.maximum(1 + 2 * newton * bend / slope, 0.0)))
                root = root + step
                settled = np.abs(step * step * step / slope) < tolerance
                if settled.all():
                    break
            done = settled & (root >= left) & (root <= right)
        if done.all():
            return root
        lost = ~done
        phasors, level = phasors[lost], level[lost]

        def value_and_slope(tau: FloatArray) -> tuple[FloatArray, FloatArray]:
            derivatives = basis.derivatives(phasors, tau, derivative)
            return derivatives[:, 0] - level, derivatives[:, 1]

        left, right = left[lost], right[lost]
        noise = MACHINE * bounds[lost, derivative]
        middle = (left + right) / 2
        root[lost] = monotone_root(value_and_slope, left, right, rising[lost], middle, noise)
        return root


def monotone_root(
    function: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
    left: FloatArray,
    right: FloatArray,
    rising: np.ndarray,
    start: FloatArray,
    noise: FloatArray,
) -> FloatArray:
    """Zeros of monotone functions, one in each interval: Newton's method kept inside a bracket.

    ``function`` gives values and slopes, ``noise`` is the round-off of the values; all arrays have
    the shape ``(n,)``.
    """
    root = np.clip(start, left, right)
    for _ in range(80):
        value, slope = function(root)
        after = (value > 0) == rising
        right = np.where(after, root, right)
        left = np.where(after, left, root)
        new = root - value / np.where(slope == 0, np.inf, slope)
        inside = (new >= left) & (new <= right) & (slope != 0)
        new = np.where(inside, new, (left + right) / 2)
        step = np.abs(new - root)
        root = new
        if np.all((step <= 4 * MACHINE * (1 + np.abs(root))) | (np.abs(value) <= noise)):
            break
    return root
