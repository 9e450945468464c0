"""Limits of slip beside which a path turns sharply.

Where a motion has a mean, that of the force of planar friction grows like the square root of the
margin of slip: its derivatives have no bound at the limit, which the path follows before it turns
away. At the limit itself the equations of stick are regular, at a small margin those of slip.
"""

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors import ON_LIMIT, AtLimit, Corrector, Hyperplane
from symhbm.continuation.point import PathPoint
from symhbm.continuation.problem import Corrected
from symhbm.numerics import FloatArray, length_of

_MARGIN = 1e-6
"""Margin of slip at which the tangent next to a limit is computed."""
_PRECISION = 1e-8
"""Last step to a limit, relative to the response."""
_FARTHEST = 3.0
"""Distance of a limit over that at which the margin would vanish along the tangent, at most: twice
that, where the margin falls like a square."""
_AHEAD = 0.5
"""Cosine of the angle between the tangent and the way to a limit, at least."""


def beside_limit(
    corrector: Corrector,
    limit: Corrected,
    far_side: Corrected,
    scale: FloatArray,
    switches: NDArray[np.bool_],
    limits: NDArray[np.bool_],
) -> Corrected:
    """The ``far_side`` of a limit, of a small slip where the path turns back as one begins to slip.

    ``switches`` are the states on the far side, ``limits`` the switches that changed.
    """
    places = np.flatnonzero(limits)
    turns_back = float(np.dot(limit.direction, far_side.direction)) < 0
    if not turns_back or len(places) > 1 or not switches[places].all():
        return far_side
    if corrector.curve.single_valued or not _may_be_sharp(corrector, int(places[0])):
        return far_side
    return _beside(corrector, limit.point, scale, switches, int(places[0])) or far_side


def after_onset(corrector: Corrector, point: PathPoint, orientation: int) -> PathPoint | None:
    """A point on the limit at which a contact begins to slip, with the tangent of a small slip.

    None of any other point, and where that tangent goes another way than ``orientation`` tells.
    """
    begins = np.flatnonzero(point.switches & (np.abs(point.margins) < ON_LIMIT))
    if not point.events or len(begins) != 1 or not _may_be_sharp(corrector, int(begins[0])):
        return None
    found = _beside(corrector, point.state, point.scale, point.switches, int(begins[0]))
    if found is None or found.sign != orientation:
        return None
    return point._replace(after=found.direction * point.scale, rate=found.rate)


def _may_be_sharp(corrector: Corrector, switch: int) -> bool:
    """Whether a switch is the slip of a contact in two directions, whose motion has a mean."""
    problem = corrector.curve.problem
    group = problem.contacts.switch(switch)[0]
    planar = {"tangential", "across"} <= {*group.law.directions}
    return planar and 0 in problem.harmonics


def _beside(
    corrector: Corrector,
    point: FloatArray,
    scale: FloatArray,
    slips: NDArray[np.bool_],
    contact: int,
) -> Corrected | None:
    """The solution at a small margin beside a point on a limit, its tangent away from that."""
    curve = corrector.curve
    evaluation = curve.evaluate(point[:-1], point[-1], slips)
    row = curve.margin_gradient(evaluation, contact) * scale
    size = length_of(row)
    anchor = point + scale * row * (_MARGIN / size**2)
    found = corrector.correct(anchor, Hyperplane(anchor, scale, row / size), slips)
    if found is None or found.crosses or not found.margins[contact] > 0.1 * _MARGIN:
        return None
    return found


def end_of_slip(
    corrector: Corrector, base: PathPoint, step: float, orientation: int
) -> tuple[Corrected, Corrected, NDArray[np.bool_]] | None:
    """The limit within a step from a point at which a contact sticks again, solved for in stick.

    Both sides of it, with tangents along the path, and the states of switches beyond it. None where
    the path does not go to one; ``orientation`` is the sign of its tangents.
    """
    falls = base.switches & (base.margins > 0) & (base.rate < 0)
    if not falls.any() or corrector.curve.single_valued:
        return None
    distances = np.full(len(falls), np.inf)
    distances[falls] = base.margins[falls] / -base.rate[falls]
    contact = int(np.argmin(distances))
    if distances[contact] > step or not _may_be_sharp(corrector, contact):
        return None
    switches = base.switches.copy()
    switches[contact] = False
    guess = base.state + distances[contact] * base.after
    at_limit = AtLimit(corrector.curve, contact, base.scale)
    limit = corrector.correct(guess, at_limit, switches, _PRECISION)
    if limit is None or limit.crosses:
        return None
    limit.margins[contact] = 0.0
    way, tangent = (limit.point - base.state) / base.scale, base.after / base.scale
    length = length_of(way)
    if length > _FARTHEST * distances[contact] or np.dot(way, tangent) < _AHEAD * length:
        return None
    far_side = limit.oriented(orientation)
    if far_side.rate[contact] > 0:
        return None
    near_side = limit._replace(direction=tangent, rate=base.rate)
    if base.margins[contact] > 2 * _MARGIN:
        beside = _beside(corrector, limit.point, base.scale, base.switches, contact)
        if beside is None:
            return None
        near_side = limit._replace(direction=-beside.direction, rate=-beside.rate)
    return near_side, far_side, switches
