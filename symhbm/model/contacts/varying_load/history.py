"""What a contact does over a period, from its pieces."""

import numpy as np

from symhbm.model.contacts.motions import Behaviour, History, angles_from
from symhbm.model.contacts.varying_load.march import (
    ANCHOR,
    APART,
    BEGIN,
    END,
    KIND,
    LIFTED,
    PUSHED_DOWN,
    PUSHED_UP,
    STICK_CLOSED,
    STICK_HIGH,
    STICK_LOW,
    WEIGHT,
)
from symhbm.numerics import FloatArray, FourierBasis

_SIDES = {PUSHED_UP: -1, STICK_LOW: -1, PUSHED_DOWN: 1, STICK_HIGH: 1, STICK_CLOSED: 0}
"""The slider is at ``k_t u + side mu p``, or stays where that was at the anchor of its piece."""


def history_of(
    basis: FourierBasis, motion: FloatArray, values: FloatArray, pieces: FloatArray, n_angles: int
) -> History:
    """From a motion (2 K) [m], ``k_t``, ``k_n``, ``mu`` and ``N0``, and pieces (p, 6)."""
    stiffness, normal, friction, load = values.tolist()
    kind, begin = pieces[:, KIND].astype(int), pieces[:, BEGIN]
    parts = motion.reshape(2, -1)
    angle = angles_from(begin[0], pieces[:, (BEGIN, END)].ravel(), n_angles)
    u, v = displacement = parts @ basis.values(angle).T
    press = load + normal * v
    # A point belongs to the piece that goes on from it, whatever the last digits of both say.
    middle = (angle[1:] + angle[:-1]) / 2
    inside = (middle - begin[:, None]) % (2 * np.pi) < (pieces[:, END] - begin)[:, None]
    inside = np.concatenate([inside, inside[:, :1]], axis=1)
    pushed = np.isin(kind, (PUSHED_UP, PUSHED_DOWN))
    side = np.array([_SIDES.get(each, 0) for each in kind.tolist()])
    at_anchor = parts @ basis.values(pieces[:, ANCHOR]).T
    place = stiffness * at_anchor[0] + side * friction * (load + normal * at_anchor[1])
    sticking = stiffness * u - place[:, None]
    pull = np.where(pushed[:, None], -friction * side[:, None] * press, sticking)
    apart = (inside & np.isin(kind, (APART, LIFTED))[:, None]).any(axis=0)
    slips = (inside & pushed[:, None]).any(axis=0)
    tangential = np.where(apart, 0.0, (pieces[:, WEIGHT, None] * inside * pull).sum(axis=0))
    carried = np.where(apart, 0.0, np.maximum(press, 0.0))
    state = np.where(apart, Behaviour.OPENS, np.where(slips, Behaviour.SLIPS, Behaviour.STICKS))
    return History(angle, displacement, np.array([tangential, carried]), friction * carried, state)
