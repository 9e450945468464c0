"""Dry friction with located switching angles, for any motion.

Along one period the slider is marched over the reversals of the relative displacement ``y``, and
each change from stick to slip is located.
"""

import numpy as np
from numpy.typing import NDArray

from symhbm.extremes import TurningPoints, monotone_root, turning_points
from symhbm.fourier import FloatArray, FourierBasis
from symhbm.friction import LocatedFriction, full_stick, limit_excess
from symhbm.one_harmonic import locate_one_harmonic


def locate(
    basis: FourierBasis,
    coefficients: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
    slip: NDArray[np.bool_] | None = None,
) -> LocatedFriction:
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
    points = turning_points(basis, coefficients)
    rows = np.arange(len(coefficients))
    spread = points.value[:, 0] - points.value[rows, points.lowest]
    excess, state = limit_excess(spread, contact_stiffness, slip_limit, slip)

    angle, stick, sign, origin = _march(basis, coefficients, points, contact_stiffness, slip_limit)
    moments = basis.moments(angle)
    on_interval = basis.integrals(moments)
    run_start = basis.values(origin)
    matrix = basis.products(np.einsum("ck,ckq->cq", stick, moments))
    matrix -= np.einsum("ck,cki,ckj->cij", stick, on_interval, run_start)
    vector = np.einsum("ck,cki->ci", sign, on_interval)

    high, low = basis.values(points.angle[:, 0]), basis.values(points.angle[rows, points.lowest])
    moves = points.count > 0
    held = ~state
    matrix[held] = full_stick(basis, high[held], low[held], moves[held])
    vector[held] = 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        gradient = np.where(moves[:, None], (high - low) / spread[:, None], 0.0)

    # The run of a contact that slips on a branch ends there.
    ends = (origin[:, 1::2] != origin[:, 0::2]) & (state & (excess > 0) & moves)[:, None]
    simple = points.count == 2
    return LocatedFriction(
        matrix=matrix,
        vector=vector,
        slip=state,
        excess=excess,
        excess_gradient=gradient,
        theta_0=np.where(simple, points.angle[:, 0] % (2 * np.pi), np.nan),
        theta_star=np.where(simple & state, angle[:, 1] % (2 * np.pi), np.nan),
        stick_fraction=np.where(state, (stick * np.diff(angle)).sum(axis=1) / (2 * np.pi), 1.0),
        reversals=points.count,
        stick_begin=np.where(ends, origin[:, 0::2], np.nan),
        stick_end=np.where(ends, angle[:, 1::2], np.nan),
    )


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


def _march(
    basis: FourierBasis,
    coefficients: FloatArray,
    points: TurningPoints,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """March the slider once around the period, from the global maximum, where ``f = g``.

    Returns the ends of the intervals (n_contacts, n + 1), and per interval (n_contacts, n) whether
    it sticks (1.0 or 0.0), the sign of the limit its force is tied to, and the angle at which its
    stick run began. Sticking and slipping intervals alternate; either may be empty.
    """
    n_contacts = len(coefficients)
    start = np.column_stack([points.angle, points.angle[:, 0] + 2 * np.pi])
    still = points.count == 0
    start[still, -1] = start[still, 0]
    value = np.column_stack([points.value, points.value[:, 0]])
    n_branches = start.shape[1] - 1
    force, sign, origin = slip_limit.copy(), np.ones(n_contacts), start[:, 0].copy()
    target = np.empty((n_contacts, n_branches))
    slips = np.zeros((n_contacts, n_branches), dtype=bool)
    signs = np.empty((n_contacts, 2 * n_branches))
    origins = np.empty((n_contacts, 2 * n_branches))
    stiffness = np.where(contact_stiffness > 0, contact_stiffness, 1.0)
    for k in range(n_branches):
        trial = force + contact_stiffness * (value[:, k + 1] - value[:, k])
        at_low = (k + 1 == points.lowest) if k + 1 < n_branches else np.zeros(n_contacts, bool)
        at_high = k + 1 == n_branches
        limited = np.clip(trial, -slip_limit, slip_limit)
        limited = np.where(at_low, -slip_limit, slip_limit if at_high else limited)
        slips[:, k] = (np.abs(trial) > slip_limit) | at_low | at_high
        target[:, k] = value[:, k] + (limited - force) / stiffness
        signs[:, 2 * k], origins[:, 2 * k] = sign, origin
        reached = np.where(at_low, -1.0, 1.0 if at_high else np.where(trial < 0, -1.0, 1.0))
        sign = np.where(slips[:, k], reached, sign)
        origin = np.where(slips[:, k], start[:, k + 1], origin)
        signs[:, 2 * k + 1], origins[:, 2 * k + 1] = sign, origin
        force = limited

    onset = start[:, 1:].copy()
    contact, branch = np.nonzero(slips)
    onset[contact, branch] = _onset(
        basis,
        coefficients[contact],
        start[contact, branch],
        start[contact, branch + 1],
        value[contact, branch],
        value[contact, branch + 1],
        target[contact, branch],
    )
    angle = np.empty((n_contacts, 2 * n_branches + 1))
    angle[:, 0::2] = start
    angle[:, 1::2] = onset
    stick = np.zeros((n_contacts, 2 * n_branches))
    stick[:, 0::2] = 1.0
    return angle, stick, signs, origins


def _onset(basis, coefficients, left, right, y_left, y_right, target) -> FloatArray:
    """Angles where ``y`` reaches ``target`` on monotone branches (closed form for one harmonic)."""
    span = np.where(y_right == y_left, 1.0, y_right - y_left)
    share = np.clip((target - y_left) / span, 0.0, 1.0)
    guess = left + (right - left) * np.arccos(1 - 2 * share) / np.pi
    inside = (share > 0) & (share < 1)
    if basis.has_one_harmonic or not inside.any():
        return guess
    aim = target[inside]
    weights = [basis.weights(coefficients[inside], derivative) for derivative in (0, 1)]

    def value_and_slope(tau: FloatArray) -> tuple[FloatArray, FloatArray]:
        trigonometric = basis.trigonometric(tau)
        value, slope = (np.einsum("kj,kj->k", trigonometric, w) for w in weights)
        return value - aim, slope

    guess[inside] = monotone_root(
        value_and_slope,
        left[inside],
        right[inside],
        (y_right > y_left)[inside],
        guess[inside],
        np.finfo(float).eps * np.abs(coefficients[inside]).sum(axis=1),
    )
    return guess
