"""Turning points of trigonometric polynomials, all of them, and the largest displacement."""

from dataclasses import dataclass

import numpy as np

from symhbm.fourier import FloatArray, FourierBasis

# Any angle that is no simple fraction of a turn: structured motions have turning points at those,
# and a turning point on a cell boundary costs a second pass.
_OFFSETS = (0.0137, 0.2718, 0.5772)
_DEPTH = 26
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
        rising = _sum(basis.values(root, 2), coefficients[todo][owner]) > 0
        last = (np.cumsum(count) - 1)[owner]
        before = rising[np.where(place == 0, last, np.arange(len(owner)) - 1)]
        bad = (count < 2) | (count % 2 == 1)
        bad |= np.bincount(owner, weights=before == rising, minlength=len(todo)) > 0
        todo = todo[bad]
    return angle


def _sum(values: FloatArray, coefficients: FloatArray) -> FloatArray:
    return np.einsum("...m,...m->...", values, coefficients)


def _zeros_of_slope(basis: FourierBasis, coefficients: FloatArray, offset: float):
    size = np.abs(coefficients)
    bound_3 = size @ basis.order**3
    n_cells = 8 * basis.highest
    width = 2 * np.pi / n_cells
    owner = np.repeat(np.arange(len(coefficients)), n_cells)
    number = np.tile(np.arange(n_cells), len(coefficients))

    def ends(number: np.ndarray, width: float, depth: int) -> tuple[FloatArray, FloatArray]:
        # The same product of powers of two for both neighbours of a boundary: equal to the bit.
        per_turn = n_cells * 2**depth
        return offset + number * width, offset + (number + 1) % per_turn * width

    found_owner, found_left, found_right = [], [], []
    for depth in range(_DEPTH):
        centre = offset + (number + 0.5) * width
        slope = _sum(basis.values(centre, 1), coefficients[owner])
        curvature = _sum(basis.values(centre, 2), coefficients[owner])
        half = width / 2
        bound = bound_3[owner]
        empty = np.abs(slope) > np.abs(curvature) * half + bound * half**2 / 2
        monotone = ~empty & (np.abs(curvature) > bound * half)
        undecided = ~empty & ~monotone
        ripe = monotone if depth < _DEPTH - 1 else monotone | undecided
        if ripe.any():
            left, right = ends(number[ripe], width, depth)
            mine = owner[ripe]
            slope_left = _sum(basis.values(left, 1), coefficients[mine])
            slope_right = _sum(basis.values(right, 1), coefficients[mine])
            changes = (slope_left < 0) != (slope_right < 0)
            found_owner.append(mine[changes])
            found_left.append(left[changes])
            found_right.append((left + width)[changes])
        if not undecided.any():
            break
        owner = np.repeat(owner[undecided], 2)
        number = (2 * number[undecided][:, None] + np.arange(2)).ravel()
        width /= 2
    if not found_owner:
        return np.empty(0, dtype=int), np.empty(0)
    owner = np.concatenate(found_owner)
    own = coefficients[owner]
    root = monotone_root(
        lambda tau: _sum(basis.values(tau, 1), own),
        lambda tau: _sum(basis.values(tau, 2), own),
        np.concatenate(found_left),
        np.concatenate(found_right),
    )
    return owner, root


def monotone_root(function, derivative, left: FloatArray, right: FloatArray, start=None):
    """Zeros of monotone functions, one in each interval: Newton's method kept inside a bracket."""
    left, right = left.copy(), right.copy()
    rising = function(right) >= function(left)
    root = (left + right) / 2 if start is None else np.clip(start, left, right)
    for _ in range(80):
        value = function(root)
        after = (value > 0) == rising
        right = np.where(after, root, right)
        left = np.where(after, left, root)
        slope = derivative(root)
        safe = np.where(slope == 0, 1.0, slope)
        new = np.where(slope == 0, left, root - value / safe)
        outside = (new < left) | (new > right)
        new = np.where(outside, (left + right) / 2, new)
        step = np.abs(new - root)
        root = new
        if np.all(step <= 4 * _MACHINE * (1 + np.abs(root))):
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
