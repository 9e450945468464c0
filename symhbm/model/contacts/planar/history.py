"""What a contact with planar friction does over a period, from its pieces."""

import numpy as np
from numpy.polynomial import legendre

from symhbm.model.contacts.motions import Behaviour, History, angles_from
from symhbm.model.contacts.planar.collocation import STAGES, TO_SERIES, TURN
from symhbm.model.contacts.planar.march import (
    APART,
    BEGIN,
    END,
    FIRST,
    KIND,
    LAST,
    NODE,
    SLIP,
    STICK,
)
from symhbm.model.contacts.planar.period import (
    FEW,
    MOST,
    NEVER,
    PER_HARMONIC,
    RESTS,
    TOO_MANY,
    period,
    prepare,
)
from symhbm.model.contacts.planar.rest import resting_place
from symhbm.numerics import FloatArray, FourierBasis

_BEHAVIOURS = np.array([Behaviour.OPENS, Behaviour.STICKS, Behaviour.SLIPS])
"""Of pieces by their kind."""


def history_of(
    basis: FourierBasis, motion: FloatArray, values: FloatArray, n_angles: int
) -> History:
    """From a motion (m K) [m] and ``k_t``, ``k_n``, ``mu`` and ``N0``."""
    stiffness, normal, friction, load = values.tolist()
    kind, place, pieces, nodes = _pieces(basis, motion, values)
    angle = angles_from(pieces[0, BEGIN], pieces[:, (BEGIN, END)].ravel(), n_angles)
    parts = motion.reshape(-1, basis.n_components)
    displacement = parts @ basis.values(angle).T
    press = load + (normal * displacement[2] if len(parts) > 2 else np.zeros(len(angle)))
    carried = np.maximum(press, 0.0)
    middle = np.append((angle[1:] + angle[:-1]) / 2, (angle[0] + angle[1]) / 2)
    since = (middle[:, None] - pieces[:, BEGIN]) % (2 * np.pi)
    which = np.argmax(since < pieces[:, END] - pieces[:, BEGIN], axis=1)
    of_points = pieces[which]
    state = _BEHAVIOURS[of_points[:, KIND].astype(int)]
    width = of_points[:, END] - of_points[:, BEGIN]
    share = ((angle - of_points[:, BEGIN] + 1e-12) % (2 * np.pi) - 1e-12) / width
    direction = np.zeros(len(angle))
    for i in np.flatnonzero(state == Behaviour.SLIPS).tolist():
        node = int(of_points[i, NODE])
        series = legendre.legint(TO_SERIES @ nodes[node : node + STAGES, TURN], lbnd=-1)
        turned = legendre.legval(2 * share[i] - 1, series) * width[i] / 2
        direction[i] = of_points[i, FIRST] + turned
    wall = friction * carried * np.array([np.cos(direction), np.sin(direction)])
    rest = place[:2, None] if kind == RESTS else of_points[:, (FIRST, LAST)].T
    moved = np.where(basis.order > 0, parts[:2], 0.0) @ basis.values(angle).T
    force = np.where(state == Behaviour.SLIPS, wall, stiffness * moved - rest)
    force = np.where(state == Behaviour.OPENS, 0.0, force)
    if len(parts) > 2:
        force = np.vstack([force, np.where(state == Behaviour.OPENS, 0.0, carried)])
    return History(angle, displacement, force, friction * carried, state)


def _pieces(
    basis: FourierBasis, motion: FloatArray, values: FloatArray
) -> tuple[int, FloatArray, FloatArray, FloatArray]:
    """The kind of `period`, the resting place, pieces (n, 7) and nodes; one piece without events.

    Raises ArithmeticError where no periodic slip is found.
    """
    highest = basis.highest
    waves, press = np.empty((3, 2, highest + 1)), np.empty((2, highest + 1))
    turning, closed, place = np.empty((2, 2)), np.empty((2, highest + 1)), np.empty(3)
    n_closed = prepare(basis.arrays, motion, values, waves, press, turning, closed)
    resting_place(waves, np.empty(3), place)
    most, count = FEW + PER_HARMONIC * basis.highest, TOO_MANY
    kind, pieces, nodes = NEVER, np.zeros((1, 7)), np.zeros((1, 8))
    while count == TOO_MANY and most < MOST:
        pieces, nodes = np.zeros((most, 7)), np.zeros((most * STAGES, 8))
        kind, count = period(waves, -1, n_closed, closed, place, pieces, nodes)
        most *= 4
    if count < 0:
        raise ArithmeticError("no periodic slip was found of a motion")
    if count == 0:
        # Without friction it slides where it is closed: its wall is none, however it is pressed.
        slides = kind == NEVER and n_closed != 0
        begin, end = closed[:, :n_closed] if slides and n_closed > 0 else ([0.0], [2 * np.pi])
        of_closed = SLIP if slides else STICK if kind == RESTS else APART
        pieces, count = np.zeros((2 * len(begin), 7)), 2 * len(begin)
        pieces[::2, BEGIN], pieces[::2, END], pieces[::2, KIND] = begin, end, of_closed
        pieces[1::2, BEGIN], pieces[1::2, END] = end, np.append(begin[1:], begin[0] + 2 * np.pi)
        pieces[1::2, KIND] = APART
    return kind, place, pieces[:count], nodes
