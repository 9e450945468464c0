"""Truncated Fourier series as arrays: basis, derivatives, interval integrals.

A displacement is ``x(tau) = sum_n a_n cos(n tau) + b_n sin(n tau)``, ``tau = omega t``. Its
coefficients are stored along one axis of length ``n_components``, harmonic by harmonic, cosine
before sine; harmonic 0 has a cosine only.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symhbm.numerics.check import FloatArray


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
    divisor = math.gcd(*harmonics)
    odd = all(n // divisor % 2 for n in harmonics)
    return tuple(range(divisor if odd else 0, highest + 1, divisor * (1 + odd)))


def larger_set(harmonics: tuple[int, ...]) -> tuple[int, ...]:
    """The harmonics up to twice the highest and one, without those that symmetry forbids."""
    return complete_harmonics(harmonics, 2 * max(harmonics) + math.gcd(*harmonics))


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
        return np.diff(self.order, prepend=-1.0) == 0

    @cached_property
    def arrays(self) -> tuple[NDArray[np.int64], NDArray[np.bool_], FloatArray]:
        """As loops take it: orders, which components are sines, and norms, (n_components,) each."""
        return self.order.astype(np.int64), self.is_sine, self.norm

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
    def divisor(self) -> int:
        """Greatest common divisor of the harmonics: the number of equal periods in one."""
        return math.gcd(*self.harmonics)

    @cached_property
    def reduced(self) -> "FourierBasis":
        """The harmonics over their `divisor`: the same motions in one of their periods."""
        return FourierBasis(tuple(n // self.divisor for n in self.harmonics))

    @cached_property
    def identity(self) -> FloatArray:
        """Matrix that leaves coefficients as they are."""
        return np.eye(self.n_components)

    @cached_property
    def same_harmonic(self) -> FloatArray:
        """Matrix of 1 where two components belong to one harmonic, else 0."""
        return (self.order[:, None] == self.order).astype(float)

    def component(self, harmonic: int, sine: bool = False) -> int:
        """Position of the cosine (or sine) of ``harmonic`` among the components."""
        return self._places[harmonic, bool(sine)]

    @cached_property
    def _places(self) -> dict[tuple[int, bool], int]:
        names = zip(self.order.tolist(), self.is_sine.tolist(), strict=True)
        return {name: place for place, name in enumerate(names)}

    def by_harmonic(self, coefficients: FloatArray) -> list[FloatArray]:
        """Of coefficients (..., n_components) those of each harmonic, (..., 1 or 2)."""
        firsts = np.flatnonzero(~self.is_sine)[1:]
        return np.split(coefficients, firsts, axis=-1)

    @cached_property
    def mirrors(self) -> bool:
        """Whether all harmonics are odd: the second half period is then minus the first."""
        return all(n % 2 == 1 for n in self.harmonics)

    def values(self, tau: ArrayLike, derivative: int = 0) -> FloatArray:
        """Basis functions, or their derivative with respect to ``tau``, at the angles ``tau``.

        ``tau`` of shape ``(...)`` in rad gives an array of shape ``(..., n_components)``.
        Derivative -1 gives the integrals, without mean, and 0 for harmonic 0.
        """
        pick, factor = self._derivative_rules[derivative]
        turns = np.exp(np.multiply.outer(tau, self._imaginary))
        return turns.view(float).take(pick, axis=-1) * factor

    def phasors(self, coefficients: FloatArray) -> NDArray[np.complex128]:
        """Amplitudes ``a_n - i b_n`` of motions, one per harmonic: ``(..., n_harmonics)``."""
        return (coefficients @ self._parts).view(complex)

    def of_phasors(self, phasors: NDArray[np.complex128]) -> FloatArray:
        """Coefficients (..., n_components) of motions from their `phasors`."""
        return np.ascontiguousarray(phasors).view(float) @ self._parts.T

    @cached_property
    def _imaginary(self) -> NDArray[np.complex128]:
        return 1j * np.array(self.harmonics)

    @cached_property
    def _parts(self) -> FloatArray:
        """Matrix from coefficients to the real and imaginary parts of `phasors`, in turn."""
        matrix = np.zeros((self.n_components, 2 * len(self.harmonics)))
        column = 2 * np.searchsorted(self.harmonics, self.order) + self.is_sine
        matrix[np.arange(self.n_components), column] = np.where(self.is_sine, -1.0, 1.0)
        return matrix

    @cached_property
    def _derivative_rules(self) -> dict[int, tuple[NDArray[np.intp], FloatArray]]:
        """Per derivative: columns of real and imaginary parts of ``exp(i n tau)``, and factors."""
        rules = {}
        column = 2 * np.searchsorted(self.harmonics, self.order)
        for derivative in range(-1, 4):
            quarter = (derivative - self.is_sine) % 4
            sign = np.where((quarter == 1) | (quarter == 2), -1.0, 1.0)
            size = np.maximum(self.order, 1.0) ** derivative
            size[self.order == 0] = derivative == 0
            rules[derivative] = column + quarter % 2, sign * size
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
        """Matrix from trigonometric moments to the entries of `products`, column after column."""
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
                    products[number + size * (quarter % 2), j, i] += factor * self.norm[i]
        return products.reshape(2 * size, -1)

    def moments(self, angle: FloatArray) -> FloatArray:
        """Integrals of ``cos(k tau)``, then ``sin(k tau)``, ``k = 0 .. 2 highest``, per interval.

        ``angle`` of shape ``(..., n_intervals + 1)`` in rad holds the ends of the intervals; the
        result has the shape ``(..., n_intervals, 2 (2 highest + 1))``.
        """
        left, width = angle[..., :-1], np.diff(angle, axis=-1)
        half, (k, turn, factor) = width / 2, self._moment_factors
        # The difference of two sines as a product, which keeps its digits on short intervals.
        waves: Any = np.exp(np.multiply.outer(left + half, turn))
        waves *= np.sin(np.multiply.outer(half, k)) * factor
        waves[..., 0] = width
        return np.concatenate([waves.real, waves.imag], axis=-1)

    @cached_property
    def _moment_factors(self) -> tuple[Any, Any, Any]:
        k = np.arange(2.0 * self.highest + 1)
        return k, 1j * k, 2 / np.maximum(k, 1)

    def integrals(self, moments: FloatArray) -> FloatArray:
        """Coefficients of the function that is 1 on the intervals: ``(..., n_components)``."""
        return moments.take(self._moments_to_components, axis=-1) * self.norm

    def products(self, moments: FloatArray) -> FloatArray:
        """Matrix that maps coefficients of ``y`` to those of ``y`` restricted to the intervals.

        ``moments`` of shape ``(..., n_moments)`` gives ``(..., n_components, n_components)``.
        """
        size = self.n_components
        flat = moments @ self._moments_to_products
        return flat.reshape(*moments.shape[:-1], size, size).swapaxes(-1, -2)


def by_harmonic(basis: FourierBasis, coefficients: FloatArray) -> FloatArray:
    """Coefficients (..., n_components) as (..., n_harmonics, 2); the sine of harmonic 0 is 0."""
    result = np.zeros((*coefficients.shape[:-1], len(basis.harmonics), 2))
    at = np.searchsorted(basis.harmonics, basis.order)
    result[..., at, basis.is_sine.astype(int)] = coefficients
    return result


def unknowns_of(
    basis: FourierBasis, harmonics: tuple[int, ...], coefficient: FloatArray
) -> FloatArray:
    """Unknowns in a basis from (n_dof, n_harmonics, 2) of ``harmonics``, zero in all others."""
    full = np.zeros((len(coefficient), len(basis.harmonics), 2))
    full[:, np.searchsorted(basis.harmonics, harmonics)] = coefficient
    return full[:, np.searchsorted(basis.harmonics, basis.order), basis.is_sine.astype(int)].ravel()
