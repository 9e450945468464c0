"""The switching angles of friction contacts that move with their motion.

A contact sticks from a reversal to where its force reaches the limit again, and remembers in
between where it reversed. Second derivatives grow without bound towards the onset of slip.
"""

from typing import Any

import numpy as np

from symhbm.model.contacts.coulomb.state import ContactState
from symhbm.model.contacts.motions import Events
from symhbm.numerics import FloatArray, FourierBasis, turning_points

_GRAZING = 1e-9
"""Relative velocity at an onset, over its largest, below which it has no second derivative."""


def moving_angles(
    basis: FourierBasis,
    coefficients: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
    slip: Any,
    friction: ContactState,
) -> Events:
    """Switching angles, which move with the displacement, ``k_d`` and ``mu F_n``.

    ``coefficients`` (n_contacts, n_components) [m]; ``contact_stiffness``, ``slip_limit`` and
    ``slip`` (n_contacts,) are ``k_d`` [N/m], ``mu F_n`` [N], and whether each contact slips. Where
    ``mu F_n`` is 0 the second derivative by it is unbounded, and 0 here.
    """
    contact, begin, end = friction.stick_intervals
    kept = np.asarray(slip)[contact] & (contact_stiffness[contact] > 0)
    contact, begin, end = contact[kept], begin[kept], end[kept]
    stiffness, limit, motion = (
        contact_stiffness[contact],
        slip_limit[contact],
        coefficients[contact],
    )

    at_begin, at_end = basis.values(begin), basis.values(end)
    travel = np.einsum("im,im->i", at_end - at_begin, motion)
    # k_d times the travel is 0 or twice the limit, up or down.
    turns = -2 * np.round(stiffness * travel / (2 * np.where(limit > 0, limit, 1.0)))
    jump = np.column_stack([stiffness[:, None] * (at_end - at_begin), travel, turns])
    velocity = np.einsum("im,im->i", basis.values(end, 1), motion)
    grazing = np.abs(velocity) <= _GRAZING * (np.abs(motion) @ basis.order)
    rate = stiffness * np.where(grazing, np.inf, velocity)
    onsets = Events(contact, -jump / rate[:, None], jump[:, None], at_end * basis.norm)

    on_run = basis.integrals(basis.moments(np.column_stack([begin, end]))[:, 0])
    parts = [onsets, _turning(basis, contact, begin, motion, -stiffness, on_run)]
    if not limit.all():
        # With no limit, where no run is left, the force turns its sign at the reversal itself, and
        # every second derivative by the limit comes from there.
        bend = np.einsum("im,im->i", basis.values(begin, 2), motion)
        turned = np.zeros_like(jump)
        turned[:, -1] = np.where(limit > 0, 0.0, -4 * np.sign(bend))
        parts.append(parts[1]._replace(jump=turned[:, None], share=onsets.share))
    sticks = np.flatnonzero(~np.asarray(slip))
    if len(sticks) and basis.order[0] == 0:
        # The static force of contacts that stick is centred between the extremes of the motion.
        points, motion = turning_points(basis, coefficients[sticks]), coefficients[sticks]
        low = points.angle[np.arange(len(sticks)), points.lowest]
        share = np.eye(1, len(basis.order)) / 2 + np.zeros((len(sticks), 1))
        for angle in (points.angle[:, 0], low):
            turning = _turning(basis, sticks, angle, motion, -contact_stiffness[sticks], share)
            parts.append(turning)
    return Events.joined(*parts)


def _turning(
    basis: FourierBasis,
    contact: Any,
    angle: FloatArray,
    motion: FloatArray,
    factor: FloatArray,
    share: FloatArray,
) -> Events:
    """Turning points of motions, whose values times a ``factor`` the force remembers."""
    slope = np.pad(basis.values(angle, 1), ((0, 0), (0, 2)))
    bend = np.einsum("im,im->i", basis.values(angle, 2), motion)
    gradient = -slope / np.where(bend == 0, np.inf, bend)[:, None]
    return Events(contact, gradient, (factor[:, None] * slope)[:, None], share)
