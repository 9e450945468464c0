"""What friction elements do over a period: the force of a slider, without truncation.

The motion between two events of a contact is a truncated Fourier series; the force follows it
through the spring while the contact sticks, and is on its limit while it slips.
"""

import numpy as np

from symhbm.model.contacts.coulomb.located import stick_intervals
from symhbm.model.contacts.motions import Behaviour, History
from symhbm.numerics import FloatArray, FourierBasis


def histories_of(
    basis: FourierBasis,
    coefficients: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
    n_angles: int,
) -> list[History]:
    """Of motions (n_motions, n_components) [m], one for each.

    ``contact_stiffness`` (n_motions,) in N/m, ``slip_limit`` (n_motions,) in N; ``n_angles`` is the
    number of points over a period beside its events.
    """
    owner, begin, end = stick_intervals(basis, coefficients, contact_stiffness, slip_limit)
    parameters = zip(coefficients, contact_stiffness.tolist(), slip_limit.tolist(), strict=True)
    return [
        _history(basis, *values, begin[owner == i], end[owner == i], n_angles)
        for i, values in enumerate(parameters)
    ]


def _history(
    basis: FourierBasis,
    motion: FloatArray,
    stiffness: float,
    limit: float,
    begin: FloatArray,
    end: FloatArray,
    n_angles: int,
) -> History:
    """Of a motion (n_components,) that sticks from each ``begin`` to each ``end`` [rad]."""
    period = 2 * np.pi
    first = begin[0] if len(begin) else 0.0
    angle = first + period * np.arange(n_angles + 1) / n_angles
    angle = np.sort(np.concatenate([angle, begin, end]))
    y, limits = basis.values(angle) @ motion, np.full(len(angle), limit)
    if not len(begin):
        # A force that never reaches its limit is centred between its extremes.
        force = stiffness * (y - (y.max() + y.min()) / 2) if limit > 0 else np.zeros(len(y))
        state = np.full(len(angle), Behaviour.STICKS if limit > 0 else Behaviour.SLIPS)
        return History(angle, y[None], force[None], limits, state)
    start = basis.values(begin) @ motion
    side = -np.sign(basis.values(begin, 2) @ motion)
    interval = np.searchsorted(begin, angle, side="right") - 1
    # Slip goes on in the direction in which it ends.
    force = np.where(
        angle <= end[interval],
        side[interval] * limit + stiffness * (y - start[interval]),
        limit * np.roll(side, -1)[interval],
    )
    state = np.where(angle < end[interval], Behaviour.STICKS, Behaviour.SLIPS)
    # The last angle is the first of the next period.
    force[-1], state[-1] = force[0], state[0]
    return History(angle, y[None], force[None], limits, state)
