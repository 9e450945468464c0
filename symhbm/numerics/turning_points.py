"""All turning points of trigonometric polynomials, and the largest displacement."""

from dataclasses import dataclass
from functools import lru_cache
from operator import itemgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.numerics.arrays import FloatArray
from symhbm.numerics.fourier import FourierBasis
from symhbm.numerics.roots import Motions

_OFFSET = 0.0137
"""Start of the first cell [rad]: regular motions have turning points at simple fractions."""
_CELLS = 16
"""First cells per period of the highest harmonic."""
_DEPTHS = 24, 12, 6
"""Halvings of a cell: down to 1e-8 rad, fewer where round-off hides multiple zeros."""
_TINY = 1e-300
"""Signed zero slope."""
_SMALL, _LARGE = 1e-100, 1e100
"""Bounds of coefficients whose products neither vanish nor overflow."""


@dataclass(frozen=True)
class TurningPoints:
    """Zeros of ``dy/dtau`` with a change of sign, over one period, for a batch of motions.

    ``angle`` (n_motions, n_max) in rad, ascending, starts at the global maximum of each motion and
    is padded with the last angle; ``count`` (n_motions,) is the number of valid ones, 0 for a
    motion that is constant; ``value`` (n_motions, n_max) is the displacement there and
    ``functions`` (n_motions, n_max, n_components) are the basis functions. ``lowest``
    (n_motions,) is the position of the global minimum, half a period on where motions mirror.
    """

    angle: FloatArray
    value: FloatArray
    count: NDArray[np.int_]
    functions: FloatArray
    lowest: NDArray[np.intp]

    def of(self, motions: NDArray[np.intp] | slice) -> "TurningPoints":
        """The turning points of the chosen motions."""
        return TurningPoints(*(part[motions] for part in vars(self).values()))


class Cells(NamedTuple):
    """Intervals of motions, (n_cells,) each; slope and curvature at both ends, (n_cells, 2)."""

    owner: NDArray[np.intp]
    left: FloatArray
    width: FloatArray
    begin: FloatArray
    end: FloatArray

    def where(self, which: NDArray) -> "Cells":
        """The chosen cells alone."""
        return Cells(*map(itemgetter(which), self))


def turning_points(basis: FourierBasis, coefficients: FloatArray) -> TurningPoints:
    """Find every turning point of the motions with ``coefficients`` (n_motions, n_components).

    Cells of the period are halved until a Taylor bound proves that each holds no turning point or
    that ``dy/dtau`` is monotone in it, so close pairs are not missed. Pairs closer than 1e-7 rad
    do not count as reversals: between them ``y`` moves by less than 1e-21 of its bound.
    """
    motions = Motions(basis, np.asarray(coefficients, dtype=float))
    return points_in_cells(motions, turning_cells(motions))


def turning_cells(motions: Motions) -> Cells | None:
    """Intervals with one turning point each, all of a period, or of half a period that mirrors.

    None for motions whose turning points have a closed form, and for those that stand still or are
    so small or large that products lose digits.
    """
    bounds = motions.bounds
    if bounds[:, 1].min(initial=1.0) > _SMALL and bounds.max(initial=1.0) < _LARGE:
        return None if motions.basis.has_one_harmonic else _cells(motions)
    # Comparisons with NaN are false.
    if not np.all(np.isfinite(motions.coefficients)):
        raise FloatingPointError("the coefficients of a motion are not finite")
    return None


def points_in_cells(motions: Motions, cells: Cells | None) -> TurningPoints:
    """The turning points of motions from their `turning_cells`."""
    if cells is not None:
        return _from_highest(motions, cells.owner, _zeros(motions, cells))
    basis, coefficients = motions.basis, motions.coefficients
    vibration = np.where(basis.order > 0, coefficients, 0.0)
    largest = np.abs(vibration).max(axis=1, initial=0.0)
    moving = np.flatnonzero(largest)
    scaled = Motions(basis, vibration[moving] / largest[moving, None])
    if basis.has_one_harmonic:
        owner, root = _one_harmonic(scaled)
    else:
        cells = _cells(scaled)
        owner, root = cells.owner, _zeros(scaled, cells)
    points = _from_highest(scaled, owner, root)
    angle = np.zeros((len(coefficients), points.angle.shape[1]))
    functions = np.tile(basis.values(0.0), (*angle.shape, 1))
    count, lowest = np.zeros((2, len(coefficients)), dtype=int)
    angle[moving], functions[moving] = points.angle, points.functions
    count[moving], lowest[moving] = points.count, points.lowest
    value = np.einsum("rkm,rm->rk", functions, coefficients)
    return TurningPoints(angle, value, count, functions, lowest)


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


def _from_highest(motions: Motions, owner: NDArray[np.intp], root: FloatArray) -> TurningPoints:
    """Turning points from ``root`` angles of a period or a mirrored half, ascending by motion."""
    basis, coefficients = motions.basis, motions.coefficients
    functions = basis.values(root)
    value = (functions * coefficients[owner]).sum(axis=1)
    count = np.bincount(owner, minlength=len(coefficients))[:, None]
    if not count.all():
        raise ArithmeticError("the turning points of a motion cannot be told apart")
    first = count.cumsum()[:, None] - count
    if basis.mirrors:
        # The second half of each motion's roots behind the first halves of all.
        root = np.concatenate([root, root + np.pi])
        value, functions = np.concatenate([value, -value]), np.concatenate([functions, -functions])
        behind, total = len(owner) - count, 2 * count
    else:
        behind, total = 0, count

    position = np.minimum(np.arange(int(total.max(initial=1))), total - 1)
    source = first + position + behind * (position >= count)
    rows = np.arange(len(count))[:, None]
    start = value[source].argmax(axis=1)[:, None]
    position += start
    again = position >= total
    position -= total * again
    source = source[rows, position]
    angle, value, functions = root[source] + 2 * np.pi * again, value[source], functions[source]
    lowest = count[:, 0] if basis.mirrors else value.argmin(axis=1)
    return TurningPoints(angle, value, total[:, 0], functions, lowest)


def _one_harmonic(motions: Motions) -> tuple[NDArray[np.intp], FloatArray]:
    basis = motions.basis
    n = basis.highest
    cosine, sine = motions.coefficients[:, -2], motions.coefficients[:, -1]
    number = np.arange(n if basis.mirrors else 2 * n)
    root = ((np.arctan2(sine, cosine) % (2 * np.pi))[:, None] + np.pi * number) / n
    return np.repeat(np.arange(len(root)), len(number)), root.ravel()


def _merged(parts: list[Cells]) -> Cells:
    return Cells(*(np.concatenate(part) for part in zip(*parts, strict=True)))


@lru_cache(maxsize=64)
def _grid(basis: FourierBasis) -> tuple[float, FloatArray, FloatArray]:
    """Width of the first cells, their ends, and slope and curvature of the basis there."""
    n_cells = _CELLS * basis.highest
    width = 2 * np.pi / n_cells
    node = _OFFSET + width * np.arange(n_cells // (2 if basis.mirrors else 1) + 1.0)
    table = np.stack([basis.values(node, 1), basis.values(node, 2)], axis=1)
    return width, node, np.ascontiguousarray(table.reshape(2 * len(node), -1).T)


def _cells(motions: Motions) -> Cells:
    """As `turning_cells`, of motions that move, by sizes whose products are ordinary numbers.

    Neighbouring cells share the slope at their common end, so that its changes of sign alternate.
    """
    width, node, table = _grid(motions.basis)
    at_node = (motions.coefficients @ table).reshape(-1, len(node), 2)
    # The last end is the first again, to the bit; a slope of 0 has no sign that could mirror.
    at_node[:, -1] = -at_node[:, 0] - _TINY if motions.basis.mirrors else at_node[:, 0]
    slope = at_node[..., 0]
    falls = slope < 0
    changes = falls[:, 1:] != falls[:, :-1]
    # Between two slopes of one sign beyond this bound the slope does not change its sign.
    low = np.abs(slope) <= motions.bounds[:, 3:4] * (width**2 / 8)
    owner, cell = np.nonzero(changes | low[:, 1:] | low[:, :-1])
    begin, end = at_node[owner, cell], at_node[owner, cell + 1]
    cells = Cells(owner, node[cell], np.full(len(cell), width), begin, end)
    monotone = np.abs(begin[:, 1] + end[:, 1]) > motions.bounds[owner, 3] * width
    simple = monotone & changes[owner, cell]
    if not simple.all():
        cells = _resolved(motions, cells.where(simple), cells.where(~monotone))
    return cells


def _resolved(motions: Motions, cells: Cells, doubtful: Cells) -> Cells:
    """Cells, with those that doubtful cells contain."""
    resolved = [cells]
    most = motions.basis.highest * (1 if motions.basis.mirrors else 2)
    for depth in _DEPTHS:
        if not len(doubtful.owner):
            break
        halved = _halved(motions, doubtful, depth)
        owner = np.concatenate([cells.owner, halved.owner])
        # No motion turns more often than its highest harmonic.
        crowded = np.bincount(owner, minlength=len(motions.coefficients)) > most
        resolved.append(halved.where(~crowded[halved.owner]))
        doubtful = doubtful.where(crowded[doubtful.owner])
    if len(doubtful.owner):
        raise ArithmeticError("the turning points of a motion cannot be told apart")
    cells = _merged(resolved)
    return cells.where(np.lexsort((cells.left, cells.owner)))


def _halved(motions: Motions, cells: Cells, depth: int) -> Cells:
    """All cells within doubtful ones in which the slope is monotone and changes its sign."""
    resolved = []
    for rest in reversed(range(depth)):
        owner, left, width, begin, end = cells
        width = width / 2
        middle = left + width
        centre = motions.basis.derivatives(motions.phasors[owner], middle, 1)[:, :2]
        before = Cells(owner, left, width, begin, centre)
        cells = _merged([before, Cells(owner, middle, width, centre, end)])
        (slope, bend), (slope_right, bend_right) = cells.begin.T, cells.end.T
        bound = motions.bounds[cells.owner, 3]
        changes = (slope < 0) != (slope_right < 0)
        low = np.minimum(np.abs(slope), np.abs(slope_right)) <= bound * cells.width**2 / 8
        doubtful = (changes | low) & (np.abs(bend + bend_right) <= bound * cells.width)
        doubtful &= rest > 0
        resolved.append(cells.where(changes & ~doubtful))
        cells = cells.where(doubtful)
        if not len(cells.owner):
            break
    return _merged(resolved)


def _zeros(motions: Motions, cells: Cells) -> FloatArray:
    """The zero of the slope in each cell."""
    owner, left, width, begin, end = cells
    (slope, bend), (slope_right, bend_right) = begin.T, end.T
    rise = slope_right - slope
    # Cubic interpolation of the angle over the slope.
    share = -slope / rise
    rest = 1 - share
    with np.errstate(divide="ignore", invalid="ignore"):
        bow = rest * (rise / bend - width) - share * (rise / bend_right - width)
        start = left + share * (width + rest * bow)
    return motions.crossings(owner, 1, np.zeros(len(left)), left, left + width, slope < 0, start)


def turning_hessian(basis: FourierBasis, coefficients: FloatArray, angle: FloatArray) -> FloatArray:
    """Second derivatives of the values of motions (n, n_components) at turning points.

    ``angle`` (n,) [rad] tells where they turn. (n, n_components, n_components) [1/m], zero for
    motions that are constant.
    """
    slope = basis.values(angle, 1)
    bend = np.einsum("im,im->i", basis.values(angle, 2), coefficients)
    factor = -1 / np.where(bend == 0, np.inf, bend)
    return factor[:, None, None] * slope[:, :, None] * slope[:, None, :]
