"""The resting place of a slider, and how much it is asked for, to second order.

Both are implicit: conditions on the place and on the active instants determine them. Second
derivatives are those of a sum of values and conditions, whose multipliers make it stationary.
"""

from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from symhbm.model.contacts.law import functions_at
from symhbm.model.contacts.planar.rest import resting_place, weights_of
from symhbm.model.contacts.planar.slopes import rest_slopes
from symhbm.numerics import Compiled, FloatArray, FourierBasis


def slip_margin(
    basis: FourierBasis, variables: FloatArray, varies: bool
) -> tuple[float, FloatArray, FloatArray]:
    """The margin of slip, its gradient and its second derivatives by the variables (P,)."""
    place, slopes, asked = _resting(basis, variables, varies, np.array([0.0, 0.0, 1.0]))
    margin, gradient, curvature = _margin(basis, varies)(np.append(place[2], variables))
    spread = np.vstack([slopes[2], np.eye(len(variables))])
    curvature = curvature.reshape(len(gradient), -1)
    return float(margin[0]), gradient @ spread, gradient[0] * asked + spread.T @ curvature @ spread


def resting_bends(
    basis: FourierBasis, variables: FloatArray, weights: FloatArray, varies: bool
) -> FloatArray:
    """Second derivatives (P, P) of the resting place times weights (2), by the variables (P)."""
    return _resting(basis, variables, varies, np.append(weights, 0.0))[2]


@lru_cache(maxsize=64)
def _margin(basis: FourierBasis, varies: bool) -> Compiled:
    """Margin, gradient and second derivatives by how much slip is asked for, and the variables."""
    size = basis.n_components
    whole = ca.SX.sym("whole", 2 + (3 if varies else 2) * size)
    value, own = whole[0], whole[1:]
    moving, mean = ca.DM((basis.order > 0).astype(float)), ca.DM((basis.order == 0).astype(float))
    if varies:
        push = own[2 * size + 1 :]
        square = ca.sumsqr(moving * push) + (own[2 * size] + ca.dot(mean, push)) ** 2
        for k in range(2):
            square += ca.sumsqr(moving * own[k * size : (k + 1) * size])
        margin = 2 * value / ca.sqrt(square)
    else:
        margin = ca.log(value + own[2 * size]) - ca.log(own[2 * size])
    curvature, gradient = ca.hessian(margin, whole)
    outputs = [margin, ca.densify(gradient), ca.vec(ca.densify(curvature))]
    return Compiled(ca.Function("margin", [whole], outputs))


def _resting(
    basis: FourierBasis, variables: FloatArray, varies: bool, weights: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Resting place and how much it is asked for (3,), derivatives (3, P), weighted second ones.

    The last are those (P, P) of the three times ``weights``.
    """
    size = basis.n_components
    waves, order = np.zeros((3, 2, basis.highest + 1)), basis.order.astype(np.int64)
    push = variables[2 * size + 1 :] if varies else np.zeros(size)
    parts = variables[:size], variables[size : 2 * size], push
    waves[:, basis.is_sine.astype(int), order] = parts
    waves[2, 0, 0] += variables[2 * size]
    angles, place, sides = np.empty(3), np.empty(3), np.empty((3, 8))
    n = resting_place(waves, angles, place)
    weights_of(waves, angles, n, place, sides)
    slopes = np.empty((3, len(variables)))
    rest_slopes((*basis.arrays, varies), angles, sides, n, slopes)
    if n == 1:
        return place, slopes, np.zeros((len(variables), len(variables)))
    first, second = _conditions(basis, n, varies)
    point = np.concatenate([place[:2], angles[:n], variables]), np.isinf(sides[:n, 5])
    of_conditions, of_value = (np.asarray(part.full()) for part in first(*point, weights))
    own = of_conditions[:, : 2 + n]
    multipliers = np.linalg.solve(own.T, -of_value[0, : 2 + n])
    moved = -np.linalg.solve(own, of_conditions[:, 2 + n :])
    spread = np.vstack([moved, np.eye(len(variables))])
    bends = np.asarray(second(*point, weights, multipliers).full())
    return place, slopes, spread.T @ bends @ spread


@lru_cache(maxsize=64)
def _conditions(basis: FourierBasis, n: int, varies: bool) -> tuple[ca.Function, ca.Function]:
    """What determines the resting place and ``n`` active instants: slopes, and weighted bends.

    Each instant asks most, all ask as much, and the directions of two are opposite; an instant
    that is ``flat`` stays.
    """
    size = basis.n_components
    whole = ca.SX.sym("whole", 2 + n + (3 * size + 1 if varies else 2 * size + 1))
    flat, angle = ca.SX.sym("flat", n), ca.SX.sym("angle")
    place, variables = whole[:2], whole[2 + n :]
    functions = functions_at(basis, angle)
    motion = ca.vertcat(*(ca.dot(variables[k * size : (k + 1) * size], functions) for k in (0, 1)))
    limit = variables[2 * size]
    if varies:
        limit += ca.dot(variables[2 * size + 1 :], functions)
    asked = ca.norm_2(motion - place) - limit
    normal = (motion - place) / ca.norm_2(motion - place)
    each = ca.Function("each", [angle, whole], [asked, ca.jacobian(asked, angle), normal])
    asks, slopes, normals = zip(*(each(whole[2 + i], whole) for i in range(n)), strict=True)
    rows: list[Any] = [ca.if_else(flat[i], whole[2 + i], slopes[i]) for i in range(n)]
    rows.append(asks[0] - asks[1])
    a, b = normals[:2]
    rows.append(asks[0] - asks[2] if n == 3 else a[0] * b[1] - a[1] * b[0])
    conditions, multipliers = ca.vertcat(*rows), ca.SX.sym("multipliers", 2 + n)
    weights = ca.SX.sym("weights", 3)
    value = ca.dot(weights, ca.vertcat(place, asks[0]))
    bends = ca.hessian(value + ca.dot(multipliers, conditions), whole)[0]
    first = [ca.densify(ca.jacobian(part, whole)) for part in (conditions, value)]
    return (
        ca.Function("slopes", [whole, flat, weights], first),
        ca.Function("bends", [whole, flat, weights, multipliers], [ca.densify(bends)]),
    )
