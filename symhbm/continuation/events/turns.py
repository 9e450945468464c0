"""Where a path turns or meets others: folds, corners that event location missed, branch points.

At a fold it turns back in its parameter, or in one of its unknowns. At a corner the slip of a minor
loop begins, with several harmonics.

Where responses are unique, Newton's method with a line search and free contacts solves at a fixed
value beyond a corner; as there is one solution at each value, it stays on the path. Elsewhere the
path may turn by more than a right angle. It keeps the sign of ``det [J; t^T]``: both Jacobians of a
corner differ by a matrix of rank 1 whose rows are along the gradient of what begins there.

At a branch point other solutions meet the path, which continues straight. There ``det [J; t^T]``
changes its sign although the tangent does not turn: motions that are less symmetric than the
structure branch off at such points. Halving finds them, and where second derivatives of the balance
are known a system of equations has them exactly.
"""

import math
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors import ON_LIMIT, Corrector, unit_parameter
from symhbm.continuation.events.crossing import Crossing, curvature_of, solve_crossing
from symhbm.continuation.newton import NewtonResult
from symhbm.continuation.point import PathPoint
from symhbm.continuation.problem import ContinuationProblem, Corrected
from symhbm.continuation.segment import PathState, Segment
from symhbm.numerics import FloatArray, bracketed_root, length_of, refined

SMALLEST_STEP = 1e-9
"""Arc length of a step below which a path cannot be continued."""
LARGEST_PREDICTION_ERROR = 0.3
"""Distance between predicted and corrected point above which a step is rejected."""

BEYOND_CORNER = 1e-8
"""Arc length ahead of a point that lies `SMALLEST_STEP` before a corner, beyond the corner."""

NO_TURN = 0.999
"""Cosine of the angle between tangents at both sides of a place where the path does not turn."""
_SHARES = np.arange(17) / 16
"""Shares of a segment at which the interpolated path tells whether it turns back."""
_NEARLY = 0.3
"""Slope of the parameter, over the larger one at the ends, below which two folds may hide."""
_STEEP = 0.01
"""Slope of the parameter at an end, over that at the other, of an end that is nearly a fold."""
_DIP = 0.999
"""Slope of the parameter, over the smaller one at the ends, below which it has a minimum."""
_CLOSEST = 1e-5
"""Accuracy of a branch point without second derivatives, relative to the response: closer to it,
round-off turns the tangent towards the other branch."""
_STRAIGHT = 0.5
"""Largest distance of two solutions of one path across their segment, over that along it."""
_MAX_HALVINGS = 40
_BESIDE = 0.1
"""Largest distance of a crossing from the interpolated segment, over the length of that."""
_ALONG = 0.9
"""Cosine of the angle between a segment and its branch at a crossing, at least."""


def turns_back(
    corrector: Corrector, base: PathPoint, step: float, orientation: int
) -> Corrected | None:
    """The tangent straight ahead of a point if it turned by more than a right angle, else None.

    ``orientation`` is the sign of ``det [J; t^T]`` along the path. At a branch point, the sign
    changes on a straight path.
    """
    row = base.after / base.scale
    row = row / length_of(row)
    ahead = corrector.tangent(base.state + step * base.after, base.scale, row, base.switches)
    if ahead is None:
        return None
    ahead = ahead.oriented(orientation)
    return ahead if -NO_TURN < np.dot(ahead.direction, row) < 0 else None


class CornerStep(NamedTuple):
    """A point at or beyond a corner, the contact states after it, length and error of the step."""

    solution: Corrected
    switches: NDArray[np.bool_]
    length: float
    error: float


def step_over_corner(
    corrector: Corrector, base: PathPoint, end: float, step: float
) -> CornerStep | None:
    """The farthest point ahead up to ``step``, if possible in the contact states of ``base``.

    Where states have to change, it is the point where the first contact is on its limit.
    """
    for may_change in (False, True):
        length = step
        while length >= SMALLEST_STEP:
            crossing = _at_distance(corrector, base, end, length, may_change)
            if crossing is not None:
                return crossing
            length /= 4
    return None


def _at_distance(
    corrector: Corrector, base: PathPoint, end: float, length: float, may_change: bool
) -> CornerStep | None:
    heading = np.sign(end - base.value)
    value = base.value + heading * min(length * abs(base.after[-1]), abs(end - base.value))
    result = corrector.free(base.unknowns, value)
    scale = corrector.curve.scale(base.state)
    error = corrector.curve.distance(np.append(result.unknowns, value), base.state, scale)
    if not result.converged or value == base.value or error > LARGEST_PREDICTION_ERROR:
        return None
    switches = result.evaluation.states.switches
    changed = switches != base.switches
    if changed.any():
        if not may_change:
            return None
        # A contact on its limit, or already beyond it, changes at once.
        immediate = changed & (np.where(base.switches, base.margins, -base.margins) <= ON_LIMIT)
        later = np.flatnonzero(changed & ~immediate)
        try:
            value, result = _first_change(corrector, base, value, later)
        except ArithmeticError:
            return None
        on_limit = np.abs(result.evaluation.states.margins) <= ON_LIMIT
        switches = np.where(immediate | (changed & on_limit), switches, base.switches)
    row = heading * unit_parameter(len(scale))
    tangent = corrector.tangent(np.append(result.unknowns, value), scale, row, switches)
    return None if tangent is None else CornerStep(tangent, switches, length, error)


def _first_change(
    corrector: Corrector, base: PathPoint, value: float, contacts: NDArray[np.intp]
) -> tuple[float, NewtonResult]:
    """Value at which the first of these contacts reaches its limit, and the solution there."""

    def margins(share: float, contact: int) -> float:
        if share == 0.0:
            return float(base.margins[contact])
        result = corrector.free(base.unknowns, base.value + share * (value - base.value))
        if not result.converged:
            raise ArithmeticError("no solution before a change of contact states")
        return float(result.evaluation.states.margins[contact])

    shares = [1.0]
    for contact in contacts:
        shares.append(bracketed_root(partial(margins, contact=contact)))
    at_change = base.value + min(shares) * (value - base.value)
    return at_change, corrector.free(base.unknowns, at_change)


def find_folds(
    corrector: Corrector, left: PathPoint, right: PathPoint, component: int = -1
) -> list[PathState] | None:
    """Folds between two neighbouring points of a path without an event in between, in their order.

    They are those of the parameter, the last component, or turns of another ``component``. Where
    the interpolated path turns back, the segment is halved until every fold lies between slopes of
    opposite sign. None if a solution in between cannot be found, as the points are then too far
    apart.
    """

    def between(first: PathState, last: PathState) -> Segment:
        return Segment(corrector, first, last, left.switches)

    def middle(first: PathState, last: PathState) -> PathState | None:
        segment = between(first, last)
        return segment.at(0.5) if _may_hide(segment, component) else None

    def advance(at: PathState) -> float:
        return float(at.direction[component])

    ends = PathState(left.state, left.after), PathState(right.state, right.before)
    try:
        pairs = pairwise(refined(ends, middle))
        return [between(*pair).zero(advance) for pair in pairs if math.prod(map(advance, pair)) < 0]
    except ArithmeticError:
        return None


def _may_hide(segment: Segment, component: int) -> bool:
    """Whether more folds may lie in a segment than the one that slopes at its ends tell."""
    advance = segment.interpolate(_SHARES)[1][:, component]
    turns = np.count_nonzero(advance[1:] * advance[:-1] < 0)
    turned = segment.left.direction[component] * segment.right.direction[component] < 0
    slowest = np.abs(advance[1:-1]).min()
    # Near two folds, or near a cusp, the interpolated path need not turn where the path does.
    ends = abs(advance[0]), abs(advance[-1])
    dips = slowest < _DIP * min(ends) or min(ends) < _STEEP * max(ends)
    nearly = not turned and dips and slowest < _NEARLY * max(ends)
    return bool(turns > turned or nearly)


def find_branch_point(corrector: Corrector, base: PathPoint, ahead: Corrected) -> Corrected | None:
    """The branch point between two points, with the tangent of their path, away from ``base``.

    The tangent of ``ahead`` points away from ``base`` too, with the other sign of the determinant.
    None where the two are on different paths, which may come arbitrarily close but do not meet.
    Without second derivatives it is the first solution beyond the branch point.
    """
    right = PathState(ahead.point, ahead.direction * base.scale)
    segment = Segment(corrector, PathState(base.state, base.after), right, base.switches)
    if not segment.length > 0:
        return None
    low, high, near_state, past_branch = 0.0, 1.0, base.state, ahead
    row = base.after / base.scale
    if segment.length <= _CLOSEST and np.dot(row, ahead.direction) < NO_TURN * length_of(row):
        return None  # an acute corner, at which the path turns back
    curvature = curvature_of(corrector.curve)
    for _ in range(_MAX_HALVINGS):
        distance = _across(segment, near_state, past_branch.point)
        if distance > _STRAIGHT * (high - low) * segment.length:
            return None
        if (high - low) * segment.length <= _CLOSEST:
            return past_branch
        share = (low + high) / 2
        solution = segment.solve(share)
        if solution is None:
            return None
        tangent = corrector.tangent(solution.state, segment.scale, segment.normal, base.switches)
        if tangent is None:
            return None
        if tangent.sign == ahead.sign:
            high, past_branch = share, tangent
        else:
            low, near_state = share, solution.state
        if curvature is None:
            continue
        given = corrector, curvature, solution.state, segment.scale, base.switches
        crossing = solve_crossing(*given)
        if crossing is None or not low <= segment.share_of(crossing.state) <= high:
            continue
        if not crossing.meets:
            return None
        direction = _direction(segment, crossing)
        if direction is not None:
            held = segment.scale, segment.switches
            return at_crossing(corrector.curve, crossing, direction, *held, past_branch)
    return None


def _direction(segment: Segment, crossing: Crossing) -> FloatArray | None:
    """The tangent along a segment at a crossing; None where that is on no branch of its."""
    if crossing.tangents is None:
        return None
    [state], [slope] = segment.interpolate(np.array([segment.share_of(crossing.state)]))
    beside = np.linalg.norm((crossing.state - state) / segment.scale)
    slope = slope / segment.scale
    cosines = crossing.tangents @ slope / np.linalg.norm(slope)
    best = int(np.argmax(np.abs(cosines)))
    if beside > _BESIDE * segment.length or abs(cosines[best]) < _ALONG:
        return None
    return np.copysign(1.0, cosines[best]) * crossing.tangents[best]


def at_crossing(
    curve: ContinuationProblem,
    crossing: Crossing,
    direction: FloatArray,
    scale: FloatArray,
    switches: NDArray[np.bool_],
    beyond: Corrected,
) -> Corrected:
    """The solution at a crossing with a unit tangent of scaled variables.

    What does not change within a short step is that of a solution ``beyond`` it.
    """
    state = crossing.state
    evaluation = curve.evaluate(state[:-1], state[-1], switches)
    return beyond._replace(
        point=state,
        direction=direction,
        residual_norm=evaluation.norm,
        amplification=curve.amplification(state[:-1], state[-1]),
        margins=evaluation.states.margins,
        rate=curve.margin_rate(evaluation, direction * scale),
        springs=None,
    )


def _across(segment: Segment, left: FloatArray, right: FloatArray) -> float:
    """Distance of two solutions across the straight line between the ends of a segment."""
    chord = (right - left) / segment.scale
    direction = (segment.right.state - segment.left.state) / segment.scale
    share = np.dot(chord, direction) / np.dot(direction, direction)
    return float(np.linalg.norm(chord - share * direction))
