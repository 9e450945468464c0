"""Intermediate solutions for response curves that are interpolated between path points.

Continuation steps may be too long for drawing. The amplitude interpolated from amplitudes and
slopes is compared with that of the interpolated states; where they differ, the path is solved for
in between. Next to an onset or end of slip the states follow a root, and their interpolation is the
less accurate one of both: the tolerances are aims, and no bounds.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.continuation.between.slopes import FLAT_SLOPE, TIE, Slopes
from symhbm.continuation.correctors import (
    ON_LIMIT,
    Corrector,
    Hyperplane,
    crossed,
    unit_parameter,
)
from symhbm.continuation.newton import slope_of
from symhbm.continuation.point import UNBOUNDED_AMPLIFICATION, EventKind, PathPoint
from symhbm.continuation.segment import (
    PathState,
    Segment,
    has_other_states,
    is_beyond,
    measure,
)
from symhbm.numerics import FloatArray, largest_displacement
from symhbm.numerics.loops import Loop, interpolation

TOLERANCE = 0.005
"""Relative error of the largest response between two points that is aimed at: 0.04 dB."""
_TOLERANCE_PER_DOF = 0.01
"""That of the response of each degree of freedom."""
_SMALL_SHARE = 1e-3
"""Share of the largest response that is the least reference of errors per degree of freedom."""
_SHARES = np.array([0.25, 0.5, 0.75])
"""Shares of a segment at which the error of interpolation is estimated."""
_MAX_DEPTH = 12
"""Most times that a segment is split."""
_BATCH_SIZE = 2**16
"""Amplitudes evaluated at once, which bounds the memory of large structures."""


class _Ends(NamedTuple):
    """Neighbouring solutions after path points ``number`` (n,), and which are smooth folds (n, 2).

    Of one segment alone, without the first axis.
    """

    number: Any
    left: PathState
    right: PathState
    folds: Any

    def take(self, index: Any) -> "_Ends":
        """Those of one segment or of some."""
        return _Ends(*(part[index] for part in self))


def is_smooth_fold(point: PathPoint) -> bool:
    """Whether the point is a fold that is no corner: its tangent is normal to the parameter."""
    is_fold = any(event.kind == EventKind.FOLD for event in point.events) or point.after[-1] == 0
    return is_fold and np.array_equal(point.before, point.after)


def solved_between(
    points: Sequence[PathPoint], corrector: Corrector, per_dof: bool = False
) -> tuple[dict[int, list[tuple[PathState, int]]], dict[int, float]]:
    """The solutions that interpolation between path points needs, by the index of the point before.

    They are in the order of the path, each with the linear solves it took. Also by that index a
    value at which one shows a maximum, or a contact in another state, that the path passed over.
    """
    solutions: dict[int, list[tuple[PathState, int]]] = {}
    passed: dict[int, float] = {}
    if len(points) < 2:
        return solutions, passed
    segments = _segments(points)
    size = max(_BATCH_SIZE // (len(_SHARES) * corrector.curve.problem.n_dof), 1)
    for depth in range(_MAX_DEPTH + 1):
        halves = []
        for begin in range(0, len(segments.number), size):
            batch = segments.take(slice(begin, begin + size))
            shares, hides = _needed_shares(batch, corrector, per_dof)
            for k in np.flatnonzero((shares > 0) | hides).tolist():
                segment, share = batch.take(k), float(shares[k])
                number, solves_before = int(segment.number), corrector.solves
                if hides[k] and depth > 0:
                    ends = float(segment.left.state[-1]), float(segment.right.state[-1])
                    passed[number] = ends[ends[0] == points[number].value]
                if not share or depth == _MAX_DEPTH:
                    continue
                middle, leaves = _solution(segment, corrector, points[number].switches, share)
                if middle is not None and leaves:
                    passed[number] = float(middle.state[-1])
                elif middle is not None:
                    solution = middle, corrector.solves - solves_before
                    solutions.setdefault(number, []).append(solution)
                    folds = segment.folds.tolist()
                    halves.append(segment._replace(right=middle, folds=(folds[0], False)))
                    halves.append(segment._replace(left=middle, folds=(False, folds[1])))
        if not halves:
            break
        numbers, left, right, smooth = zip(*halves, strict=True)
        first, last = (PathState.stacked(side) for side in (left, right))
        segments = _Ends(np.array(numbers), first, last, np.array(smooth))
    for number, several in solutions.items():
        heading = np.sign(points[number + 1].value - points[number].value)
        several.sort(key=lambda pair, heading=heading: heading * pair[0].state[-1])
    return solutions, passed


def _segments(points: Sequence[PathPoint]) -> _Ends:
    """The segments of finite length and bounded amplification."""
    names = ("state", "before", "after", "amplification")
    state, before, after, amplification = (
        np.array([getattr(point, name) for point in points]) for name in names
    )
    folds = np.array([bool(point.events) and is_smooth_fold(point) for point in points])
    unbounded = amplification > UNBOUNDED_AMPLIFICATION
    number = np.flatnonzero(~(unbounded[:-1] | unbounded[1:]) & (state[:-1, -1] != state[1:, -1]))
    right = number + 1
    ends = PathState(state[number], after[number]), PathState(state[right], before[right])
    return _Ends(number, *ends, np.stack([folds[number], folds[right]], axis=1))


def _needed_shares(
    segments: _Ends, corrector: Corrector, per_dof: bool
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """The share (n,) of each segment at which a solution is needed, 0 where none is.

    Where the response is single-valued, it is one of the parameter interval. Also whether slopes
    at both ends tell of a maximum in between (n,).
    """
    problem, single_valued = corrector.curve.problem, corrector.curve.single_valued
    left, right = (Slopes.of(problem, side) for side in (segments.left, segments.right))
    scale = np.array([corrector.curve.scale(state) for state in left.state])
    measured = measure(single_valued, left, right, scale)
    tangents = [(measured.left, measured.right)]
    if single_valued:
        # A cubic over the parameter differs from one over the arc length: the worse one counts.
        width = (right.state - left.state)[:, -1:]
        first, last = (width * at.direction / at.direction[:, -1:] for at in (left, right))
        tangents.append((first, last))
    n = len(segments.number)
    states = np.empty((n, len(_SHARES), left.state.shape[1]))
    worst = np.zeros((2, n))
    for pair in tangents:
        interpolation.interpolate(left.state, right.state, *pair, _SHARES, states)
        expected = _amplitude(problem, states[..., : problem.n_unknowns])
        sides = ((at.state, at.direction, at.amplitude, at.slope) for at in (left, right))
        _largest_error(*sides, segments.folds, states, expected, per_dof, *worst)
    hides = np.any(_rises(left, 1, per_dof) & _rises(right, -1, per_dof), axis=1)
    return worst[1], hides


@Loop
def _largest_error(
    left: tuple[Any, Any, Any, Any],
    right: tuple[Any, Any, Any, Any],
    folds: Any,
    states: Any,
    expected: Any,
    per_dof: bool,
    largest: Any,
    shares: Any,
) -> None:
    """Raise the ``largest`` errors of segments, and write the shares of those above 1.

    Of what is drawn from states, directions, amplitudes and slopes ``left`` and ``right`` at their
    ends, against amplitudes ``expected`` (n, s, n_dof) at ``states`` (n, s, n_unknowns + 1); errors
    are relative to the tolerance. ``folds`` (n, 2) tells which ends are smooth ones.
    """
    n, n_shares, n_dof = expected.shape
    drawn = np.empty(n_dof)
    for i in range(n):
        begin = left[0][i, -1]
        width = right[0][i, -1] - begin
        to_first = math.inf if folds[i, 0] else width / left[1][i, -1]
        to_last = math.inf if folds[i, 1] else width / right[1][i, -1]
        for h in range(n_shares):
            share = min(max((states[i, h, -1] - begin) / width, 0.0), 1.0)
            for j in range(n_dof):
                first = math.inf if folds[i, 0] else to_first * left[3][i, j]
                last = math.inf if folds[i, 1] else to_last * right[3][i, j]
                drawn[j] = interpolation.amplitude_at(
                    left[2][i, j], right[2][i, j], first, last, share
                )
            error = _relative_error(drawn, expected[i, h], per_dof)
            if error > largest[i]:
                largest[i] = error
                if error > 1:
                    shares[i] = _SHARES[h]


def _rises(at: Slopes, heading: int, per_dof: bool) -> NDArray[np.bool_]:
    """Whether each response rises, or (n, 1) whether one does that leads."""
    rises = heading * at.slope > FLAT_SLOPE * at.amplitude
    if per_dof:
        return rises
    leads = at.amplitude >= (1 - TIE) * at.amplitude.max(axis=1, keepdims=True)
    return (rises & leads).any(axis=1, keepdims=True)


def _amplitude(problem: HarmonicBalance, unknowns: FloatArray) -> FloatArray:
    """Largest values (..., n_peaking) of what has peaks at motions (..., n_unknowns)."""
    motions = problem.peaking(unknowns).reshape(-1, problem.basis.n_components)
    return largest_displacement(problem.basis, motions)[0].reshape(*unknowns.shape[:-1], -1)


@Loop
def _relative_error(drawn: Any, expected: Any, per_dof: bool) -> float:
    """Largest difference of the amplitudes (n_dof,), relative to the tolerance."""
    largest = expected.max()
    scale = largest if largest > 0 else 1.0
    error = abs(drawn.max() - largest) / (TOLERANCE * scale)
    if per_dof:
        for j in range(len(drawn)):
            reference = max(expected[j], _SMALL_SHARE * scale)
            error = max(error, abs(drawn[j] - expected[j]) / (_TOLERANCE_PER_DOF * reference))
    return error


def _solution(
    segment: _Ends, corrector: Corrector, switches: NDArray[np.bool_], share: float
) -> tuple[PathState | None, bool]:
    """The solution at a share of the segment, of the parameter interval where single-valued.

    Also whether a contact is in another state there, and not by round-off.
    """
    if corrector.curve.single_valued:
        return _solution_at_value(segment, corrector, switches, share)
    between = Segment(corrector, segment.left, segment.right, switches)
    solution = between.corrected(share)
    low, high = sorted(end.state[-1] for end in (segment.left, segment.right))
    if solution is None or not low < solution.point[-1] < high:
        return None, False
    leaves = is_beyond(solution.margins, switches, ON_LIMIT)
    return PathState(solution.point, solution.direction * between.scale), leaves


def _solution_at_value(
    segment: _Ends, corrector: Corrector, switches: NDArray[np.bool_], share: float
) -> tuple[PathState | None, bool]:
    """The solution at a share of the parameter interval, contacts free where one changes.

    It may be one of the arc length where the path bends too sharply for that.
    """
    curve, left, right = corrector.curve, segment.left, segment.right
    width = right.state[-1] - left.state[-1]
    value = float(left.state[-1] + share * width)
    between = Segment(corrector, left, right, switches)
    along, guess = between.at_value(value)
    scale = curve.scale(guess)
    plane = Hyperplane(guess, scale, np.sign(width) * unit_parameter(len(scale)))
    corrected = corrector.correct(guess, scale, plane, switches)
    if corrected is None:
        # Where the path bends sharply over the parameter, the solution across it is close.
        near = between.solve(along)
        if near is not None:
            start = near.state + (value - near.state[-1]) / near.direction[-1] * near.direction
            corrected = corrector.correct(start, scale, plane, switches)
            if corrected is None and 0 < (near.state[-1] - left.state[-1]) / width < 1:
                return near, False
    if corrected is not None and corrected.crosses:
        flipped = switches ^ crossed(corrected.margins, switches)
        corrected = corrector.correct(corrected.point, scale, plane, flipped)
    if corrected is not None and not corrected.crosses:
        leaves = is_beyond(corrected.margins, switches, ON_LIMIT)
        return PathState(corrected.point, corrected.direction * scale), leaves
    result = corrector.free(guess[:-1], value)
    if not result.converged:
        return None, False
    direction = np.sign(width) * np.append(slope_of(result.evaluation), 1.0)
    leaves = has_other_states(result, switches, ON_LIMIT)
    return PathState(np.append(result.unknowns, value), direction), leaves
