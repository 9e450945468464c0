"""Dry friction with located switching angles, for any motion.

Along one period the slider is marched over the reversals of the relative displacement ``y``, and
each change from stick to slip is located.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.coulomb import march
from symhbm.model.contacts.coulomb.loops import Loop, apart, images
from symhbm.model.contacts.coulomb.one_harmonic import locate_one_harmonic
from symhbm.model.contacts.coulomb.state import ContactState
from symhbm.numerics import FloatArray, FourierBasis, check_turning, turning_points
from symhbm.numerics.loops import fourier


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
    sliders = np.empty((n, 3))
    sliders[:, 0], sliders[:, 1] = contact_stiffness, slip_limit
    sliders[:, 2] = march.FREE if slip is None else slip
    motions = np.array(coefficients, dtype=float, order="C")
    force, figures = np.empty((n, size + 2, size)), np.empty((n, 6))
    stick = np.empty((n, 2, 2 * basis.highest))
    status, longest = march.locate(
        *basis.arrays, basis.mirrors, motions, sliders, force, figures, stick
    )
    check_turning(status)
    return ContactState(
        matrix=force[:, :size],
        vector=force[:, size],
        slip=figures[:, march.SLIP] > 0,
        slip_margin=figures[:, march.MARGIN],
        slip_margin_gradient=force[:, size + 1],
        theta_0=figures[:, march.THETA_0],
        theta_star=figures[:, march.THETA_STAR],
        stick_fraction=figures[:, march.STICK_FRACTION],
        reversals=figures[:, march.REVERSALS].astype(int),
        stick_begin=stick[:, 0, :longest],
        stick_end=stick[:, 1, :longest],
    )


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
    force = np.zeros((len(motion) + 1, len(motion)))
    march.add_force(order, is_sine, norm, runs, 1.0, force)
    if basis.order[0] == 0:
        force[-1, 0] += loop.sides[0] - 1
    size = max(used - friction.stick_end.shape[1], 0)
    changes = {}
    for name, column in (("stick_begin", march.BEGIN), ("stick_end", march.END)):
        changes[name] = np.pad(getattr(friction, name), ((0, 0), (0, size)), constant_values=np.nan)
        changes[name][loop.contact] = np.nan
        changes[name][loop.contact, :used] = runs[:, column]
    for name, row in (("matrix", force[:-1]), ("vector", force[-1])):
        changes[name] = getattr(friction, name).copy()
        changes[name][loop.contact] = row
    return replace(friction, **changes)


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
    begin, end = (
        (at[:, None] / times + shift).reshape(len(at), -1)
        for at in (friction.stick_begin, friction.stick_end)
    )
    unknown = np.full(len(begin), np.nan)
    return replace(
        friction,
        theta_0=unknown,
        theta_star=unknown,
        reversals=friction.reversals * times,
        stick_begin=begin,
        stick_end=end,
    )
