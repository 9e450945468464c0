"""Margins of contacts to second order by the variables of their forces.

What rests on the smallest of largest values has as second derivative that of the values, weighted
as they count, along the motion of the resting place and of the active instants.
"""

from functools import lru_cache

import casadi as ca
import numpy as np

from symhbm.model.contacts.planar.batch import OPENS, SLIPS, extremes
from symhbm.model.contacts.planar.rest import resting_place, weights_of
from symhbm.model.contacts.planar.series import motion_at
from symhbm.model.contacts.planar.slopes import rest_slopes
from symhbm.numerics import FloatArray, FourierBasis


def margin_by_variables(
    basis: FourierBasis, variables: FloatArray, switch: int, varies: bool
) -> tuple[float, FloatArray, FloatArray]:
    """A margin, its gradient and its second derivatives by the event variables (v,)."""
    size = basis.n_components
    tangential = 3 * size + 1 if varies else 2 * size + 1
    if switch == SLIPS:
        part = slice(0, tangential)
        value, first, second = _asked(basis, variables[part], varies)
        value, first, second = 2 * value, 2 * first, 2 * second
    else:
        part = slice(tangential, len(variables))
        value, first, second = _extreme(basis, variables[part], switch)
    own = variables[part]
    margin, by_value, by_own, curvature = _ratio(basis, switch == SLIPS, varies, value, own)
    gradient, whole = np.zeros(len(variables)), np.zeros((len(variables), len(variables)))
    gradient[part] = by_value * first + by_own
    spread = np.vstack([first, np.eye(len(first))])
    whole[part, part] = by_value * second + spread.T @ curvature @ spread
    return margin, gradient, whole


def _ratio(basis, slip, varies, value, own):
    """The margin of a value and its own variables, with its derivatives by both."""
    whole = np.concatenate([[value], own])
    margin, gradient, curvature = (
        np.asarray(part.full()) for part in _margin(basis, slip, varies)(whole)
    )
    gradient = gradient.ravel()
    return float(margin[0, 0]), float(gradient[0]), gradient[1:], curvature


@lru_cache(maxsize=64)
def _margin(basis: FourierBasis, slip: bool, varies: bool) -> ca.Function:
    """Margin, gradient and second derivatives by a value and the variables it is compared with."""
    size = basis.n_components
    n = (1 + 3 * size if varies else 1 + 2 * size) if slip else 1 + size
    whole = ca.SX.sym("whole", 1 + n)
    value, own = whole[0], whole[1:]
    moving, mean = ca.DM((basis.order > 0).astype(float)), ca.DM((basis.order == 0).astype(float))
    if slip and not varies:
        margin = ca.log(value / 2 + own[2 * size]) - ca.log(own[2 * size])
    else:
        first = 2 * size if slip else 0
        push = own[first + 1 :]
        square = ca.sumsqr(moving * push) + (own[first] + ca.dot(mean, push)) ** 2
        for k in range(2 if slip else 0):
            square += ca.sumsqr(moving * own[k * size : (k + 1) * size])
        margin = value / ca.sqrt(square)
    curvature, gradient = ca.hessian(margin, whole)
    outputs = [margin, ca.densify(gradient), ca.densify(curvature)]
    return ca.Function("margin", [whole], outputs)


def _waves(basis: FourierBasis, rows: list[FloatArray], load: float) -> FloatArray:
    waves = np.zeros((3, 2, basis.highest + 1))
    for k, row in enumerate(rows):
        waves[k, basis.is_sine.astype(int), basis.order.astype(int)] = row
    waves[2, 0, 0] += load
    return waves


def _extreme(
    basis: FourierBasis, variables: FloatArray, switch: int
) -> tuple[float, FloatArray, FloatArray]:
    """The largest ``-p`` or the largest ``p`` over the period."""
    sign, k = (-1.0, 0) if switch == OPENS else (1.0, 1)
    nothing = np.zeros(basis.n_components)
    waves = _waves(basis, [nothing, nothing, variables[1:]], variables[0])
    turning, at = np.empty((2, 2)), np.empty((3, 3))
    extremes(waves, turning)
    angle = turning[k, 1]
    motion_at(waves, angle, at)
    first = np.concatenate([[1.0], basis.values(angle)])
    rate = np.concatenate([[0.0], basis.values(angle, 1)])
    bend = at[2, 2] if at[2, 2] != 0 else np.inf
    return sign * turning[k, 0], sign * first, -sign * np.outer(rate, rate) / bend


def _asked(
    basis: FourierBasis, variables: FloatArray, varies: bool
) -> tuple[float, FloatArray, FloatArray]:
    """How much the resting place is asked for, see `symhbm.model.contacts.planar.rest`."""
    size = basis.n_components
    push = variables[2 * size + 1 :] if varies else np.zeros(size)
    rows = [variables[:size], variables[size : 2 * size], push]
    waves = _waves(basis, rows, variables[2 * size])
    angles, place, sides = np.empty(3), np.empty(3), np.empty((3, 8))
    n = resting_place(waves, angles, place)
    weights_of(waves, angles, n, place, sides)
    slopes = np.empty((3, len(variables)))
    order = basis.order.astype(np.int64)
    rest_slopes(order, basis.is_sine, varies, angles, sides, n, slopes)
    second, at = np.zeros((len(variables), len(variables))), np.empty((3, 3))
    for i in range(n):
        nx, ny, weight, across, length, bend = sides[i, :6]
        if length == 0:
            break
        motion_at(waves, angles[i], at)
        moved = [_rows(basis, angles[i], d, varies) for d in range(2)]
        normal, tangent = np.array([nx, ny]), np.array([-ny, nx])
        shift = moved[0][:2] - slopes[:2]
        by_angle = normal @ moved[1][:2] + across / length * (tangent @ shift) - moved[1][2]
        angle = -by_angle / bend
        turned = tangent @ (shift + np.outer(at[:2, 1], angle))
        rate = normal @ moved[1][:2] - moved[1][2]
        straight = normal @ at[:2, 2] - at[2, 2]
        second += weight * (
            np.outer(turned, turned) / length
            + np.outer(rate, angle)
            + np.outer(angle, rate)
            + straight * np.outer(angle, angle)
        )
    return float(place[2]), slopes[2], second


def resting_bends(
    basis: FourierBasis, variables: FloatArray, weights: FloatArray, varies: bool
) -> FloatArray:
    """Second derivatives (P, P) of the resting place times weights (2), by the variables (P)."""
    size = basis.n_components
    push = variables[2 * size + 1 :] if varies else np.zeros(size)
    rows = [variables[:size], variables[size : 2 * size], push]
    waves = _waves(basis, rows, variables[2 * size])
    angles, place, sides = np.empty(3), np.empty(3), np.empty((3, 8))
    n = resting_place(waves, angles, place)
    weights_of(waves, angles, n, place, sides)
    if n == 1:
        return np.zeros((len(variables), len(variables)))
    first, second = _conditions(basis, n, varies)
    point = np.concatenate([place[:2], angles[:n], variables]), np.isinf(sides[:n, 5])
    slopes = np.asarray(first(*point).full())
    own = slopes[:, : 2 + n]
    multipliers = np.linalg.solve(own.T, np.concatenate([weights, np.zeros(n)]))
    spread = np.vstack([-np.linalg.solve(own, slopes[:, 2 + n :]), np.eye(len(variables))])
    return -spread.T @ np.asarray(second(*point, multipliers).full()) @ spread


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
    sines, order = basis.is_sine, basis.order
    functions = ca.vertcat(
        *(
            ca.sin(h * angle) if sine else ca.cos(h * angle)
            for h, sine in zip(order.tolist(), sines.tolist(), strict=True)
        )
    )
    motion = ca.vertcat(*(ca.dot(variables[k * size : (k + 1) * size], functions) for k in (0, 1)))
    limit = variables[2 * size]
    if varies:
        limit += ca.dot(variables[2 * size + 1 :], functions)
    asked = ca.norm_2(motion - place) - limit
    normal = (motion - place) / ca.norm_2(motion - place)
    each = ca.Function("each", [angle, whole], [asked, ca.jacobian(asked, angle), normal])
    asks, slopes, normals = zip(*(each(whole[2 + i], whole) for i in range(n)), strict=True)
    rows = [ca.if_else(flat[i], whole[2 + i], slopes[i]) for i in range(n)]
    rows.append(asks[0] - asks[1])
    a, b = normals[:2]
    rows.append(asks[0] - asks[2] if n == 3 else a[0] * b[1] - a[1] * b[0])
    conditions, multipliers = ca.vertcat(*rows), ca.SX.sym("multipliers", 2 + n)
    bends = ca.hessian(ca.dot(multipliers, conditions), whole)[0]
    return (
        ca.Function("slopes", [whole, flat], [ca.densify(ca.jacobian(conditions, whole))]),
        ca.Function("bends", [whole, flat, multipliers], [ca.densify(bends)]),
    )


def _rows(basis: FourierBasis, angle: float, derivative: int, varies: bool) -> FloatArray:
    """``x``, ``y`` and ``r`` at an angle, or their derivatives there, by all variables (3, P)."""
    size, functions = basis.n_components, basis.values(angle, derivative)
    result = np.zeros((3, 3 * size + 1 if varies else 2 * size + 1))
    result[0, :size] = result[1, size : 2 * size] = functions
    result[2, 2 * size] = derivative == 0
    if varies:
        result[2, 2 * size + 1 :] = functions
    return result
