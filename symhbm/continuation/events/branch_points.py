"""Branch points of a path, where other solutions meet it and the path continues straight.

There ``det [J; t^T]`` changes its sign although the tangent does not turn: motions that are less
symmetric than the structure branch off at such points. Halving finds them, and where second
derivatives of the balance are known a system of equations has them exactly.
"""

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors import Corrector
from symhbm.continuation.events.crossing import Crossing, curvature_of, solve_crossing
from symhbm.continuation.events.turns import NO_TURN
from symhbm.continuation.point import PathPoint
from symhbm.continuation.problem import ContinuationProblem, Corrected
from symhbm.continuation.segment import PathState, Segment
from symhbm.numerics import FloatArray, length_of

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


def find_branch_point(
    corrector: Corrector, base: PathPoint, ahead: Corrected, scale: FloatArray
) -> Corrected | None:
    """The branch point between two points, with the tangent of their path, away from ``base``.

    The tangent of ``ahead`` points away from ``base`` too, with the other sign of the determinant.
    None where the two are on different paths, which may come arbitrarily close but do not meet.
    Without second derivatives it is the first solution beyond the branch point.
    """
    right = PathState(ahead.point, ahead.direction * scale)
    segment = Segment(corrector, PathState(base.state, base.after), right, base.switches)
    if not segment.length > 0:
        return None
    low, high, near_state, past_branch = 0.0, 1.0, base.state, ahead
    row = base.after / scale
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
