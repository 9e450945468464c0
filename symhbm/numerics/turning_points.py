"""Where motions as Fourier series turn, and their largest values."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from symhbm.numerics.check import FloatArray
from symhbm.numerics.fourier import FourierBasis
from symhbm.numerics.loops import fourier


@dataclass(frozen=True)
class TurningPoints:
    """Zeros of ``dy/dtau`` with a change of sign, over one period, for a batch of motions.

    ``angle`` (n_motions, n_max) in rad, ascending, starts at the global maximum of each motion and
    is padded with the last angle; ``count`` (n_motions,) is the number of valid ones, 0 for a
    motion that is constant; ``value`` (n_motions, n_max) is the displacement there. ``lowest``
    (n_motions,) is the position of the global minimum, half a period on where motions mirror.
    """

    angle: FloatArray
    value: FloatArray
    count: NDArray[np.int_]
    lowest: NDArray[np.intp]


def turning_points(basis: FourierBasis, coefficients: FloatArray) -> TurningPoints:
    """Find every turning point of the motions with ``coefficients`` (n_motions, n_components).

    Cells of the period are halved until the bound of a derivative proves that each holds no turning
    point or that ``dy/dtau`` is monotone in it, so close pairs are not missed. Pairs closer than
    1e-7 rad do not count as reversals: between them ``y`` moves by less than 1e-21 of its bound.

    Raises
    ------
    FloatingPointError
        For coefficients that are not finite.
    """
    n = len(coefficients)
    angle, value = np.empty((2, n, 2 * basis.highest))
    count, lowest = np.empty((2, n), dtype=np.int64)
    motions = np.array(coefficients, dtype=float, order="C")
    order, is_sine, _ = basis.arrays
    check_turning(
        fourier.turning_points_of(
            order, is_sine, basis.mirrors, motions, angle, value, count, lowest
        )
    )
    most = max(count.max(initial=1), 1)
    return TurningPoints(angle[:, :most], value[:, :most], count, lowest)


def check_turning(status: int) -> None:
    """Raise what a loop over turning points reports."""
    if status == fourier.NOT_FINITE:
        raise FloatingPointError("the coefficients of a motion are not finite")
    if status == fourier.NOT_APART:
        raise ArithmeticError("the turning points of a motion cannot be told apart")


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
    order, is_sine, _ = basis.arrays
    size, angle = np.empty((2, len(coefficients)))
    motions = np.array(coefficients, dtype=float, order="C")
    check_turning(fourier.largest_of(order, is_sine, not basis.mirrors, motions, size, angle))
    return size, angle


def turning_hessian(basis: FourierBasis, coefficients: FloatArray, angle: FloatArray) -> FloatArray:
    """Second derivatives of the values of motions (n, n_components) at turning points.

    ``angle`` (n,) [rad] tells where they turn. (n, n_components, n_components) [1/m], zero for
    motions that are constant.
    """
    slope = basis.values(angle, 1)
    bend = np.einsum("im,im->i", basis.values(angle, 2), coefficients)
    factor = -1 / np.where(bend == 0, np.inf, bend)
    return factor[:, None, None] * slope[:, :, None] * slope[:, None, :]
