"""Functions of the frequency as a sum over poles near a band and a polynomial.

A condensed stiffness has as many poles as the interior has modes; only those near a band vary
quickly within it. All others together are a polynomial, to round-off: the cost of a frequency does
not depend on the number of modes.
"""

from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from symhbm.model.records import record
from symhbm.numerics import ComplexArray, FloatArray

_NEAR = 3.0
"""Sum of the half axes, over half the band, of the ellipse around it whose poles are kept."""
_TERMS = 40
"""Terms of the polynomial: the truncation error falls as a power of `_NEAR`, to 1e-19."""
_ROUND_OFF = 1e-17
"""Size of a term, relative to the largest one, that is left out."""
OUTSIDE = 1e-9
"""Distance beyond the ends of a band, over half of it, that is round-off."""


@record
class PoleSum(NamedTuple):
    """``P(p) - sum_k left_k(p) right_k(p) / (p - pole_k)`` at ``p = i s``, (n_rows, n_columns).

    ``polynomial`` (3, n_rows, n_columns), ``left`` (3, n_rows, n_poles) and ``right``
    (3, n_poles, n_columns) are the coefficients of 1, ``p`` and ``p^2``; ``poles`` (n_poles,)
    [rad/s].
    """

    polynomial: ComplexArray
    left: ComplexArray
    right: ComplexArray
    poles: ComplexArray

    def __call__(self, s: float) -> ComplexArray:
        """The sum over all poles at one angular frequency [rad/s]."""
        polynomial, left, right = (at(part, 1j * s) for part in self[:3])
        return polynomial - (left / (1j * s - self.poles)) @ right

    def terms(self, s: float) -> FloatArray:
        """The sum of the absolute values of all terms."""
        polynomial, left, right = (np.abs(at(part, 1j * s)) for part in self[:3])
        return polynomial + (left / np.abs(1j * s - self.poles)) @ right

    def conjugate(self) -> "PoleSum":
        """The function whose value at ``s`` is the conjugate of that of this one at ``-s``."""
        return PoleSum(*(part.conj() for part in self))

    def of(self, chosen: NDArray[np.bool_]) -> "PoleSum":
        """The polynomial with some of the poles only."""
        left, right = self.left[:, :, chosen], self.right[:, chosen]
        return PoleSum(self.polynomial, left, right, self.poles[chosen])


def at(coefficients: ComplexArray, p: complex) -> ComplexArray:
    """Value of coefficients of 1, ``p`` and ``p^2``."""
    return coefficients[0] + p * coefficients[1] + p**2 * coefficients[2]


class PoleResidueFunction:
    """A `PoleSum` that is fast within one ``band`` (first, last) [rad/s], and its derivative.

    Nothing is fitted: terms of poles near the band are kept, the others become the polynomial.

    Attributes
    ----------
    middle, half
        Of the band [rad/s].
    terms : (n_terms, 4 n_rows n_columns)
        Chebyshev polynomial of the value, then of the derivative: by rows, real and imaginary
        parts side by side.
    poles : (n_poles,)
        Those near the band [rad/s].
    left, right : (n_rows, n_poles), (n_poles, n_columns)
        Factors of their terms ``left right / (i s - pole)``.
    """

    def __init__(self, whole: PoleSum, band: tuple[float, float]):
        self.middle, self.half = (band[0] + band[1]) / 2, (band[1] - band[0]) / 2
        position = (-1j * whole.poles - self.middle) / self.half
        root = np.sqrt(position**2 - 1)
        close = np.maximum(np.abs(position + root), np.abs(position - root)) < _NEAR
        near, far = whole.of(close), whole.of(~close)
        self.shape = whole.polynomial.shape[1:]
        self.poles = poles = near.poles
        self.left = -_diagonal(near.left, poles)
        self.right = _diagonal(near.right.transpose(0, 2, 1), poles).T.copy()

        def smooth(s: float) -> ComplexArray:
            """The function without the poles: their factors vary along the band."""
            p = 1j * s
            moved_right = near.right[1] + near.right[2] * (p + poles)[:, None]
            moved_left = near.left[1] + near.left[2] * (p + poles)
            return far(s) - at(near.left, p) @ moved_right - moved_left @ self.right

        angle = np.pi * (np.arange(_TERMS) + 0.5) / _TERMS
        values = np.array([smooth(s) for s in self.middle + self.half * np.cos(angle)])
        weights = 2 / _TERMS * np.cos(np.outer(np.arange(_TERMS), angle))
        weights[0] /= 2
        terms = np.tensordot(weights, values, 1)
        size = np.abs(terms).max(axis=(1, 2))
        n_terms = 2 + int(np.flatnonzero(size > _ROUND_OFF * size.max())[-1])
        terms = terms[: max(n_terms, 2)]
        slopes = np.zeros_like(terms)
        slopes[:-1] = chebyshev.chebder(terms) / self.half
        # Real and imaginary parts side by side: the weights of the terms are real.
        both = np.stack([terms, slopes], axis=1).reshape(len(terms), -1)
        self.terms = both.view(float)
        self._bends = np.zeros_like(terms)
        self._bends[:-2] = chebyshev.chebder(terms, 2) / self.half**2
        self._last: tuple[float, tuple[ComplexArray, ComplexArray]] | None = None

    def __call__(self, s: float) -> tuple[ComplexArray, ComplexArray]:
        """Value and derivative by ``s``, an angular frequency within the band [rad/s].

        ArithmeticError outside the band, and on a pole. What is returned is not to be written to.
        """
        last = self._last
        if last is not None and last[0] == s:
            return last[1]
        weights, inverse = self._weights(s)
        value, slope = (weights @ self.terms).view(complex).reshape(2, *self.shape)
        factors = np.stack([inverse, -1j * inverse**2])
        near = (self.left * factors[:, None]).reshape(2 * self.shape[0], len(inverse)) @ self.right
        value += near[: self.shape[0]]
        slope += near[self.shape[0] :]
        # A point is evaluated several times.
        self._last = s, (value, slope)
        return value, slope

    def curvature(self, s: float) -> ComplexArray:
        """Second derivative by ``s`` [rad/s], (n_rows, n_columns); raises as a value does."""
        weights, inverse = self._weights(s)
        smooth = np.tensordot(weights, self._bends, 1)
        return smooth - 2 * (self.left * inverse**3) @ self.right

    def _weights(self, s: float) -> tuple[FloatArray, ComplexArray]:
        """Weights (n_terms,) of the polynomial and ``1 / (i s - pole)`` (n_poles,)."""
        position, gap = (s - self.middle) / self.half, 1j * s - self.poles
        if abs(position) > 1 + OUTSIDE:
            raise ArithmeticError(f"{s / (2 * np.pi):g} Hz is outside the band of the condensation")
        if not gap.all():
            raise ZeroDivisionError(f"{s / (2 * np.pi):g} Hz is a resonance of the held structure")
        angles = np.arange(len(self.terms)) * np.arccos(np.clip(position, -1, 1))
        return np.cos(angles), 1 / gap


def _diagonal(coefficients: ComplexArray, poles: ComplexArray) -> ComplexArray:
    """Each column (n_rows, n_poles) at its own pole."""
    return coefficients[0] + coefficients[1] * poles + coefficients[2] * poles**2
