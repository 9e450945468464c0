"""Friction contacts whose motion turns twice a period, compiled: the common case.

Such a contact slips when its motion spans more than ``2 g / k_d``: from where it has gone so far
after an extreme, up to the next one. Extremes and onsets are found by a few steps of third order
from good guesses. The kernel tells whether they settled where they are to be; where they did not,
`symhbm.model.contacts.coulomb.located` marches the slider in general.
"""

from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.coulomb.one_harmonic import FREE, packed_size, unpack
from symhbm.model.contacts.coulomb.state import ContactState
from symhbm.numerics import MACHINE, Cells, Compiled, FloatArray, FourierBasis, Motions, constant

_STEPS_TO_EXTREME, _STEPS_TO_ONSET = 2, 3
_LARGEST = 20
"""Coefficients of a motion up to which this is faster than NumPy."""


def locate_two_reversals(
    motions: Motions,
    cells: Cells,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
    slip: NDArray[np.bool_] | None = None,
) -> ContactState | None:
    """Locate the events of motions that turn in ``cells`` alone.

    Other arguments as of `symhbm.model.contacts.coulomb.located.locate`. None unless each turns
    twice and every angle is found, and for large sets of harmonics.
    """
    basis, n_contacts = motions.basis, len(motions.coefficients)
    each = 1 if basis.mirrors else 2
    if len(cells.owner) != each * n_contacts or not n_contacts or basis.n_components > _LARGEST:
        return None
    if np.any(cells.owner[::each] != np.arange(n_contacts)):
        return None
    imposed = FREE if slip is None else slip
    brackets = np.concatenate([cells.left, cells.width, cells.begin.T.ravel(), cells.end.T.ravel()])
    brackets = brackets.reshape(6, n_contacts, each)
    size = basis.n_components
    inputs = motions.coefficients.ravel(), contact_stiffness, slip_limit, imposed
    (found,) = _each(basis, n_contacts)(
        *inputs, motions.bounds.ravel(), brackets.transpose(1, 2, 0).ravel()
    )
    found = found.reshape(n_contacts, packed_size(size) + 1)
    return unpack(found[:, :-1], size) if found[:, -1].all() else None


@lru_cache(maxsize=64)
def _each(basis: FourierBasis, n_contacts: int) -> Compiled:
    return Compiled(_kernel(basis).map(n_contacts))


class _Wave:
    """A motion as symbols."""

    def __init__(self, basis: FourierBasis, coefficients: Any, bounds: Any):
        self.basis, self.bounds = basis, bounds
        self.cosines, self.sines = (
            [
                coefficients[basis.component(n, sine)] if n or not sine else 0
                for n in basis.harmonics
            ]
            for sine in (False, True)
        )

    def derivative(self, turns: list[tuple[Any, Any]], order: int) -> Any:
        """A derivative at the angle of `_turns`."""
        total: Any = 0
        for n, a, b in zip(self.basis.harmonics, self.cosines, self.sines, strict=True):
            c, s = turns[n]
            # A quarter of a turn per derivative.
            c, s = ((c, s), (-s, c), (-c, -s), (s, -c))[order % 4]
            total += float(n) ** order * (a * c + b * s)
        return total

    def crossing(self, order: int, level: Any, start: Any, steps: int) -> tuple[Any, Any]:
        """Angle where a derivative crosses a level, and whether the last step was small."""
        tau, settled = start, 0
        for _ in range(steps):
            turns = _turns(tau, self.basis.highest)
            value, slope, bend = (self.derivative(turns, order + d) for d in range(3))
            newton = (level - value) / slope
            root = ca.sqrt(ca.fmax(1 + 2 * newton * bend / slope, 0))
            step = 2 * newton / (1 + root)
            tau = tau + step
            settled = ca.fabs(step**3 / slope) * self.bounds[order + 3] < 6 * MACHINE
        return tau, settled


def _turns(tau: Any, highest: int) -> list[tuple[Any, Any]]:
    """Cosines and sines of ``n tau``, ``n = 0 .. highest``."""
    c, s = ca.cos(tau), ca.sin(tau)
    turns = [(ca.SX(1), ca.SX(0)), (c, s)]
    for n in range(2, highest + 1):
        # By halves: round-off grows with the logarithm of n.
        (c, s), (d, t) = turns[n // 2], turns[n - n // 2]
        turns.append((c * d - s * t, s * d + c * t))
    return turns


@lru_cache(maxsize=16)
def _kernel(basis: FourierBasis) -> ca.Function:
    """CasADi function of one contact: all of `ContactState`, packed, and whether it is found.

    Inputs: ``coefficients`` (n_components) [m], ``contact_stiffness`` [N/m], ``slip_limit`` [N],
    the state ``imposed``, the ``bounds`` of `Motions` (5), and of each turning point, one where
    motions mirror, else two, the cell: left end, width, slope and curvature at both ends.
    """
    size, mirrors = basis.n_components, basis.mirrors
    y = ca.SX.sym("coefficients", size)
    stiffness, limit = ca.SX.sym("contact_stiffness"), ca.SX.sym("slip_limit")
    imposed, bounds = ca.SX.sym("imposed"), ca.SX.sym("bounds", 5)
    cells = ca.SX.sym("cells", 6, 1 if mirrors else 2)
    wave = _Wave(basis, y, bounds)

    found, turning = ca.SX(1), []
    for cell in ca.horzsplit(cells):
        tau, settled = wave.crossing(1, 0, _start(*ca.vertsplit(cell)), _STEPS_TO_EXTREME)
        inside = ca.logic_and(tau >= cell[0], tau <= cell[0] + cell[1])
        found = ca.logic_and(found, ca.logic_and(settled, inside))
        turning.append(tau)
    # A falling slope is that of the maximum.
    falls = cells[2, 0] >= 0
    if mirrors:
        first = _where(falls, turning[0], turning[0] + np.pi)
        lowest = first + np.pi
    else:
        first = _where(falls, *turning)
        lowest = _where(falls, turning[1], turning[0] + 2 * np.pi)
    ends = [first, lowest] if mirrors else [first, lowest, first + 2 * np.pi]
    at_end = [_turns(tau, basis.highest) for tau in ends]
    values = [_values(basis, turns) for turns in at_end]
    height = [wave.derivative(turns, 0) for turns in at_end]

    spread = height[0] - height[1]
    travel = stiffness * spread
    # Without limit any motion slips, without spring none does.
    bounded = ca.logic_and(limit > 0, travel > 0)
    logarithm = ca.log(_where(bounded, travel, 1)) - ca.log(_where(bounded, 2 * limit, 1))
    slip_margin = _where(bounded, logarithm, _where(limit > 0, -ca.inf, ca.inf))
    free = ca.logic_or(imposed < 0, ca.logic_not(bounded))
    state = _where(free, slip_margin > 0, imposed)
    pulls = ca.logic_and(state, travel > 0)
    share = _where(pulls, ca.fmin(2 * limit / _where(pulls, travel, 1), 1), ca.logic_not(state))
    partly = ca.logic_and(share > 0, share < 1)

    matrix, vector, onsets = ca.SX.zeros(size, size), ca.SX.zeros(size), []
    half_turn = 2 / np.pi * ca.asin(ca.sqrt(share))
    for branch, sign in zip(range(len(ends) - 1), (1, -1), strict=False):
        left, right = ends[branch : branch + 2]
        level = height[branch] + share * (height[branch + 1] - height[branch])
        onset = left + (right - left) * half_turn
        exact, settled = wave.crossing(0, level, onset, _STEPS_TO_ONSET)
        inside = ca.logic_and(exact >= left, exact <= right)
        found = ca.logic_and(
            found, ca.logic_or(ca.logic_not(partly), ca.logic_and(settled, inside))
        )
        onset = _where(partly, exact, onset)
        onsets.append(onset)
        on_run, products = _integrals(basis, left, onset - left)
        matrix += products - ca.mtimes(on_run, values[branch].T)
        vector += sign * _antiderivative(basis, onset)
    vector *= 2
    if basis.order[0] == 0:
        vector[0] += 1
    if mirrors:
        matrix, vector = 2 * matrix, 2 * vector
    held = ca.SX.eye(size)
    if basis.order[0] == 0:
        held[0, :] -= ((values[0] + values[1]) / 2).T
    matrix = _where(state, matrix, held)
    stick = [onset - left for onset, left in zip(onsets, ends, strict=False)]
    begin = ends[:2]
    end = [onsets[0], onsets[0] + np.pi if mirrors else onsets[-1]]
    # A contact held in slip short of its limit never leaves its stretch of stick.
    leaves = ca.logic_and(state, slip_margin > 0)
    others = [
        state,
        slip_margin,
        _positive(first),
        _where(state, _positive(onsets[0]), np.nan),
        _where(state, sum(stick) / (np.pi if mirrors else 2 * np.pi), 1),
        2,
        *(_where(leaves, tau, np.nan) for tau in begin + end),
        found,
    ]
    gradient = (values[0] - values[1]) / spread
    packed = ca.vertcat(ca.vec(matrix), _where(state, vector, 0), gradient, *others)
    inputs = [y, stiffness, limit, imposed, bounds, cells]
    return ca.Function("two_reversals", inputs, [ca.densify(packed)])


def _start(left, width, slope, bend, slope_right, bend_right) -> Any:
    """Zero of the slope in a cell: cubic interpolation of the angle over the slope."""
    rise = slope_right - slope
    share = -slope / rise
    bow = (1 - share) * (rise / bend - width) - share * (rise / bend_right - width)
    return left + share * (width + (1 - share) * bow)


def _values(basis: FourierBasis, turns: list[tuple[Any, Any]]) -> Any:
    parts = zip(basis.order.astype(int), basis.is_sine.astype(int), strict=True)
    return ca.vertcat(*(turns[n][sine] for n, sine in parts))


def _antiderivative(basis: FourierBasis, tau: Any) -> Any:
    """Integrals of the basis functions up to ``tau``, as coefficients."""
    turns, parts = _turns(tau, basis.highest), []
    for n, sine, norm in zip(basis.order.astype(int), basis.is_sine, basis.norm, strict=True):
        c, s = turns[n]
        parts.append(norm * (tau if n == 0 else (-c if sine else s) / n))
    return ca.vertcat(*parts)


def _integrals(basis: FourierBasis, left: Any, width: Any) -> tuple[Any, Any]:
    """`FourierBasis.integrals` and `FourierBasis.products` of one interval."""
    half, middle = (_turns(tau, 2 * basis.highest) for tau in (width / 2, left + width / 2))
    factors = [2 / n * half[n][1] for n in range(1, len(half))]
    cosines = [width, *(f * c for f, (c, _) in zip(factors, middle[1:], strict=True))]
    sines = [0, *(f * s for f, (_, s) in zip(factors, middle[1:], strict=True))]
    moments = ca.vertcat(*cosines, *sines)
    each = np.eye(moments.shape[0])
    products = basis.products(each).transpose(2, 1, 0).reshape(-1, len(each))
    matrix = ca.mtimes(constant(products), moments)
    on_run = ca.mtimes(constant(basis.integrals(each).T), moments)
    return on_run, ca.reshape(matrix, basis.n_components, basis.n_components)


def _where(condition: Any, value: Any, other: Any) -> Any:
    return ca.if_else(condition, value, other)


def _positive(angle: Any) -> Any:
    return angle - 2 * np.pi * ca.floor(angle / (2 * np.pi))
