"""Slopes of a peak at the onset of slip, where its amplitude has a kink over the parameters.

Beside the onset a contact sticks or slips, and peaks smoothly either way. Slip dissipates in
proportion to how far the motion is beyond the limit, so that the slopes of the two peaks differ.
"""

from dataclasses import replace

import numpy as np

from symhbm.continuation.correctors import ON_LIMIT
from symhbm.numerics import RADIANS, FloatArray
from symhbm.peaks.conditions import Conditions
from symhbm.peaks.maximum import Maximum, MaximumKind

_STATIONARY = 1e-6
"""Slope of the response beside a peak, over the frequency and scaled, that counts as zero."""


def slopes_of(solved: Conditions) -> FloatArray:
    """Derivatives of amplitude and frequency [Hz] by all parameters, (2, n_parameters)."""
    return np.array([solved.gradient, solved.frequency_gradient / RADIANS])


def switches_on_limit(maximum: Maximum) -> list[int]:
    """Switches of slip that are on their limits at a smooth maximum."""
    if maximum.kind != MaximumKind.SMOOTH:
        return []
    problem = maximum.problem
    margins = problem.locate(maximum.unknowns, maximum.frequency).margins
    near = np.flatnonzero(np.abs(margins) <= 10 * ON_LIMIT).tolist()
    places = [(switch, *problem.contacts.switch(switch)) for switch in near]
    return [j for j, group, _, place in places if group.law.switches[place].name == "slip"]


def both_sides(solved: Conditions, switch: int) -> tuple[FloatArray, FloatArray] | None:
    """`slopes_of` a maximum with a switch on its limit, towards larger and smaller parameters.

    None where the response peaks smoothly with the contact in one state alone: its peak is then at
    the limit on the other side, and begins with the same slope of the amplitude. The frequency of
    the slipping peak is NaN: its slope is no derivative of the equations at the limit, where their
    second derivatives have no bound.
    """
    maximum, second_order = solved.maximum, solved.second_order
    states = {slips: maximum.switches.copy() for slips in (False, True)}
    for slips, switches in states.items():
        switches[switch] = slips
    sticking, slipping = (
        Conditions.of(second_order, replace(maximum, switches=switches))
        for switches in states.values()
    )
    if max(sticking.stationarity, slipping.stationarity) > _STATIONARY:
        return None
    corner = replace(sticking.maximum, kind=MaximumKind.CORNER, contact=switch)
    row, n = corner.limit(second_order), maximum.problem.n_unknowns + 1
    # Where the margin grows with a parameter, larger values make the contact slip.
    grows = row[n:] + row[:n] @ sticking.by_parameters[:n]
    stuck = slopes_of(sticking)
    slid = np.array([slipping.gradient, np.full(grows.shape, np.nan)])
    return np.where(grows > 0, slid, stuck), np.where(grows < 0, slid, stuck)
