"""Intermediate solutions for response curves that are interpolated between path points.

Continuation steps may be too long for drawing. The amplitude interpolated from amplitudes and
slopes is compared with that of the interpolated states; where they differ, the path is solved for
in between. Next to an onset or end of slip the states follow a root, and their interpolation is the
less accurate one of both: the tolerances are aims, and no bounds.
"""

from collections.abc import Sequence
from itertools import chain, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.continuation.between.slopes import FLAT_SLOPE, TIE, Slopes
from symhbm.continuation.correctors import ON_LIMIT, Corrector, Hyperplane, unit_parameter
from symhbm.continuation.newton import ACCEPTED, slope_of
from symhbm.continuation.point import UNBOUNDED_AMPLIFICATION, EventKind, PathPoint
from symhbm.continuation.problem import ContinuationProblem
from symhbm.continuation.segment import PathState, Segment, measure
from symhbm.numerics import FloatArray, amplitude_between, cubic, largest_displacement

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
    """Two neighbouring solutions after a path point, and whether each is a smooth fold."""

    number: int
    left: PathState
    right: PathState
    folds: tuple[bool, bool] = (False, False)


def is_smooth_fold(point: PathPoint) -> bool:
    """Whether the point is a fold that is no corner: its tangent is normal to the parameter."""
    is_fold = any(event.kind == EventKind.FOLD for event in point.events)
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
    segments = _segments(points)
    size = max(_BATCH_SIZE // (len(_SHARES) * corrector.curve.problem.n_dof), 1)
    for depth in range(_MAX_DEPTH + 1):
        halves = []
        batches = [segments[i : i + size] for i in range(0, len(segments), size)]
        estimates = [_needed_shares(batch, corrector, per_dof) for batch in batches]
        for segment, (share, hides) in zip(segments, chain.from_iterable(estimates), strict=True):
            number, solves_before = segment.number, corrector.solves
            if hides and depth > 0:
                ends = float(segment.left.state[-1]), float(segment.right.state[-1])
                passed[number] = ends[ends[0] == points[number].value]
            if not share or depth == _MAX_DEPTH:
                continue
            middle = _solution(segment, corrector, points[number].switches, share)
            if middle is not None and _leaves(points[number].switches, middle, corrector.curve):
                passed[number] = float(middle.state[-1])
            elif middle is not None:
                solution = middle, corrector.solves - solves_before
                solutions.setdefault(number, []).append(solution)
                halves.append(segment._replace(right=middle, folds=(segment.folds[0], False)))
                halves.append(segment._replace(left=middle, folds=(False, segment.folds[1])))
        segments = halves
    for number, several in solutions.items():
        heading = np.sign(points[number + 1].value - points[number].value)
        several.sort(key=lambda pair, heading=heading: heading * pair[0].state[-1])
    return solutions, passed


def _segments(points: Sequence[PathPoint]) -> list[_Ends]:
    """The segments of finite length and bounded amplification."""
    segments = []
    for i, (point, following) in enumerate(pairwise(points)):
        unbounded = max(point.amplification, following.amplification) > UNBOUNDED_AMPLIFICATION
        if not unbounded and point.value != following.value:
            ends = PathState(point.state, point.after), PathState(following.state, following.before)
            segments.append(_Ends(i, *ends, (is_smooth_fold(point), is_smooth_fold(following))))
    return segments


def _needed_shares(
    segments: list[_Ends], corrector: Corrector, per_dof: bool
) -> list[tuple[float, bool]]:
    """The share of each segment at which a solution is needed, 0 where none is.

    Where the response is single-valued, it is one of the parameter interval. Also whether slopes
    at both ends tell of a maximum in between.
    """
    curve = corrector.curve
    ends = [segment.left for segment in segments], [segment.right for segment in segments]
    left, right = (Slopes.of(curve.problem, PathState.stacked(side)) for side in ends)
    width = (right.state - left.state)[:, -1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        folds = np.array([segment.folds for segment in segments]).T[..., None]
        first, last = (
            np.where(fold, np.inf, width * at.slope / at.direction[:, -1:])[:, None]
            for at, fold in zip((left, right), folds, strict=True)
        )
    slopes = first, last
    scale = np.array([curve.scale(segment.left.state) for segment in segments])
    measured = measure(curve.single_valued, left, right, scale)
    tangents = [[measured.left, measured.right]]
    if curve.single_valued:
        # A cubic over the parameter differs from one over the arc length: the worse one counts.
        tangents.append([width * at.direction / at.direction[:, -1:] for at in (left, right)])
    error = np.zeros((len(segments), len(_SHARES)))
    for first, last in tangents:
        pair = first[:, None], last[:, None]
        state = cubic(left.state[:, None], right.state[:, None], pair, _SHARES[:, None])
        expected = _amplitude(curve.problem, state[..., :-1])
        share = (state[..., -1:] - left.state[:, None, -1:]) / width[:, None]
        heights = left.amplitude[:, None], right.amplitude[:, None]
        drawn = amplitude_between(*heights, slopes, np.clip(share, 0.0, 1.0))
        error = np.maximum(error, _relative_error(drawn, expected, per_dof))
    worst = error.argmax(axis=1)
    hides = np.any(_rises(left, 1, per_dof) & _rises(right, -1, per_dof), axis=1)
    shares = np.where(error.max(axis=1) > 1, _SHARES[worst], 0.0)
    return list(zip(shares.tolist(), hides.tolist(), strict=True))


def _rises(at: Slopes, heading: int, per_dof: bool) -> NDArray[np.bool_]:
    """Whether each response rises, or (n, 1) whether one does that leads."""
    rises = heading * at.slope > FLAT_SLOPE * at.amplitude
    if per_dof:
        return rises
    leads = at.amplitude >= (1 - TIE) * at.amplitude.max(axis=1, keepdims=True)
    return (rises & leads).any(axis=1, keepdims=True)


def _amplitude(problem: HarmonicBalance, unknowns: FloatArray) -> FloatArray:
    """Largest displacements (..., n_dof) of motions (..., n_unknowns)."""
    motions = unknowns.reshape(-1, problem.basis.n_components)
    return largest_displacement(problem.basis, motions)[0].reshape(*unknowns.shape[:-1], -1)


def _relative_error(drawn: FloatArray, expected: FloatArray, per_dof: bool) -> FloatArray:
    """Largest difference of the amplitudes (..., n_dof), relative to the tolerance."""
    largest = expected.max(axis=-1)
    scale = np.where(largest > 0, largest, 1.0)
    error = np.abs(drawn.max(axis=-1) - largest) / (TOLERANCE * scale)
    if not per_dof:
        return error
    scale_per_dof = _TOLERANCE_PER_DOF * np.maximum(expected, _SMALL_SHARE * scale[..., None])
    return np.maximum(error, (np.abs(drawn - expected) / scale_per_dof).max(axis=-1))


def _solution(
    segment: _Ends, corrector: Corrector, switches: NDArray[np.bool_], share: float
) -> PathState | None:
    """The solution at a share of the segment, of the parameter interval where single-valued."""
    if corrector.curve.single_valued:
        return _solution_at_value(segment, corrector, switches, share)
    solution = Segment(corrector, segment.left, segment.right, switches).solve(share)
    low, high = sorted(end.state[-1] for end in (segment.left, segment.right))
    return solution if solution is not None and low < solution.state[-1] < high else None


def _leaves(switches: NDArray[np.bool_], solution: PathState, curve: ContinuationProblem) -> bool:
    """Whether a contact is in another state at a solution, and not by round-off."""
    evaluation = curve.evaluate(solution.state[:-1], float(solution.state[-1]))
    states = evaluation.states
    changed = (states.switches != switches) & (np.abs(states.margins) > ON_LIMIT)
    return evaluation.norm > ACCEPTED or bool(changed.any())


def _solution_at_value(
    segment: _Ends, corrector: Corrector, switches: NDArray[np.bool_], share: float
) -> PathState | None:
    """The solution at a share of the parameter interval, contacts free where one changes."""
    curve, left, right = corrector.curve, segment.left, segment.right
    width = right.state[-1] - left.state[-1]
    slopes = tuple(width * end.direction / end.direction[-1] for end in (left, right))
    guess = cubic(left.state, right.state, slopes, share)
    scale = curve.scale(guess)
    plane = Hyperplane(guess, scale, np.sign(width) * unit_parameter(len(scale)))
    corrected = corrector.correct(guess, scale, plane, switches)
    if corrected is not None and not corrected.crosses:
        return PathState(corrected.point, corrected.direction * scale)
    value = float(guess[-1])
    result = corrector.free(guess[:-1], value)
    if not result.converged:
        return None
    direction = np.sign(width) * np.append(slope_of(result.evaluation), 1.0)
    return PathState(np.append(result.unknowns, value), direction)
