"""Motions at instants, and the angles at which they cross the break points of a force."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from symhbm.model.contacts.smooth.expression import Force, arguments_of
from symhbm.numerics import MACHINE, FloatArray, FourierBasis, monotone_root

_CELLS = 64
"""Cells of a period in which break points are looked for, and as many for each four harmonics."""
_NEAR = 0.2
"""Extreme of a parabola over the values at the ends of a cell, above which there is no zero."""
_HALVINGS = 60
"""Halvings of a cell to its extreme."""


class Breaks(NamedTuple):
    """Break points of one motion, ascending.

    Their ``angle`` (b,) [rad], which ``function`` is zero there, and ``fastest``, the largest rate
    of that function over the period.
    """

    angle: FloatArray
    function: np.ndarray
    fastest: FloatArray


@dataclass(frozen=True)
class Angles:
    """Angles ``tau`` (n or 1, N) [rad] with the functions of a basis there, (n or 1, N, K)."""

    basis: FourierBasis
    tau: FloatArray

    @cached_property
    def functions(self) -> FloatArray:
        """Cosines and sines."""
        return self.basis.values(self.tau)

    @cached_property
    def rates(self) -> FloatArray:
        """Their first derivatives."""
        return self.basis.values(self.tau, 1)

    @cached_property
    def bends(self) -> FloatArray:
        """Their second derivatives."""
        return self.basis.values(self.tau, 2)


@dataclass(frozen=True)
class Motion:
    """Motions of contacts with their frequencies and parameters.

    ``coefficients`` (n, m K) [m], ``frequency`` (n,) [rad/s], ``parameters`` (n, p).
    """

    coefficients: FloatArray
    frequency: FloatArray
    parameters: FloatArray

    def __len__(self) -> int:
        return len(self.coefficients)

    @property
    def n_variables(self) -> int:
        """Coefficients, the frequency and parameters."""
        return self.coefficients.shape[1] + 1 + self.parameters.shape[1]

    def of(self, chosen: Any) -> "Motion":
        """Some of the motions."""
        return Motion(self.coefficients[chosen], self.frequency[chosen], self.parameters[chosen])

    def arguments(self, angles: Angles) -> FloatArray:
        """Arguments (n, N, a) of a force at angles (n or 1, N)."""
        displacement, velocity = self._moved(angles.functions, angles.rates)
        return arguments_of(displacement, velocity, self.parameters[:, None])

    def rates(self, angles: Angles) -> FloatArray:
        """Their derivatives by the angle, (n, N, a)."""
        displacement, velocity = self._moved(angles.rates, angles.bends)
        return arguments_of(displacement, velocity, 0 * self.parameters[:, None])

    def by_variables(self, angles: Angles) -> FloatArray:
        """Derivatives of the arguments by coefficients, frequency and parameters, (n, N, a, v)."""
        n, size = self.coefficients.shape
        k = angles.basis.n_components
        m, p = size // k, self.parameters.shape[1]
        result = np.zeros((n, angles.tau.shape[1], 2 * m + p, size + 1 + p))
        for i in range(m):
            own = slice(i * k, (i + 1) * k)
            result[:, :, i, own] = angles.functions
            result[:, :, m + i, own] = self.frequency[:, None, None] * angles.rates
            result[:, :, m + i, size] = (angles.rates @ self.coefficients[:, own, None])[..., 0]
        result[:, :, 2 * m :, size + 1 :] = np.eye(p)
        return result

    def _moved(self, functions: FloatArray, rates: FloatArray) -> tuple[FloatArray, FloatArray]:
        by_direction = self.coefficients.reshape(len(self), -1, functions.shape[-1])
        columns = np.swapaxes(by_direction, 1, 2)
        return functions @ columns, self.frequency[:, None, None] * (rates @ columns)


def find_breaks(force: Force, basis: FourierBasis, motion: Motion) -> list[Breaks]:
    """Where the functions of break points change their signs over the periods of motions."""
    n, count = len(motion), force.sizes.breakpoints
    if not count:
        none = Breaks(np.zeros(0), np.zeros(0, dtype=int), np.zeros(0))
        return [none] * n
    cells = _cells(basis)
    value, rate = _along(force, motion, cells)
    found = [
        _crossings(force, motion, function, cells, value[:, :, function], rate[:, :, function])
        for function in range(count)
    ]
    fastest = np.abs(rate).max(axis=1)
    result = []
    for j in range(n):
        angles = [angle[owner == j] for owner, angle in found]
        which = np.repeat(np.arange(count), [len(a) for a in angles])
        angle = np.concatenate(angles) % (2 * np.pi)
        order = np.argsort(angle)
        result.append(Breaks(angle[order], which[order], fastest[j, which[order]]))
    return result


@lru_cache(maxsize=16)
def _cells(basis: FourierBasis) -> Angles:
    return Angles(basis, np.linspace(0, 2 * np.pi, _CELLS * (1 + basis.highest // 4) + 1)[None])


def _along(force: Force, motion: Motion, angles: Angles) -> tuple[FloatArray, FloatArray]:
    """Break functions (n, N, b) at angles, and their derivatives by the angle."""
    value, by_argument = force.margins(motion.arguments(angles))
    rate = np.einsum("nsba,nsa->nsb", by_argument, motion.rates(angles))
    return value, rate


def _crossings(
    force: Force, motion: Motion, function: int, cells: Angles, value: FloatArray, rate: FloatArray
) -> tuple[np.ndarray, FloatArray]:
    """The motions and the angles at which one function changes its sign.

    ``value`` and ``rate`` (n, N) are those at the ends of cells.
    """

    def at(owner: np.ndarray) -> Callable[[FloatArray], tuple[FloatArray, FloatArray]]:
        part = motion.of(owner)

        def evaluate(angle: FloatArray) -> tuple[FloatArray, FloatArray]:
            found = _along(force, part, Angles(cells.basis, angle[:, None]))
            return found[0][:, 0, function], found[1][:, 0, function]

        return evaluate

    tau = cells.tau[0]
    positive, width = value > 0, np.diff(tau)
    one, other = value[:, :-1], value[:, 1:]
    owner, cell = np.nonzero(positive[:, 1:] != positive[:, :-1])
    parts = [(owner, tau[cell], tau[cell + 1], ~positive[owner, cell])]
    # Two zeros in a cell: towards zero at both of its ends, and near enough.
    side = np.where(positive, 1.0, -1.0)
    towards = (side * rate)[:, :-1] < 0
    towards &= ((side * rate)[:, 1:] > 0) & (positive[:, 1:] == positive[:, :-1])
    depth = np.abs(rate[:, :-1] * rate[:, 1:]) / np.maximum(
        np.abs(rate[:, :-1]) + np.abs(rate[:, 1:]), np.finfo(float).tiny
    )
    smallest, largest = np.minimum(abs(one), abs(other)), np.maximum(abs(one), abs(other))
    near = towards & (smallest - depth * width <= _NEAR * largest)
    owner, cell = np.nonzero(near)
    if len(owner):
        evaluate, left, right = at(owner), tau[cell], tau[cell + 1]
        sign = side[owner, cell]
        for _ in range(_HALVINGS):
            middle = (left + right) / 2
            before = sign * evaluate(middle)[1] < 0
            left, right = np.where(before, middle, left), np.where(before, right, middle)
        bottom = (left + right) / 2
        crosses = sign * evaluate(bottom)[0] < 0
        owner, cell, bottom, rising = (p[crosses] for p in (owner, cell, bottom, sign < 0))
        parts += [(owner, tau[cell], bottom, rising), (owner, bottom, tau[cell + 1], ~rising)]
    owner, left, right, rising = (np.concatenate(each) for each in zip(*parts, strict=True))
    if not len(owner):
        return owner, left
    noise = 4 * MACHINE * np.abs(value).max(axis=1)[owner]
    root = monotone_root(at(owner), left, right, rising, (left + right) / 2, noise)
    return owner, root
