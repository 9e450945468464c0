"""CasADi graph of the linear forces of a condensed structure under one harmonic.

It computes what `DynamicStiffness.added` computes with NumPy, for the compiled corrector. Complex
numbers are pairs of real and imaginary parts.
"""

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from symhbm.balance import DynamicStiffness
from symhbm.model.condensation import OUTSIDE, PoleResidueFunction

Pair = tuple[Any, Any]


class _Balance(NamedTuple):
    """Forces of one harmonic, component by component, their absolute terms and derivatives."""

    forces: Any
    terms: Any
    jacobian: Any
    by_frequency: Any
    inertia: Any


def condensed_graph(structure: DynamicStiffness) -> ca.Function:
    """CasADi function of the forces of a condensed structure, for harmonics 0 and 1.

    Inputs: unknowns [m], frequency [rad/s] and amplitude of the excitation. Outputs: forces [N],
    the largest sum of their absolute terms [N], derivatives by the unknowns and by the frequency,
    and the largest inertia force [N]. NaN outside the band.
    """
    assert structure.band_functions is not None
    assert structure.mass is not None
    size, n_components = len(structure.mass), structure.n_components
    unknowns = ca.MX.sym("unknowns", size * n_components)
    frequency, amplitude = ca.MX.sym("frequency"), ca.MX.sym("amplitude")
    indices, balances = [], []
    factors, rates = (structure.factors(frequency, derivative) for derivative in (0, 1))
    for n, components, kept_shapes, inner_shapes in structure.parts:
        by_component = [
            [dof * n_components + component for dof in range(size)]
            for component in range(components.start, components.stop)
        ]
        motion = [unknowns[rows] for rows in by_component]
        indices += by_component
        if n == 0:
            static = ca.DM(structure.static)
            shape = kept_shapes + inner_shapes @ structure.static[:, size:].T
            push = _sum(factors, shape)[0]
            load = amplitude * push + ca.DM(structure.load)
            balances.append(_at_rest(static[:, :size], motion[0], load))
        else:
            band_function = structure.band_functions[n]
            values = _band_function(band_function, n, frequency)
            force, rate = (
                [
                    tuple(amplitude * part for part in _sum(scale, shapes))
                    for shapes in (kept_shapes, inner_shapes)
                ]
                for scale in (factors, rates)
            )
            inertia = [frequency**2 * n**2 * (ca.DM(structure.mass) @ x) for x in motion]
            given = force, rate if any(structure.powers) else None
            balances.append(_moving(values, (motion[0], motion[1]), given, inertia))
    # The forces are ordered by component, the unknowns by degree of freedom.
    order = np.argsort(np.concatenate(indices)).tolist()
    outputs = [
        ca.vertcat(*(balance.forces for balance in balances))[order],
        ca.mmax(ca.vertcat(*(balance.terms for balance in balances))),
        ca.diagcat(*(balance.jacobian for balance in balances))[order, order],
        ca.vertcat(*(balance.by_frequency for balance in balances))[order],
        ca.mmax(ca.fabs(ca.vertcat(*(balance.inertia for balance in balances)))),
    ]
    return ca.Function(
        "condensed", [unknowns, frequency, amplitude], list(map(ca.densify, outputs))
    )


def _at_rest(stiffness: Any, motion: Any, load: Any) -> _Balance:
    terms = ca.fabs(stiffness) @ ca.fabs(motion) + ca.fabs(load)
    zeros = ca.MX(*motion.shape)
    return _Balance(stiffness @ motion - load, terms, ca.MX(stiffness), zeros, zeros)


def _moving(
    values: tuple[Pair, Pair], motion: Pair, given: tuple[Any, Any], inertia: list[Any]
) -> _Balance:
    """Forces from ``[Z, G]`` and its derivative, and from the force on kept and inner motions.

    The force is given with its derivative by the frequency, None where it does not change.
    """
    size = motion[0].shape[0]
    (real, imaginary), slope = values
    (kept, inner), rate = given
    stiffness = real[:, :size], imaginary[:, :size]
    inside = real[:, size:], imaginary[:, size:]
    transmitted = _product(inside, inner)
    load = [part + other for part, other in zip(kept, transmitted, strict=True)]
    restoring = _product(stiffness, motion)
    variables = tuple(ca.vertcat(x, -s) for x, s in zip(motion, inner, strict=True))
    level, sizes = [ca.fabs(x) for x in motion], [ca.fabs(part) for part in stiffness]
    terms = [sizes[0] @ level[k] + sizes[1] @ level[1 - k] + ca.fabs(load[k]) for k in (0, 1)]
    block = ca.blockcat([[stiffness[0], -stiffness[1]], [stiffness[1], stiffness[0]]])
    by_frequency = ca.vertcat(*_product(slope, (variables[0], variables[1])))
    if rate is not None:
        by_frequency -= ca.vertcat(*rate[0]) + ca.vertcat(*_product(inside, rate[1]))
    return _Balance(
        ca.vertcat(*(p - q for p, q in zip(restoring, load, strict=True))),
        ca.vertcat(*terms),
        block,
        by_frequency,
        ca.vertcat(*inertia),
    )


def _band_function(
    function: PoleResidueFunction, harmonic: int, frequency: Any
) -> tuple[Pair, Pair]:
    """Value at a harmonic of the frequency and derivative by that, for motions ``a + i b``.

    They are the conjugates of the values for ``a - i b``.
    """
    shape = function.shape
    position = (harmonic * frequency - function.middle) / function.half
    angle = ca.acos(ca.fmin(ca.fmax(position, -1), 1))
    inside = ca.if_else(ca.fabs(position) <= 1 + OUTSIDE, 1, np.nan)
    weights = inside * ca.cos(ca.DM(np.arange(len(function.terms))) * angle)
    of_both = ca.horzcat(weights, ca.mtimes(ca.DM(function.derivative.T), weights))
    # Stored by rows, real and imaginary parts side by side.
    parts = ca.reshape(ca.mtimes(ca.DM(function.terms.T), of_both), 2, -1)
    count = shape[0] * shape[1]
    of_terms = [
        ca.reshape(parts[k, d * count : (d + 1) * count], shape[1], shape[0]).T
        for d in (0, 1)
        for k in (0, 1)
    ]
    gap = -ca.DM(function.poles.real), harmonic * frequency - ca.DM(function.poles.imag)
    square = gap[0] ** 2 + gap[1] ** 2
    inverse = gap[0] / square, -gap[1] / square
    inverse_square = _times(inverse, inverse)
    factors = inverse, (inverse_square[1], -inverse_square[0])  # the derivative has the factor -i
    left, right = _pair(function.left), _pair(function.right)
    values = []
    for d, factor in enumerate(factors):
        of_poles = _product(_scaled(left, factor), right)
        real, imaginary = (of_terms[2 * d + k] + of_poles[k] for k in (0, 1))
        scale = harmonic if d else 1
        values.append((scale * real, -scale * imaginary))
    return values[0], values[1]


def _pair(values: Any) -> Pair:
    return ca.DM(np.real(values)), ca.DM(np.imag(values))


def _sum(factors: list[Any], shapes: Any) -> Pair:
    """The sum of complex shapes (n_powers, n), each times its factor."""
    pairs = [_pair(shape) for shape in shapes]
    real = sum(factor * pair[0] for factor, pair in zip(factors, pairs, strict=True))
    imaginary = sum(factor * pair[1] for factor, pair in zip(factors, pairs, strict=True))
    return ca.MX(real), ca.MX(imaginary)


def _product(a: Pair, b: Pair) -> Pair:
    return a[0] @ b[0] - a[1] @ b[1], a[0] @ b[1] + a[1] @ b[0]


def _times(a: Pair, b: Pair) -> Pair:
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def _scaled(columns: Pair, factors: Pair) -> Pair:
    """Each column times its factor."""
    rows = columns[0].shape[0]
    return _times(columns, (ca.repmat(factors[0].T, rows, 1), ca.repmat(factors[1].T, rows, 1)))
