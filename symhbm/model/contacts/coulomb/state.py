"""What a spring and a Coulomb slider do over a period: their force by its events, how these move.

With the switching angles known, the force is ``k_d y + offset`` or ``+-g``, ``g = mu F_n``, on a
handful of intervals, and its Fourier coefficients (Eqs. 6-8) are the closed form

    f = k_d A y + g b,

where the matrix ``A`` and the vector ``b`` depend on the angles alone. The force is continuous and
``dy/dtau = 0`` at reversals, so the derivative at fixed angles is the exact derivative.

A contact sticks from a reversal to where its force reaches the limit again, and remembers in
between where it reversed. Second derivatives grow without bound towards the onset of slip.

A contact whose motion reverses more than twice may stick from one turning point, where its force is
at a limit, to another, where it just reaches one: the limit on the other side, after a travel of
``2 mu F_n / k_d``, or the same again, as it is back where it was. Beyond it slips before it turns,
short of it it does not: there the force has a corner, as at the onset of slip.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429).
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.coulomb.march import (
    MARGIN,
    REVERSALS,
    SLIP,
    STICK_FRACTION,
    THETA_0,
    THETA_STAR,
)
from symhbm.model.contacts.motions import ByContact, Events, Located
from symhbm.numerics import FloatArray, FourierBasis, turning_points


def _figure(column: int) -> Any:
    """A column of the figures, (n_contacts,)."""
    return property(lambda state: state.figures[:, column])


@dataclass(frozen=True)
class ContactState(ByContact):
    """Events of a batch of friction contacts over one period.

    Attributes
    ----------
    events : (n_contacts, n_components^2 + n_components + 1)
        ``A`` column by column and ``b`` of the module's closed form, dimensionless, and the
        share of the period that a contact sticks which also slips.
    slip_margin_gradient : (n_contacts, n_components)
        Derivative of the slip margin with respect to the coefficients of ``y`` [1/m].
    figures : (n_contacts, 6)
        ``slip``: whether the contact slips at all during the period. ``slip_margin``,
        ``ln(k_d (y_max - y_min) / (2 g))``: positive when the motion asks for slip, infinite
        without limit or without motion. ``theta_0`` and ``theta_star``: angle of the maximum of
        ``y`` and the one where slip starts after it [rad]; NaN where the two-reversal motion of
        Eqs. (4)-(11) does not apply. ``stick_fraction``: share of the period spent sticking.
        ``reversals``: number of sign changes of the relative velocity per period.
    stick : (n_contacts, 2, n_stretches)
        Where a contact that slips begins to stick and where it slips again [rad], ascending; NaN
        elsewhere. Friction over samples has none.
    """

    events: FloatArray
    slip_margin_gradient: FloatArray
    figures: FloatArray
    stick: FloatArray

    slip_margin, theta_0 = _figure(MARGIN), _figure(THETA_0)
    theta_star, stick_fraction = _figure(THETA_STAR), _figure(STICK_FRACTION)
    reversals = _figure(REVERSALS)

    @property
    def matrix(self) -> FloatArray:
        """``A`` of the module's closed form, (n_contacts, n_components, n_components)."""
        n, size = self.slip_margin_gradient.shape
        # CasADi stores columns one after the other.
        return self.events[:, : size * size].reshape(n, size, size).transpose(0, 2, 1)

    @property
    def vector(self) -> FloatArray:
        """``b`` of the module's closed form, (n_contacts, n_components)."""
        size = self.slip_margin_gradient.shape[1]
        return self.events[:, size * size : -1]

    @property
    def slip(self) -> NDArray[np.bool_]:
        """Whether contacts slip at all during the period, (n_contacts,)."""
        return self.figures[:, SLIP] > 0

    @property
    def stick_intervals(self) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
        """The contact, the begin and the end of all stretches of stick, (n_intervals,) each."""
        contact, stretch = np.nonzero(~np.isnan(self.stick[:, 1]))
        return contact, *self.stick[contact, :, stretch].T

    @property
    def located(self) -> Located:
        """What the equations take of the contacts."""
        slips, margins = self.figures[:, SLIP, None] > 0, self.figures[:, MARGIN, None]
        return Located(self.events, slips, margins, self.slip_margin_gradient[:, None], self)


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


_NOTHING = 1e-12
"""Share of a motion that is nothing but round-off."""


@dataclass(frozen=True)
class Loop:
    """Stick of a ``contact`` between two turning points, at ``begin`` and ``end`` [rad].

    ``sides``: signs of the limit at which the force is at the begin, and which it just reaches.
    """

    contact: int
    begin: float
    end: float
    sides: tuple[int, int]

    @property
    def returns(self) -> bool:
        """Whether the force comes back to the same limit."""
        return self.sides[0] == self.sides[1]

    def on(self, basis: FourierBasis, motion: FloatArray) -> "Loop":
        """The same loop of a motion (n_components,) that is close to the one it was found on."""
        points = turning_points(basis, motion[None])
        angle = points.angle[0, : points.count[0]]
        begin, end = (float(angle[np.argmin(apart(angle, at))]) for at in (self.begin, self.end))
        return replace(self, begin=begin, end=end)


def images(basis: FourierBasis, motion: FloatArray) -> int:
    """How often a loop comes in a period: a motion (n_components,) may repeat, or mirror."""
    even = basis.order // basis.divisor % 2 == 0
    largest = np.abs(motion).max()
    mirrors = np.abs(motion[even]).max(initial=0.0) <= _NOTHING * largest
    return basis.divisor * (2 if mirrors else 1)


def apart(one: FloatArray, other: float) -> FloatArray:
    """Distance of angles on a circle [rad]."""
    return np.abs((one - other + np.pi) % (2 * np.pi) - np.pi)


def loops_near_limit(
    basis: FourierBasis, motion: FloatArray, contact: int, stiffness: float, limit: float
) -> list[tuple[float, Loop]]:
    """Loops of a contact that slips, each with the distance from its limit, relatively.

    ``motion`` (n_components,) [m]; each loop once, however often motions repeat or mirror.
    """
    points = turning_points(basis, motion[None])
    n = int(points.count[0])
    if n <= 2:
        return []
    angle, value = points.angle[0, :n], points.value[0, :n]
    force, start, side = limit, 0, 1
    result = []
    for k in range(n // images(basis, motion)):
        end = (k + 1) % n
        trial = force + stiffness * (value[end] - value[k])
        goal = 1 if trial > 0 else -1
        loop = Loop(contact, float(angle[start]), float(angle[end]), (side, goal))
        result.append((abs(abs(trial) / limit - 1), loop))
        force = float(np.clip(trial, -limit, limit))
        if abs(trial) > limit or end == points.lowest[0]:
            force, start, side = goal * limit, end, goal
    return result
