"""Dry friction marched over samples, with the Jacobian of the marching, for numba."""

from typing import NamedTuple

import numpy as np
from numba import njit

from symhbm.numerics import FourierBasis


class Friction(NamedTuple):
    """Contacts and tables of the samples.

    ``dofs`` (n_contacts, 2), the second -1 for the ground; ``stiffness`` [N/m] and ``limit`` [N],
    (n_contacts,); ``at_sample`` (n_samples, size), the basis functions; ``sums``
    (n_samples + 1, size) and ``products`` (n_samples + 1, size, size), what they and their products
    sum up to before each sample.
    """

    dofs: np.ndarray
    stiffness: np.ndarray
    limit: np.ndarray
    at_sample: np.ndarray
    sums: np.ndarray
    products: np.ndarray


def tables_of(basis: FourierBasis, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``at_sample``, ``sums`` and ``products`` of the functions of a basis."""
    at_sample = basis.values(2 * np.pi * np.arange(samples) / samples)
    size = at_sample.shape[1]
    sums = np.zeros((samples + 1, size))
    sums[1:] = np.cumsum(at_sample, axis=0)
    products = np.zeros((samples + 1, size, size))
    products[1:] = np.cumsum(at_sample[:, :, None] * at_sample[:, None, :], axis=0)
    return at_sample, sums, products


@njit
def _march(friction, contact, y, origin, sign):
    """March two periods: where runs of the second begin, and of each its sign and its origin.

    A run slips on ``sign`` times the limit; or it sticks, its origin being the last sample that
    slipped (on ``sign``), -1 for none. Returns the number of runs and where each ends.
    """
    stiffness, limit = friction.stiffness[contact], friction.limit[contact]
    samples = len(y)
    end = np.empty(samples, dtype=np.int64)
    offset, last, side, new, runs, slipped = 0.0, -1, 0.0, 0.0, 0, False
    for period in range(2):
        for t in range(samples):
            trial = stiffness * y[t] + offset
            slips = abs(trial) > limit
            if slips:
                new = 1.0 if trial > 0 else -1.0
                offset = new * limit - stiffness * y[t]
            if period == 1 and (t == 0 or slips != slipped or (slips and new != side)):
                if t > 0:
                    end[runs] = t
                    runs += 1
                origin[runs] = -2 if slips else last
                sign[runs] = new if slips else side
            slipped = slips
            if slips:
                last, side = t, new
    end[runs] = samples
    return runs + 1, end


@njit
def add_friction(friction, point, residual, matrix):
    """Add the friction forces and their derivatives by the unknowns."""
    samples, size = friction.at_sample.shape
    origin, sign = np.empty(samples, dtype=np.int64), np.empty(samples)
    slope, force = np.empty((size, size)), np.empty(size)
    for contact in range(len(friction.limit)):
        first, second = friction.dofs[contact]
        q = point[first * size : (first + 1) * size].copy()
        if second >= 0:
            q -= point[second * size : (second + 1) * size]
        runs, end = _march(friction, contact, np.dot(friction.at_sample, q), origin, sign)
        slope[:], force[:] = 0.0, 0.0
        begin = 0
        for run in range(runs):
            total = friction.sums[end[run]] - friction.sums[begin]
            force += sign[run] * friction.limit[contact] * total
            if origin[run] != -2:
                slope += friction.products[end[run]] - friction.products[begin]
            if origin[run] >= 0:
                slope -= np.outer(total, friction.at_sample[origin[run]])
            begin = end[run]
        slope *= 2 * friction.stiffness[contact] / samples
        force *= 2 / samples
        force += np.dot(slope, q)
        add_block(first, first, 1.0, slope, matrix)
        residual[first * size : (first + 1) * size] += force
        if second >= 0:
            add_block(second, second, 1.0, slope, matrix)
            add_block(first, second, -1.0, slope, matrix)
            add_block(second, first, -1.0, slope, matrix)
            residual[second * size : (second + 1) * size] -= force


@njit
def add_block(row, column, sign, slope, matrix):
    """Add a matrix to the block of two degrees of freedom."""
    size = len(slope)
    for a in range(size):
        for b in range(size):
            matrix[row * size + a, column * size + b] += sign * slope[a, b]
