"""Turning points of trigonometric polynomials, all of them, and the largest displacement."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from symhbm.fourier import FloatArray, FourierBasis

# Any angle that is no simple fraction of a turn: structured motions have turning points at those,
# and a turning point on a cell boundary costs a second pass.
_OFFSETS = (0.0137, 0.2718, 0.5772)
_DEPTH = 26
_CELLS = 8
"""First cells per period of the highest harmonic."""
_MACHINE = np.finfo(float).eps


@dataclass(frozen=True)
class TurningPoints:
    """Zeros of ``dy/dtau`` with a change of sign, over one period, for a batch of motions.

    ``angle`` (n_motions, n_max) in rad, ascending, starts at the global maximum of each motion and
    is padded with the last angle; ``count`` (n_motions,) is the number of valid ones, 0 for a
    motion that is constant; ``value`` (n_motions, n_max) is the displacement there.
    """

    angle: FloatArray
    value: FloatArray
    count: np.ndarray

    @property
    def lowest(self) -> np.ndarray:
        """Position of the global minimum among the turning points, shape ``(n_motions,)``."""
        return np.argmin(self.value, axis=1)


def turning_points(basis: FourierBasis, coefficients: FloatArray) -> TurningPoints:
    """Find every turning point of the motions with ``coefficients`` (n_motions, n_components).

    Cells of the period are halved until a Taylor bound proves that each holds no turning point or
    that ``dy/dtau`` is monotone in it, so close pairs are not missed. Pairs closer than 1e-7 rad
    are taken as no reversal: between them ``y`` moves by less than 1e-21 of its bound.
    """
    coefficients = np.asarray(coefficients, dtype=float)
    if not np.all(np.isfinite(coefficients)):
        raise FloatingPointError("the coefficients of a motion are not finite")
    if basis.has_one_harmonic:
        angle = _one_harmonic(basis, coefficients)
    else:
        angle = _several_harmonics(basis, coefficients)
    angle[~np.any(coefficients[:, basis.order > 0] != 0, axis=1)] = np.inf
    return _from_highest(basis, coefficients, angle)


def largest_displacement(
    basis: FourierBasis, coefficients: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Largest ``|x|`` over the period and the angle where it occurs.

    ``coefficients`` (n_motions, n_components) gives two arrays of shape ``(n_motions,)``, the
    first in the unit of the coefficients, the second in rad.
    """
    if basis.has_one_harmonic and basis.order[0] > 0:
        size = np.hypot(coefficients[:, -2], coefficients[:, -1])
        if not np.isfinite(size).all():
            raise FloatingPointError("the coefficients of a motion are not finite")
        return size, np.arctan2(coefficients[:, -1], coefficients[:, -2]) / basis.highest
    points = turning_points(basis, coefficients)
    at = np.argmax(np.abs(points.value), axis=1)
    rows = np.arange(len(at))
    return np.abs(points.value[rows, at]), points.angle[rows, at]


def _one_harmonic(basis: FourierBasis, coefficients: FloatArray) -> FloatArray:
    n = int(basis.highest)
    phase = np.arctan2(coefficients[:, -1], coefficients[:, -2]) % (2 * np.pi)
    return (phase[:, None] + np.pi * np.arange(2 * n)) / n


def _several_harmonics(basis: FourierBasis, coefficients: FloatArray) -> FloatArray:
    """Angles of the turning points, ascending, padded with infinity: (n_motions, n_max)."""
    n_motions = len(coefficients)
    largest = np.abs(coefficients[:, basis.order > 0]).max(axis=1, initial=0.0)[:, None]
    coefficients = coefficients / np.where(largest > 0, largest, 1.0)
    todo = np.flatnonzero(largest > 0)
    angle = np.full((n_motions, 2 * basis.highest + 2), np.inf)
    for offset in _OFFSETS:
        if not len(todo):
            break
        owner, root = _zeros_of_slope(basis, coefficients[todo], offset)
        order = np.lexsort((root, owner))
        owner, root = owner[order], root[order]
        count = np.bincount(owner, minlength=len(todo))
        place = np.arange(len(owner)) - (np.cumsum(count) - count)[owner]
        fits = place < angle.shape[1]
        angle[todo] = np.inf
        angle[todo[owner[fits]], place[fits]] = root[fits]
        # Maxima and minima alternate unless a root on a cell boundary was lost or doubled.
        curvature = basis.weights(coefficients[todo], 2)[owner]
        rising = np.einsum("kj,kj->k", basis.trigonometric(root), curvature) > 0
        last = (np.cumsum(count) - 1)[owner]
        before = rising[np.where(place == 0, last, np.arange(len(owner)) - 1)]
        bad = (count < 2) | (count % 2 == 1)
        bad |= np.bincount(owner, weights=before == rising, minlength=len(todo)) > 0
        todo = todo[bad]
    if len(todo):
        raise ArithmeticError("the turning points of a motion cannot be told apart")
    return angle


@lru_cache(maxsize=64)
def _cells(basis: FourierBasis, offset: float) -> tuple[FloatArray, ...]:
    """Slope and curvature at the centres, slope at the left ends of the first cells."""
    left = offset + np.arange(_CELLS * basis.highest) * (2 * np.pi / (_CELLS * basis.highest))
    centre = left + np.pi / (_CELLS * basis.highest)
    return basis.values(centre, 1).T, basis.values(centre, 2).T, basis.values(left, 1).T


def _zeros_of_slope(
    basis: FourierBasis, coefficients: FloatArray, offset: float
) -> tuple[np.ndarray, FloatArray]:
    """Motion and angle of every zero of ``dy/dtau`` with a change of sign."""
    bound_3 = np.abs(coefficients) @ basis.order**3
    weights = basis.weights(coefficients, 1), basis.weights(coefficients, 2)
    n_cells = _CELLS * basis.highest
    width = 2 * np.pi / n_cells
    at_centre = _cells(basis, offset)

    slope, curvature = coefficients @ at_centre[0], coefficients @ at_centre[1]
    empty, monotone = _decide(slope, curvature, bound_3[:, None], width / 2)
    at_left = coefficients @ at_centre[2] < 0
    changes = monotone & (at_left != np.roll(at_left, -1, axis=1))
    owner, number = np.nonzero(changes)
    found = [(owner, offset + number * width, np.full(len(owner), width), at_left[owner, number])]
    owner, number = np.nonzero(~empty & ~monotone)
    for depth in range(1, _DEPTH):
        if not len(owner):
            break
        owner = np.repeat(owner, 2)
        number = (2 * number[:, None] + np.arange(2)).ravel()
        width /= 2
        trigonometric = basis.trigonometric(offset + (number + 0.5) * width)
        slope, curvature = (np.einsum("kj,kj->k", trigonometric, w[owner]) for w in weights)
        empty, monotone = _decide(slope, curvature, bound_3[owner], width / 2)
        ripe = np.flatnonzero(~empty if depth == _DEPTH - 1 else monotone)
        mine, left = owner[ripe], number[ripe]
        # The same product of powers of two for both neighbours of a boundary: equal to the bit.
        right = (left + 1) % (n_cells * 2**depth)
        negative = [
            np.einsum("kj,kj->k", basis.trigonometric(offset + i * width), weights[0][mine]) < 0
            for i in (left, right)
        ]
        kept = negative[0] != negative[1]
        found.append(
            (
                mine[kept],
                offset + left[kept] * width,
                np.full(kept.sum(), width),
                negative[0][kept],
            )
        )
        undecided = ~empty & ~monotone
        owner, number = owner[undecided], number[undecided]
    owner, left, size, rising = (np.concatenate(parts) for parts in zip(*found, strict=True))
    first, second = weights[0][owner], weights[1][owner]

    def slope_and_curvature(tau: FloatArray) -> tuple[FloatArray, FloatArray]:
        trigonometric = basis.trigonometric(tau)
        return (
            np.einsum("kj,kj->k", trigonometric, first),
            np.einsum("kj,kj->k", trigonometric, second),
        )

    noise = _MACHINE * (np.abs(coefficients) @ basis.order)[owner]
    start = left + size / 2
    return owner, monotone_root(slope_and_curvature, left, left + size, rising, start, noise)


def _decide(slope: FloatArray, curvature: FloatArray, bound: FloatArray, half: float):
    """Whether cells hold no zero of the slope, or the slope is monotone in them."""
    empty = np.abs(slope) > np.abs(curvature) * half + bound * half**2 / 2
    return empty, ~empty & (np.abs(curvature) > bound * half)


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
        if np.all((step <= 4 * _MACHINE * (1 + np.abs(root))) | (np.abs(value) <= noise)):
            break
    return root


def _from_highest(
    basis: FourierBasis, coefficients: FloatArray, angle: FloatArray
) -> TurningPoints:
    """Turn ascending angles into a sequence that starts at the global maximum."""
    valid = np.isfinite(angle)
    count = valid.sum(axis=1)
    angle = np.where(valid, angle, 0.0)[:, : max(int(count.max(initial=0)), 1)]
    value = np.einsum("rkm,rm->rk", basis.values(angle), coefficients)
    first = np.argmax(np.where(valid[:, : angle.shape[1]], value, -np.inf), axis=1)
    place = np.minimum(np.arange(angle.shape[1]), np.maximum(count - 1, 0)[:, None])
    place += first[:, None]
    wrapped = place >= np.maximum(count, 1)[:, None]
    place = np.where(wrapped, place - np.maximum(count, 1)[:, None], place)
    rows = np.arange(len(angle))[:, None]
    return TurningPoints(angle[rows, place] + 2 * np.pi * wrapped, value[rows, place], count)
