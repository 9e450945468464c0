"""Second derivatives of weighted forces, contact by contact: what events and sliders add."""

from typing import Any

import numpy as np

from symhbm.model.contacts.planar.batch import limit_of, series_of
from symhbm.model.contacts.planar.collocation import STAGES
from symhbm.model.contacts.planar.moving_events import moving_events, opening
from symhbm.model.contacts.planar.period import MOVES, period
from symhbm.model.contacts.planar.rest import resting_place
from symhbm.model.contacts.planar.series import bounds_of, closed_intervals
from symhbm.model.contacts.planar.slopes import moving
from symhbm.numerics.loops import Loop, arrays


@Loop
def bends_of(
    order: Any,
    is_sine: Any,
    norm: Any,
    motions: Any,
    values: Any,
    held: Any,
    most: int,
    weights: Any,
    bends: Any,
) -> int:
    """Write the second derivatives of weighted forces: 0, or what has failed.

    Arguments and result as of `symhbm.model.contacts.planar.batch.locate`. ``weights`` (n, m K);
    ``bends`` (n, P + 1 + K, P + 1 + K) takes what events and sliders add as they move, without
    resting places.
    """
    size, highest = len(order), int(order[len(order) - 1])
    variable = motions.shape[1] == 3 * size
    n = 3 * size + 1 if variable else 2 * size + 1
    waves, press = np.empty((3, 2, highest + 1)), np.empty((2, highest + 1))
    bounds, closed = np.empty((2, 4)), np.empty((2, 2 * highest + 4))
    angles, place = np.empty(3), np.empty(3)
    jacobian, coefficients = np.empty((2 * size, n)), np.empty(2 * size)
    pieces, nodes = np.empty((most, 7)), np.empty((most * STAGES, 8))
    turns, edges = np.empty((most * STAGES, 2, n + 2)), np.empty((most, 2, n + 2))
    starts = np.empty((2, n + 2))
    bends[:] = 0.0
    for j in range(len(motions)):
        series_of(order, is_sine, motions[j], values[j], waves)
        bounds_of(waves, bounds)
        n_closed = closed_intervals(waves, bounds, closed[0], closed[1])
        limit_of(values[j, 2], waves, press)
        resting_place(waves, angles, place)
        kind, count = period(waves, held[j], n_closed, closed, place, pieces, nodes)
        if count < 0:
            return count
        if kind == MOVES:
            opens = n_closed >= 0
            moving(
                waves, order, is_sine, norm, variable, opens, pieces, count, nodes, coefficients,
                jacobian, turns, edges, starts,
            )  # fmt: skip
            moving_events(
                waves, order, is_sine, norm, variable, opens, pieces, count, nodes, turns, edges,
                starts, weights[j], bends[j, :n, :n],
            )  # fmt: skip
        if variable:
            for k in range(2):
                arrays.copy(press[k], waves[2, k])
            own = bends[j, n:, n:]
            opening(closed, n_closed, waves, order, is_sine, norm, weights[j], own)
    return 0
