"""Truncated Fourier series as arrays: basis, derivatives, interval integrals, extremes.

A displacement is ``x(tau) = sum_n a_n cos(n tau) + b_n sin(n tau)``, ``tau = omega t``. Its
coefficients are stored along one axis of length ``n_components``, harmonic by harmonic, cosine
before sine; harmonic 0 has a cosine only.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from numbers import Integral

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def check_harmonics(harmonics: Iterable[int]) -> tuple[int, ...]:
    """Return the harmonics as a sorted tuple of distinct integers, at least one of them above 0.

    Raises
    ------
    TypeError
        If ``harmonics`` is no sequence of integers.
    ValueError
        If it is empty, repeats a value, holds a negative one, or holds 0 alone.
    """
    message = f"harmonics={harmonics!r}: expected distinct integers >= 0, one of them >= 1"
    if isinstance(harmonics, (str, bytes)) or not isinstance(harmonics, Iterable):
        raise TypeError(f"{message}, for example (1,) or (1, 3, 5)")
    values = list(harmonics)
    if not all(isinstance(n, Integral) and not isinstance(n, bool) for n in values):
        raise TypeError(message)
    numbers = [int(n) for n in values]
    if len(set(numbers)) != len(numbers) or min(numbers, default=-1) < 0 or max(numbers) == 0:
        raise ValueError(message)
    return tuple(sorted(numbers))


def complete_harmonics(harmonics: tuple[int, ...], highest: int) -> tuple[int, ...]:
    """All harmonics up to ``highest`` that go with a set: odd multiples of its divisor, or all.

    Symmetric contacts answer odd harmonics with odd ones.
    """
    divisor = int(np.gcd.reduce(harmonics))
    odd = all(n // divisor % 2 for n in harmonics)
    return tuple(range(divisor if odd else 0, highest + 1, divisor * (1 + odd)))


@dataclass(frozen=True)
class FourierBasis:
    """The functions ``cos(n tau), sin(n tau)`` of a set of harmonics, one per component."""

    harmonics: tuple[int, ...]

    @cached_property
    def order(self) -> FloatArray:
        """Harmonic of each component, shape ``(n_components,)``."""
        return np.array([n for n in self.harmonics for _ in range(1 if n == 0 else 2)], dtype=float)

    @cached_property
    def is_sine(self) -> NDArray[np.bool_]:
        """Which components are sines, shape ``(n_components,)``."""
        return np.array(
            [s for n in self.harmonics for s in ((False,) if n == 0 else (False, True))]
        )

    @cached_property
    def n_components(self) -> int:
        """Number of coefficients of one degree of freedom."""
        return len(self.order)

    @cached_property
    def highest(self) -> int:
        """The highest harmonic."""
        return max(self.harmonics)

    @cached_property
    def has_one_harmonic(self) -> bool:
        """Whether a motion is one cosine (about a mean), so that its events have closed forms."""
        return sum(n > 0 for n in self.harmonics) == 1

    @cached_property
    def same_harmonic(self) -> FloatArray:
        """Matrix of 1 where two components belong to one harmonic, else 0."""
        return (self.order[:, None] == self.order).astype(float)

    def component(self, harmonic: int, sine: bool = False) -> int:
        """Position of the cosine (or sine) of ``harmonic`` among the components."""
        return int(np.flatnonzero((self.order == harmonic) & (self.is_sine == sine))[0])

    def values(self, tau: ArrayLike, derivative: int = 0) -> FloatArray:
        """Basis functions, or their derivative with respect to ``tau``, at the angles ``tau``.

        ``tau`` of shape ``(...)`` in rad gives an array of shape ``(..., n_components)``.
        """
        pick, factor = self._derivative_rules[derivative]
        return self.trigonometric(tau)[..., pick] * factor

    def trigonometric(self, tau: ArrayLike) -> FloatArray:
        """Cosines of all harmonics, then their sines: ``(..., 2 n_harmonics)``."""
        argument = np.asarray(tau, dtype=float)[..., None] * np.array(self.harmonics, dtype=float)
        return np.concatenate([np.cos(argument), np.sin(argument)], axis=-1)

    def weights(self, coefficients: FloatArray, derivative: int = 0) -> FloatArray:
        """Factors of `trigonometric` that give a derivative of the motions, same leading shape."""
        pick, factor = self._derivative_rules[derivative]
        weights = np.zeros((*coefficients.shape[:-1], 2 * len(self.harmonics)))
        weights[..., pick] = coefficients * factor
        return weights

    @cached_property
    def _derivative_rules(self) -> list[tuple[NDArray[np.intp], FloatArray]]:
        """Per derivative: which of all cosines and sines, and times what."""
        rules = []
        harmonic = np.searchsorted(self.harmonics, self.order)
        for derivative in range(4):
            quarter = (derivative - self.is_sine) % 4
            sign = np.where((quarter == 1) | (quarter == 2), -1.0, 1.0)
            pick = harmonic + len(self.harmonics) * (quarter % 2)
            rules.append((pick, sign * self.order**derivative))
        return rules

    @cached_property
    def derivative_matrix(self) -> FloatArray:
        """Matrix that maps the coefficients of ``x`` to those of ``dx/dtau``."""
        matrix = np.zeros((self.n_components, self.n_components))
        for n in self.harmonics:
            if n > 0:
                cosine, sine = self.component(n), self.component(n, sine=True)
                matrix[cosine, sine], matrix[sine, cosine] = n, -n
        return matrix

    @cached_property
    def norm(self) -> FloatArray:
        """Factor that makes an integral over a period a coefficient, shape ``(n_components,)``."""
        return np.where(self.order == 0, 0.5, 1.0) / np.pi

    @cached_property
    def _moments_to_components(self) -> NDArray[np.intp]:
        size = 2 * self.highest + 1
        return (self.order + size * self.is_sine).astype(np.intp)

    @cached_property
    def _moments_to_products(self) -> FloatArray:
        """Matrix from trigonometric moments to the integrals of products of basis functions."""
        size = 2 * self.highest + 1
        products = np.zeros((2 * size, self.n_components, self.n_components))
        order, is_sine = self.order.astype(int), self.is_sine
        for i in range(self.n_components):
            for j in range(self.n_components):
                # cos(pt - a) cos(qt - b) = [cos((p-q)t - (a-b)) + cos((p+q)t - (a+b))] / 2
                for sign in (-1, 1):
                    number = order[i] + sign * order[j]
                    quarter = int(is_sine[i]) + sign * int(is_sine[j])
                    if number < 0:
                        number, quarter = -number, -quarter
                    factor = (1, 1, -1, -1)[quarter % 4] / 2
                    products[number + size * (quarter % 2), i, j] += factor
        return products.reshape(2 * size, -1)

    def moments(self, angle: FloatArray) -> FloatArray:
        """Integrals of ``cos(k tau)``, then ``sin(k tau)``, ``k = 0 .. 2 highest``, per interval.

        ``angle`` of shape ``(..., n_intervals + 1)`` in rad holds the ends of the intervals; the
        result has the shape ``(..., n_intervals, 2 (2 highest + 1))``.
        """
        k = np.arange(1, 2 * self.highest + 1)
        width = np.diff(angle, axis=-1)[..., None]
        middle = k * (angle[..., :-1, None] + width / 2)
        # The difference of two sines as a product, which keeps its digits on short intervals.
        factor = 2 / k * np.sin(k * width / 2)
        return np.concatenate(
            [width, factor * np.cos(middle), np.zeros_like(width), factor * np.sin(middle)], axis=-1
        )

    def integrals(self, moments: FloatArray) -> FloatArray:
        """Coefficients of the function that is 1 on the intervals: ``(..., n_components)``."""
        return moments[..., self._moments_to_components] * self.norm

    def products(self, moments: FloatArray) -> FloatArray:
        """Matrix that maps coefficients of ``y`` to those of ``y`` restricted to the intervals.

        ``moments`` of shape ``(..., n_moments)`` gives ``(..., n_components, n_components)``.
        """
        size = self.n_components
        flat = moments @ self._moments_to_products
        return flat.reshape(*moments.shape[:-1], size, size) * self.norm[:, None]
