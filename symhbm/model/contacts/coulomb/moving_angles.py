"""How the events of friction contacts move with their motion: the rest of second derivatives.

At fixed switching angles the force is bilinear in displacements and parameters. The angles move
with the motion: the end of a stretch of stick by ``-q / (k_d dy/dtau)``, ``q`` being the jump of
the derivatives of the force there, its begin, a reversal, by ``-(dphi/dtau) / (d2y/dtau2)``,
``phi`` being the basis functions. What that adds is closed form, for any number of reversals, and
grows without bound towards the onset of slip.
"""

from typing import Any

import numpy as np

from symhbm.model.contacts.coulomb.state import ContactState
from symhbm.numerics import FloatArray, FourierBasis, turning_hessian, turning_points

_GRAZING = 1e-9
"""Relative velocity at an onset, over its largest, below which it has no second derivative."""


def moving_angles(
    basis: FourierBasis,
    coefficients: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
    weights: FloatArray,
    slip: Any,
    friction: ContactState,
) -> FloatArray:
    """Second derivatives of weighted friction forces by the motion of their angles alone.

    Parameters
    ----------
    basis
        The harmonic set.
    coefficients, weights : (n_contacts, n_components)
        Relative displacement [m], and the weights of the force's coefficients.
    contact_stiffness, slip_limit, slip : (n_contacts,)
        ``k_d`` [N/m], ``mu F_n`` [N], and whether each contact slips.
    friction
        The events of the contacts.

    Returns
    -------
    (n_contacts, n_components + 2, n_components + 2), by the displacement, ``k_d`` and ``mu F_n``.
    Where ``mu F_n`` is 0 the second derivative by it is unbounded, and 0 here.
    """
    n_contacts, size = coefficients.shape
    result = np.zeros((n_contacts, size + 2, size + 2))
    contact, begin, end = friction.stick_intervals
    kept = np.asarray(slip)[contact] & (contact_stiffness[contact] > 0)
    contact, begin, end = contact[kept], begin[kept], end[kept]
    stiffness, limit = contact_stiffness[contact], slip_limit[contact]
    motion, weight = coefficients[contact], weights[contact]

    at_begin, at_end = basis.values(begin), basis.values(end)
    jump = np.empty((len(contact), size + 2))
    jump[:, :size] = stiffness[:, None] * (at_end - at_begin)
    travel = np.einsum("im,im->i", at_end - at_begin, motion)
    jump[:, size] = travel
    # k_d times the travel is 0 or twice the limit, up or down.
    safe = np.where(limit > 0, limit, 1.0)
    jump[:, size + 1] = -2 * np.round(stiffness * travel / (2 * safe))
    velocity = np.einsum("im,im->i", basis.values(end, 1), motion)
    fastest = np.abs(motion) @ basis.order
    grazing = np.abs(velocity) <= _GRAZING * fastest
    test = np.einsum("im,im->i", at_end * basis.norm, weight)
    factor = np.where(grazing, 0.0, -test / (stiffness * np.where(grazing, 1.0, velocity)))
    np.add.at(result, contact, factor[:, None, None] * jump[:, :, None] * jump[:, None, :])

    slope = basis.values(begin, 1)
    bend = np.einsum("im,im->i", basis.values(begin, 2), motion)
    on_run = basis.integrals(basis.moments(np.column_stack([begin, end]))[:, 0])
    bend = np.where(bend == 0, np.inf, bend)
    share = np.einsum("im,im->i", on_run, weight) * stiffness / bend
    moved = share[:, None, None] * slope[:, :, None] * slope[:, None, :]
    np.add.at(result[:, :size, :size], contact, moved)
    # With no limit, where no run is left, the force turns its sign at the reversal itself.
    turned = np.where(limit > 0, 0.0, 2 * test / np.abs(bend))[:, None] * slope
    np.add.at(result[:, :size, size + 1], contact, turned)
    np.add.at(result[:, size + 1, :size], contact, turned)
    if basis.order[0] == 0:
        result[:, :size, :size] += _centred(basis, coefficients, contact_stiffness, weights, slip)
    return result


def _centred(basis, coefficients, contact_stiffness, weights, slip) -> FloatArray:
    """Of the static force of contacts that stick, centred between the extremes of the motion."""
    points = turning_points(basis, coefficients)
    low = points.angle[np.arange(len(coefficients)), points.lowest]
    bends = sum(turning_hessian(basis, coefficients, at) for at in (points.angle[:, 0], low))
    factor = np.where(slip, 0.0, -contact_stiffness / 2 * weights[:, 0])
    return factor[:, None, None] * bends
