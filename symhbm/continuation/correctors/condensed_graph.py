"""The linear part of a condensed structure under one harmonic as a graph of CasADi.

What `DynamicStiffness.added` computes with NumPy, for corrections that are one compiled call.
Complex numbers are pairs of real and imaginary parts.
"""

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from symhbm.balance import DynamicStiffness
from symhbm.model.condensation import OUTSIDE, PoleResidueFunction

Pair = tuple[Any, Any]


class _Balance(NamedTuple):
    """Forces of one harmonic, component by component, and what belongs to them."""

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
    places, parts = [], []
    for n, at, own, share in structure.parts:
        own_places = [
            [dof * n_components + component for dof in range(size)]
            for component in range(at.start, at.stop)
        ]
        motion = [unknowns[rows] for rows in own_places]
        places += own_places
        if n == 0:
            static = ca.DM(structure.static)
            push = amplitude * ca.DM((own + structure.static[:, size:] @ share).real)
            parts.append(_at_rest(static[:, :size], motion[0], push))
        else:
            function = structure.band_functions[n]
            values = _band_function(function, n, frequency)
            real, imaginary = _pair(share)
            force = _pair(own), (amplitude * real, amplitude * imaginary), amplitude
            inertia = [frequency**2 * n**2 * (ca.DM(structure.mass) @ x) for x in motion]
            parts.append(_moving(values, (motion[0], motion[1]), force, inertia))
    # Component by component so far.
    back = np.argsort(np.concatenate(places)).tolist()
    outputs = [
        ca.vertcat(*(part.forces for part in parts))[back],
        ca.mmax(ca.vertcat(*(part.terms for part in parts))),
        ca.diagcat(*(part.jacobian for part in parts))[back, back],
        ca.vertcat(*(part.by_frequency for part in parts))[back],
        ca.mmax(ca.fabs(ca.vertcat(*(part.inertia for part in parts)))),
    ]
    return ca.Function(
        "condensed", [unknowns, frequency, amplitude], list(map(ca.densify, outputs))
    )


def _at_rest(stiffness: Any, motion: Any, push: Any) -> _Balance:
    terms = ca.fabs(stiffness) @ ca.fabs(motion) + ca.fabs(push)
    nothing = ca.MX(*motion.shape)
    return _Balance(stiffness @ motion - push, terms, ca.MX(stiffness), nothing, nothing)


def _moving(
    values: tuple[Pair, Pair], motion: Pair, force: tuple[Pair, Pair, Any], inertia: list[Any]
) -> _Balance:
    """From ``[Z, G]`` and its derivative, cosine and sine, and the force inside and outside."""
    size = motion[0].shape[0]
    (real, imaginary), slope = values
    own, share, amplitude = force
    stiffness = real[:, :size], imaginary[:, :size]
    seen = _product((real[:, size:], imaginary[:, size:]), share)
    push = [amplitude * part + add for part, add in zip(own, seen, strict=True)]
    pull = _product(stiffness, motion)
    whole = tuple(ca.vertcat(x, -s) for x, s in zip(motion, share, strict=True))
    level, sizes = [ca.fabs(x) for x in motion], [ca.fabs(part) for part in stiffness]
    terms = [sizes[0] @ level[k] + sizes[1] @ level[1 - k] + ca.fabs(push[k]) for k in (0, 1)]
    block = ca.blockcat([[stiffness[0], -stiffness[1]], [stiffness[1], stiffness[0]]])
    return _Balance(
        ca.vertcat(*(p - q for p, q in zip(pull, push, strict=True))),
        ca.vertcat(*terms),
        block,
        ca.vertcat(*_product(slope, (whole[0], whole[1]))),
        ca.vertcat(*inertia),
    )


def _band_function(
    function: PoleResidueFunction, harmonic: int, frequency: Any
) -> tuple[Pair, Pair]:
    """Value at a harmonic of the frequency and derivative by it, as motions ``a + i b`` see them.

    Those are the conjugates of the values for ``a - i b``.
    """
    shape = function.shape
    place = (harmonic * frequency - function.middle) / function.half
    angle = ca.acos(ca.fmin(ca.fmax(place, -1), 1))
    inside = ca.if_else(ca.fabs(place) <= 1 + OUTSIDE, 1, np.nan)
    weights = inside * ca.cos(ca.DM(np.arange(len(function.terms))) * angle)
    smooth = ca.mtimes(ca.DM(function.terms.T), weights)
    # Stored by rows, real and imaginary parts side by side, the derivative after the value.
    parts = ca.reshape(smooth, 2, -1)
    count = shape[0] * shape[1]
    smooth = [
        ca.reshape(parts[k, d * count : (d + 1) * count], shape[1], shape[0]).T
        for d in (0, 1)
        for k in (0, 1)
    ]
    gap = -ca.DM(function.poles.real), harmonic * frequency - ca.DM(function.poles.imag)
    square = gap[0] ** 2 + gap[1] ** 2
    inverse = gap[0] / square, -gap[1] / square
    bent = _times(inverse, inverse)
    factors = inverse, (bent[1], -bent[0])  # the derivative has the factor -i
    left, right = _pair(function.left), _pair(function.right)
    found = []
    for d, factor in enumerate(factors):
        near = _product(_scaled(left, factor), right)
        real, imaginary = (smooth[2 * d + k] + near[k] for k in (0, 1))
        scale = harmonic if d else 1
        found.append((scale * real, -scale * imaginary))
    return found[0], found[1]


def _pair(values: Any) -> Pair:
    return ca.DM(np.real(values)), ca.DM(np.imag(values))


def _product(one: Pair, other: Pair) -> Pair:
    return one[0] @ other[0] - one[1] @ other[1], one[0] @ other[1] + one[1] @ other[0]


def _times(one: Pair, other: Pair) -> Pair:
    return one[0] * other[0] - one[1] * other[1], one[0] * other[1] + one[1] * other[0]


def _scaled(columns: Pair, factors: Pair) -> Pair:
    """Each column times its factor."""
    rows = columns[0].shape[0]
    return _times(columns, (ca.repmat(factors[0].T, rows, 1), ca.repmat(factors[1].T, rows, 1)))
