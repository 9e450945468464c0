"""Hysteresis loops of friction elements: the force of a slider over its motion, without truncation.

The motion between two events of a contact is a truncated Fourier series; the force follows it
through the spring while the contact sticks, and is on its limit while it slips.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.coulomb.located import stick_intervals
from symhbm.numerics import FloatArray, FourierBasis


class HysteresisLoop(NamedTuple):
    """Hysteresis loop of one contact over a period, closed.

    ``angle`` (n,) [rad], ``displacement`` (n,) [m], ``force`` (n,) [N]; ``onset`` and ``end``
    number the points where slip begins and ends. ``limit`` is ``mu F_n`` [N].
    """

    angle: FloatArray
    displacement: FloatArray
    force: FloatArray
    onset: NDArray[np.intp]
    end: NDArray[np.intp]
    limit: float

    @property
    def area(self) -> float:
        """Enclosed area [J]: exact, as the force is linear in the displacement between events."""
        middle = (self.force[1:] + self.force[:-1]) / 2
        return float((middle * np.diff(self.displacement)).sum())


def hysteresis_loops(
    basis: FourierBasis,
    coefficients: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
    n_angles: int,
) -> list[HysteresisLoop]:
    """Loops of motions (n_motions, n_components) [m], one for each.

    ``contact_stiffness`` (n_motions,) in N/m, ``slip_limit`` (n_motions,) in N; ``n_angles`` is the
    number of points over a period beside its events.
    """
    owner, begin, end = stick_intervals(basis, coefficients, contact_stiffness, slip_limit)
    parameters = zip(coefficients, contact_stiffness.tolist(), slip_limit.tolist(), strict=True)
    return [
        _loop(basis, *values, begin[owner == i], end[owner == i], n_angles)
        for i, values in enumerate(parameters)
    ]


def _loop(
    basis: FourierBasis,
    motion: FloatArray,
    stiffness: float,
    limit: float,
    begin: FloatArray,
    end: FloatArray,
    n_angles: int,
) -> HysteresisLoop:
    """Loop of a motion (n_components,) that sticks from each ``begin`` to each ``end`` [rad]."""
    period = 2 * np.pi
    first = begin[0] if len(begin) else 0.0
    angle = first + period * np.arange(n_angles + 1) / n_angles
    angle = np.sort(np.concatenate([angle, begin, end]))
    y = basis.values(angle) @ motion
    if not len(begin):
        # A force that never reaches its limit is centred between its extremes.
        force = stiffness * (y - (y.max() + y.min()) / 2) if limit > 0 else np.zeros(len(y))
        no_event = np.empty(0, dtype=int)
        return HysteresisLoop(angle, y, force, no_event, no_event, limit)
    start = basis.values(begin) @ motion
    side = -np.sign(basis.values(begin, 2) @ motion)
    interval = np.searchsorted(begin, angle, side="right") - 1
    sticks = angle <= end[interval]
    # Slip goes on in the direction in which it ends.
    force = np.where(
        sticks,
        side[interval] * limit + stiffness * (y - start[interval]),
        limit * np.roll(side, -1)[interval],
    )
    # The last angle is the first of the next period.
    force[-1] = force[0]
    onset, stop = np.searchsorted(angle, end), np.searchsorted(angle, begin)
    return HysteresisLoop(angle, y, force, onset, stop, limit)
