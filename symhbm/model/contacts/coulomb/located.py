"""Located switching angles of friction: closed under one harmonic, Eqs. (6)-(8), else marched.

Under one harmonic ``y = r cos(tau - theta_0)`` about any mean slips when ``k_d r > g``, from
``theta_star = theta_0 + arccos(1 - 2 g / (k_d r))`` to the next extreme. The second half period
mirrors the first. Under any other motion the slider is marched along one period over the reversals
of the relative displacement ``y``, and each change from stick to slip is located.
"""

from dataclasses import replace
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.coulomb import march
from symhbm.model.contacts.coulomb.state import ContactState, Loop, apart, images
from symhbm.numerics import Compiled, FloatArray, FourierBasis, check_turning, turning_points
from symhbm.numerics.loops import fourier

FREE = -1.0
"""State imposed on a contact that is in the one its motion asks for; 0 is stick, 1 slip."""
_SHORT = 0.3
"""Angle below which its difference from its sine is a series."""


def locate_one_harmonic(
    basis: FourierBasis,
    coefficients: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
    slip: NDArray[np.bool_] | None = None,
) -> ContactState:
    """Locate the events of motions of harmonic 1, with or without a mean.

    Arguments as of `symhbm.model.contacts.coulomb.located.locate`.
    """
    n_contacts, size = coefficients.shape
    imposed = np.full(n_contacts, FREE) if slip is None else np.asarray(slip, dtype=float)
    if not n_contacts:
        return unpack(np.zeros((0, parts_from(size)[-1])), size)
    (found,) = _each(size, n_contacts)(coefficients.ravel(), contact_stiffness, slip_limit, imposed)
    return unpack(found.reshape(n_contacts, -1), size)


def parts_from(size: int) -> list[int]:
    """Where in a column that the kernel gives the parts of a `ContactState` begin, and its end."""
    return np.cumsum([0, size * size + size + 1, size, 6, 4]).tolist()


def unpack(packed: FloatArray, size: int) -> ContactState:
    """What the kernel gives for motions of ``size`` coefficients, a row for each contact."""
    events, gradient, figures, stick = np.split(packed, parts_from(size)[1:-1], axis=1)
    return ContactState(events, gradient, figures, stick.reshape(len(packed), 2, 2))


@lru_cache(maxsize=64)
def _each(size: int, n_contacts: int) -> Compiled:
    return Compiled(one_harmonic_kernel(size).map(n_contacts))


@lru_cache(maxsize=4)
def one_harmonic_kernel(size: int) -> ca.Function:
    """CasADi function of one contact: all of `ContactState`, one after the other, from its motion.

    Inputs: ``coefficients`` (size), the last two of harmonic 1 [m], ``contact_stiffness`` [N/m],
    ``slip_limit`` [N], and the state ``imposed``.
    """
    y = ca.SX.sym("coefficients", size)
    stiffness, limit = ca.SX.sym("contact_stiffness"), ca.SX.sym("slip_limit")
    imposed = ca.SX.sym("imposed")
    cosine, sine = y[-2], y[-1]
    radius = ca.hypot(cosine, sine)
    moves = radius > 0
    theta_0 = ca.atan2(sine, cosine)
    travel = stiffness * radius
    # Without limit any motion slips, without motion or spring none does.
    bounded = ca.logic_and(limit > 0, travel > 0)
    logarithm = ca.log(_where(bounded, travel, 1)) - ca.log(_where(bounded, limit, 1))
    slip_margin = _where(bounded, logarithm, _where(limit > 0, -ca.inf, ca.inf))
    free = ca.logic_or(imposed < 0, ca.logic_not(bounded))
    state = _where(free, slip_margin > 0, imposed)
    slides = ca.logic_and(state, moves)
    pulls = ca.logic_and(slides, travel > 0)
    share = _where(pulls, ca.fmin(limit / _where(pulls, travel, 1), 1), ca.logic_not(slides))
    # cos(stick) = 1 - 2 share, in forms that keep their digits for stiff contacts in gross slip.
    stick = 2 * ca.atan2(ca.sqrt(share), ca.sqrt(1 - share))
    sin_stick = 2 * ca.sqrt(share * (1 - share))
    bend = _angle_minus_sine(stick, sin_stick)

    # The 2 x 2 block of the matrix in axes along the motion and across it, and the vector.
    along, across = bend / 2 - sin_stick * share, bend / 2 + sin_stick * share
    upper, lower = sin_stick**2 / 2, -2 * share**2
    push_along, push_across = 4 / np.pi * sin_stick, 4 / np.pi * (2 * share - 1)
    # Turned to the axes of cosine and sine.
    safe = _where(moves, radius, 1)
    c, s = _where(moves, cosine / safe, 1), sine / safe
    turn: Any = ca.horzcat(ca.vertcat(c, s), ca.vertcat(-s, c))
    local = ca.horzcat(ca.vertcat(along, lower), ca.vertcat(upper, across))
    block = 2 / np.pi * (turn @ local @ turn.T)
    push = turn @ ca.vertcat(push_along, push_across)

    matrix = ca.SX.zeros(size, size)
    vector, gradient = ca.SX.zeros(size), ca.SX.zeros(size)
    still = ca.logic_and(state, ca.logic_not(moves))
    for i in range(size):
        for j in range(size):
            inside = i >= size - 2 and j >= size - 2
            slipping = block[i - size + 2, j - size + 2] if inside else 0
            sticking = float(i == j) if inside else 0
            entry = _where(state, slipping, sticking)
            matrix[i, j] = _where(still, 0, entry)
    vector[-2:] = push * pulls
    gradient[-2:] = ca.vertcat(c, s) / safe * moves
    turns = 2 * np.pi
    theta_star = theta_0 + stick
    theta_0 = _where(moves, _positive(theta_0), np.nan)
    # A contact held in slip short of its limit never leaves its stretch of stick.
    begin = _where(ca.logic_and(slides, slip_margin > 0), theta_0, np.nan)
    theta_star = _where(theta_star < turns, _positive(theta_star), theta_star)
    sticking = _where(moves, stick / np.pi, 0)
    packed = ca.vertcat(
        *(ca.vec(matrix), vector, state * sticking, gradient),
        *(state, slip_margin, theta_0, _where(slides, theta_star, np.nan)),
        *(_where(state, sticking, 1), 2 * moves),
        *(begin, begin + np.pi, begin + stick, begin + np.pi + stick),
    )
    return ca.Function("one_harmonic", [y, stiffness, limit, imposed], [ca.densify(packed)])


def _where(condition: Any, value: Any, other: Any) -> Any:
    return ca.if_else(condition, value, other)


def _positive(angle: Any) -> Any:
    return _where(angle < 0, angle + 2 * np.pi, angle)


def _angle_minus_sine(angle: Any, sine: Any) -> Any:
    square = angle**2
    series = 1 - square / 20 * (1 - square / 42 * (1 - square / 72 * (1 - square / 110)))
    return _where(angle < _SHORT, angle**3 / 6 * series, angle - sine)


def locate(
    basis: FourierBasis,
    coefficients: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
    slip: NDArray[np.bool_] | None = None,
) -> ContactState:
    """Locate the events of friction contacts from the coefficients of their motion, Eqs. (4)-(8).

    Parameters
    ----------
    basis
        The harmonic set.
    coefficients : (n_contacts, n_components)
        Relative displacement [m].
    contact_stiffness : (n_contacts,)
        ``k_d`` [N/m].
    slip_limit : (n_contacts,)
        ``g = mu F_n`` [N].
    slip : (n_contacts,)
        State to impose, for continuation past the onset or the end of slip: a contact held in
        stick follows its spring beyond ``g``, one held in slip is put on ``+-g`` at the extremes
        of ``y`` even where it would not reach them. Both agree with the law, and have its
        derivative, up to the limit. By default each contact is in the state its motion asks for.
    """
    if basis.highest == 1:
        return locate_one_harmonic(basis, coefficients, contact_stiffness, slip_limit, slip)
    if basis.divisor > 1:
        found = locate(basis.reduced, coefficients, contact_stiffness, slip_limit, slip)
        return _repeated(found, basis.divisor)
    n, size = coefficients.shape
    sliders, held = np.empty((n, 2)), np.empty(n)
    sliders[:, 0], sliders[:, 1] = contact_stiffness, slip_limit
    held[:] = march.FREE if slip is None else slip
    motions = np.ascontiguousarray(coefficients, dtype=float)
    events, gradients = np.empty((n, size * size + size + 1)), np.empty((n, 1, size))
    details, margins = np.empty((n, n_details(basis))), np.empty((n, 1))
    check_turning(
        march.locate(basis.arrays, motions, sliders, held, events, margins, gradients, details)
    )
    stick = details[:, 6:].reshape(n, 2, 2 * basis.highest)
    return ContactState(events, gradients[:, 0], details[:, :6], stick)


def n_details(basis: FourierBasis) -> int:
    """Number of details of a contact that `march.locate` writes."""
    return 6 + 4 * basis.highest


def on_loop(
    friction: ContactState,
    basis: FourierBasis,
    motion: FloatArray,
    contact_stiffness: float,
    slip_limit: float,
    loop: Loop,
    slips: bool,
) -> ContactState:
    """The same friction with one contact held on a loop: in stick to its end, or slipping there.

    Both agree with the law, and have its derivative, up to the limit. ``motion`` (n_components,)
    [m] is that of the contact. ArithmeticError where its force is not periodic on such a loop.
    """
    vibration = np.where(basis.order > 0, motion, 0.0)
    points = turning_points(basis, vibration[None])
    n = int(points.count[0])
    first = int(np.argmin(apart(points.angle[0, :n], loop.begin)))
    turn = (first + np.arange(n + 1)) % n
    angle, value = points.angle[0, turn], points.value[0, turn]
    angle = angle + 2 * np.pi * (angle < angle[0])
    angle[-1] = angle[0] + 2 * np.pi
    forced = np.full(n, march.FREE)
    count = images(basis, motion)
    for end in loop.end + 2 * np.pi * np.arange(count) / count:
        forced[np.argmin(apart(angle[1:], end))] = march.SLIPS if slips else march.STICKS
    order, is_sine, norm = basis.arrays
    waves, runs = np.empty((2, basis.highest + 1)), np.empty((n, 3))
    fourier.as_series(order, is_sine, vibration, waves[0], waves[1])
    slider = loop.sides[0], float(contact_stiffness), float(slip_limit)
    used, last = march.runs_of(waves, angle, value, forced, *slider, runs)
    runs = runs[:used]
    if last != n or runs[:, march.JUMP].sum():
        raise ArithmeticError("the force is not periodic on this loop")
    size, events = len(motion), friction.events.copy()
    events[loop.contact, :-1] = 0.0
    matrix, vector = np.split(events[loop.contact, :-1], [size * size])
    march.add_force(order, is_sine, norm, runs, 1.0, matrix.reshape(size, size), vector)
    if basis.order[0] == 0:
        vector[0] += loop.sides[0] - 1
    more = max(used - friction.stick.shape[2], 0)
    stick = np.pad(friction.stick, ((0, 0), (0, 0), (0, more)), constant_values=np.nan)
    stick[loop.contact] = np.nan
    stick[loop.contact, :, :used] = runs[:, [march.BEGIN, march.END]].T
    return replace(friction, events=events, stick=stick)


def stick_intervals(
    basis: FourierBasis,
    coefficients: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
    """Intervals in which contacts that slip stick in between; arguments as in `locate`.

    Returns the contact, the angle where it begins to stick and the one where it begins to slip
    [rad], each (n_intervals,), contact by contact and ascending. A contact that never slips has no
    interval.
    """
    return locate(basis, coefficients, contact_stiffness, slip_limit).stick_intervals


def _repeated(friction: ContactState, times: int) -> ContactState:
    """The events of the same motions with as many periods in one."""
    shift = 2 * np.pi / times * np.arange(times)[:, None]
    stick = friction.stick[:, :, None] / times + shift
    figures = friction.figures.copy()
    figures[:, [march.THETA_0, march.THETA_STAR]] = np.nan
    figures[:, march.REVERSALS] *= times
    return replace(friction, figures=figures, stick=stick.reshape(len(figures), 2, -1))
