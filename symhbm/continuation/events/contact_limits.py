"""Contact limits on a path: the points at which contacts begin or end to slip.

Where a motion has a mean, that of the force of planar friction grows like the square root of the
margin of slip: its derivatives have no bound at the limit, which the path follows before it turns
away, sharply. At the limit itself the equations of stick are regular, at a small margin those of
slip.
"""

import math
from bisect import bisect
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors import BEYOND, ON_LIMIT, AtLimit, Corrector, Hyperplane, crossed
from symhbm.continuation.point import PathPoint
from symhbm.continuation.problem import Corrected
from symhbm.numerics import FloatArray, length_of
from symhbm.numerics.loops import Loop, interpolation

_MAX_REFINEMENTS = 8
_PRECISION = 1e-8
"""Last step to a limit, relative to the response: the error of the limit is its square."""
_SHARP = 0.1
"""Cosine of the angle between both tangents below which the parameter measures the step."""
_FLAT = 1e-3
"""Component of a tangent along a step below which a cubic does not follow the path."""
_LEVEL = 1e-9
"""Rate of a margin along the path up to which it is zero but for round-off."""
_LARGEST_SHARE = 1.0001
"""Largest share of a step at which a limit lies on the step, above 1 by round-off."""


def first_limit(
    corrector: Corrector, base: PathPoint, past_limit: Corrected, orientation: int
) -> tuple[Corrected, NDArray[np.bool_]] | None:
    """Solve for the first limit crossed between ``base`` and ``past_limit``.

    ``orientation`` is the sign of tangents along the path. Returns the solution and which switches
    are at their limits there (n_switches,), None if limits can be separated only over a shorter
    step, as where a contact comes back to its limit from beyond.
    """
    single_valued, scale = corrector.curve.single_valued, base.scale
    of_base = base.state, base.after, base.switches, base.margins, base.rate
    for _ in range(1 + len(base.margins)):
        ahead = past_limit.oriented(orientation)
        of_ahead = ahead.point, ahead.direction, ahead.margins, ahead.rate
        normal, guess = np.empty((2, len(scale)))
        contact, length = _first_limit(of_base, of_ahead, scale, single_valued, normal, guess)
        if contact < 0:
            return None
        limit = AtLimit(corrector.curve, contact, scale)
        solution = corrector.correct(guess, limit, base.switches, _PRECISION)
        if solution is None:
            return None
        share = normal.dot((solution.point - base.state) / scale) / length
        forward = (solution.point[-1] - base.value) * base.after[-1] > 0
        if not 0 < share < _LARGEST_SHARE or not (forward or not single_valued):
            return None
        # What was solved for is on its limit, though round-off may move its margin.
        solution.margins[contact] = 0.0
        solution = solution._replace(crosses=bool(crossed(solution.margins, base.switches).any()))
        if not solution.crosses:
            # Those that were at their limits at the start of the step come from it.
            limits = (np.abs(solution.margins) <= ON_LIMIT) & (np.abs(base.margins) > ON_LIMIT)
            near_side = solution.oriented(orientation)
            outward = np.where(base.switches, -near_side.rate, near_side.rate)
            return None if (limits & (outward < -_LEVEL)).any() else (solution, limits)
        past_limit = solution
    return None


def beyond_limits(
    corrector: Corrector,
    base: PathPoint,
    solution: Corrected,
    limits: NDArray[np.bool_],
    orientation: int,
) -> tuple[Corrected, NDArray[np.bool_]] | None:
    """The tangent beyond a point with switches at their ``limits``, and the states there.

    Where one contact that slips relieves another, that one goes back from its limit and does not
    change. States are consistent where each margin goes to the side of its state; those that are
    not are turned one by one (the least-index method of linear complementarity). Those of ``base``
    are the states on this side. None where there is no tangent.
    """
    switches, tried = base.switches ^ limits, set()
    row, places = solution.direction, np.flatnonzero(limits)
    first = None
    while switches.tobytes() not in tried:
        tried.add(switches.tobytes())
        tangent = corrector.tangent(solution.point, base.scale, row, switches)
        if tangent is None:
            break
        tangent = tangent.oriented(orientation)
        first = first or (tangent, switches)
        inward = np.where(switches, -tangent.rate, tangent.rate)[places]
        wrong = places[inward > _LEVEL]
        if len(places) == 1 or not len(wrong):
            return tangent, switches
        switches = switches.copy()
        switches[wrong[0]] = ~switches[wrong[0]]
    return first


@Loop
def _first_limit(base, ahead, scale, single_valued: bool, normal, guess) -> tuple[int, float]:
    """Number of the switch that reaches its limit first, -1 if limits cannot be separated.

    State and margins are cubics over the step from ``base`` (state, derivative, states and margins
    of switches and their rates) to ``ahead`` (state, scaled direction, margins, rates). Writes the
    ``normal`` that measures the step and the ``guess`` of the state at the limit; returns the
    length of the step along that normal, too.
    """
    state, after, switches, margins, rate = base
    point, direction, margins_ahead, rate_ahead = ahead
    last = len(scale) - 1
    advance = 0.0
    for i in range(last + 1):
        normal[i] = after[i] / scale[i]
        advance += normal[i] * direction[i]
    if single_valued and advance < _SHARP:
        # Along a path that turns back on itself, only the parameter increases throughout.
        normal[:last] = 0.0
        normal[last] = math.copysign(1.0, after[last])
    length = along = along_ahead = 0.0
    for i in range(last + 1):
        length += normal[i] * (point[i] - state[i]) / scale[i]
        along += normal[i] * after[i] / scale[i]
        along_ahead += normal[i] * direction[i]
    bends = min(along, along_ahead) >= _FLAT
    from_base, to_ahead = (length / along, length / along_ahead) if bends else (1.0, 1.0)
    beyond = crossed(margins_ahead, switches)
    first, share = -1, math.inf
    for contact in range(len(margins)):
        if not beyond[contact]:
            continue
        start, end = margins[contact], margins_ahead[contact]
        # A contact that starts on its limit and is beyond it again slipped, or stuck, for a
        # part of the step only: the limit at the start is not the one to solve for.
        if not BEYOND < abs(start) < math.inf or start * end > 0:
            return -1, length
        slopes = end - start, end - start
        if bends:
            slopes = from_base * rate[contact], to_ahead * rate_ahead[contact]
        reached = interpolation.first_zero(start, end, slopes)
        if reached < share:
            first, share = contact, reached
    for i in range(last + 1):
        slopes = point[i] - state[i], point[i] - state[i]
        if bends:
            slopes = from_base * after[i], to_ahead * direction[i] * scale[i]
        guess[i] = interpolation.cubic_at(state[i], point[i], slopes, share)
    return first, length


def brief_crossing(corrector: Corrector, base: PathPoint, ahead: Corrected) -> Corrected | None:
    """A point within a step at which a contact is beyond its limit, None if there is none.

    The slip margin of each contact is a cubic from its values and rates at both ends. Where its
    maximum comes close to the limit, points are added there until the crossing is decided. What is
    solved for because of one contact tells of the others.
    """
    turning, scale = np.empty(len(base.switches), dtype=np.int64), base.scale
    of_base = base.state, base.after, base.switches, base.margins, base.rate
    of_ahead = ahead.point, ahead.direction, ahead.margins, ahead.rate
    count, length, advance = _turning(of_base, of_ahead, scale, turning)
    if not count:
        return None
    normal, start, chosen = base.after / scale, base.state, turning[:count]
    outward = np.where(base.switches, -1.0, 1.0)[chosen]
    shares, values = [0.0, 1.0], [base.margins[chosen], ahead.margins[chosen]]
    rates = [base.rate[chosen], ahead.rate[chosen] / advance]
    for k in range(count):
        for _ in range(_MAX_REFINEMENTS):
            share = _doubtful(shares, outward[k] * np.array([values, rates])[:, :, k], length)
            if share is None:
                break
            guess = start + share * (ahead.point - start)
            plane = Hyperplane(start + share * length * base.after, scale, normal)
            solution = corrector.correct(guess, plane, base.switches)
            if solution is None:
                break
            if crossed(solution.margins, base.switches)[chosen].any():
                return solution
            place = bisect(shares, share)
            slope = solution.rate / max(float(np.dot(normal, solution.direction)), 1e-3)
            shares.insert(place, share)
            values.insert(place, solution.margins[chosen])
            rates.insert(place, slope[chosen])
    return None


def _doubtful(shares: list[float], margins: FloatArray, length: float) -> float | None:
    """Share of a step at which a margin may pass its limit, None where it stays within.

    ``margins`` (2, n_shares) are its values and rates at some ``shares``.
    """
    highest, result = -math.inf, None
    for (begin, value, rate), (end, value_ahead, rate_ahead) in pairwise(
        zip(shares, *margins.tolist(), strict=True)
    ):
        width = end - begin
        if not (rate > 0 >= rate_ahead and math.isfinite(value) and math.isfinite(value_ahead)):
            continue
        slopes = width * length * rate, width * length * rate_ahead
        share, maximum = interpolation.cubic_top(value, value_ahead, slopes)
        rise = maximum - max(value, value_ahead)
        if maximum >= -0.5 * rise - BEYOND and rise > 0 and maximum > highest:
            highest, result = maximum, begin + width * share
    return result


@Loop
def _turning(base, ahead, scale, turning) -> Any:
    """Contacts whose margins may pass their limits within a step between ends as of `_first_limit`.

    Their numbers are written into ``turning``. Returns how many they are, the length of the step
    and how far the path at its end goes along it.
    """
    start, after, switches, margins, rate = base
    end, direction, margins_ahead, rate_ahead = ahead
    length = advance = 0.0
    for i in range(len(start)):
        length += after[i] / scale[i] * ((end[i] - start[i]) / scale[i])
        advance += after[i] / scale[i] * direction[i]
    advance = max(advance, 1e-3)
    count = 0
    for contact in range(len(switches)):
        outward = -1.0 if switches[contact] else 1.0
        rises, falls = outward * rate[contact], outward * rate_ahead[contact]
        highest = max(outward * margins[contact], outward * margins_ahead[contact])
        known = math.isfinite(margins[contact]) and math.isfinite(margins_ahead[contact])
        # No cubic rises more than this above its ends.
        rise = 4 / 27 * length * (rises - falls / advance)
        if rises > 0 and falls < 0 and known and highest + 1.5 * rise >= -BEYOND:
            turning[count] = contact
            count += 1
    return count, length, advance


_MARGIN = 1e-6
"""Margin of slip at which the tangent next to a limit is computed."""
_FARTHEST = 3.0
"""Distance of a limit over that at which the margin would vanish along the tangent, at most: twice
that, where the margin falls like a square."""
_AHEAD = 0.5
"""Cosine of the angle between the tangent and the way to a limit, at least."""


def beside_limit(
    corrector: Corrector,
    base: PathPoint,
    limit: Corrected,
    far_side: Corrected,
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
    return _beside(corrector, limit.point, base.scale, switches, int(places[0])) or far_side


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
