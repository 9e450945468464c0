"""Solutions between the points of a path, where amplitudes and slopes there do not tell enough.

Steps are as long as continuation can make them. What is drawn between two points is held against
what their states and tangents tell; where these differ, the path is solved for in between.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation.between.slopes import Slopes
from symhbm.continuation.correctors import Corrector, Hyperplane, unit_parameter
from symhbm.continuation.newton import ACCEPTED, slope_of
from symhbm.continuation.point import UNBOUNDED_AMPLIFICATION, EventKind, PathPoint
from symhbm.continuation.segment import PathState, Segment, measure
from symhbm.numerics import FloatArray, amplitude_between, cubic, largest_displacement

TOLERANCE = 0.005
"""Relative error of the largest response that may be drawn: 0.04 dB."""
_OF_EACH = 0.01
"""The same of the response of each degree of freedom."""
_FAINT = 1e-3
"""Share of the largest response below which the others may be off by more."""
_SHARES = np.array([0.25, 0.5, 0.75])
_MAX_DEPTH = 6
_AT_ONCE = 2**16
"""Amplitudes that are looked at at once, which bounds the memory of large structures."""


class _Gap(NamedTuple):
    """A stretch between two solutions behind a point of a path, and which of them are folds."""

    number: int
    left: PathState
    right: PathState
    folds: tuple[bool, bool] = (False, False)


def turns_back(point: PathPoint) -> bool:
    """Whether the tangent stands across the parameter: at a fold that is no corner."""
    is_fold = any(event.kind == EventKind.FOLD for event in point.events)
    return is_fold and np.array_equal(point.before, point.after)


def solved_between(
    points: Sequence[PathPoint], corrector: Corrector, each: bool = False
) -> dict[int, list[tuple[PathState, int]]]:
    """Solutions needed between points of a path, in its order, by the number of the point before.

    Each comes with the linear solves it took. The largest response is to be drawn within about
    `TOLERANCE`; that of ``each`` degree of freedom, too, where that is asked for.
    """
    found: dict[int, list[tuple[PathState, int]]] = {}
    gaps = _gaps(points)
    for _ in range(_MAX_DEPTH):
        halves = []
        for gap, share in zip(gaps, _needed(gaps, corrector, each), strict=True):
            before = corrector.solves
            middle = _solved(gap, corrector, points[gap.number], share) if share else None
            if middle is not None:
                station = middle, corrector.solves - before
                found.setdefault(gap.number, []).append(station)
                halves.append(gap._replace(right=middle, folds=(gap.folds[0], False)))
                halves.append(gap._replace(left=middle, folds=(False, gap.folds[1])))
        gaps = halves
    for number, stations in found.items():
        heading = np.sign(points[number + 1].value - points[number].value)
        stations.sort(key=lambda each, heading=heading: heading * each[0].state[-1])
    return found


def _gaps(points: Sequence[PathPoint]) -> list[_Gap]:
    """The stretches of a path that have a length and do not climb beyond double precision."""
    gaps = []
    for i, (here, there) in enumerate(pairwise(points)):
        drowned = max(here.amplification, there.amplification) > UNBOUNDED_AMPLIFICATION
        if not drowned and here.value != there.value:
            ends = PathState(here.state, here.after), PathState(there.state, there.before)
            gaps.append(_Gap(i, *ends, (turns_back(here), turns_back(there))))
    return gaps


def _needed(gaps: list[_Gap], corrector: Corrector, each: bool) -> FloatArray:
    """Share of the way (n_gaps,) at which to solve for the path, 0 where that is not needed.

    That over the parameter where there is one solution at each value.
    """
    most = max(_AT_ONCE // (len(_SHARES) * corrector.curve.problem.n_dof), 1)
    parts = [gaps[i : i + most] for i in range(0, len(gaps), most)]
    return np.concatenate([_worst(part, corrector, each) for part in parts] or [np.empty(0)])


def _worst(gaps: list[_Gap], corrector: Corrector, each: bool) -> FloatArray:
    curve = corrector.curve
    left, right = (
        Slopes.of(
            curve.problem,
            PathState(
                np.array([getattr(gap, side).state for gap in gaps]),
                np.array([getattr(gap, side).direction for gap in gaps]),
            ),
        )
        for side in ("left", "right")
    )
    width = (right.state - left.state)[:, -1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        first, last = (
            np.where(fold[:, None], np.inf, width * at.slope / at.direction[:, -1:])[:, None]
            for at, fold in zip((left, right), np.array([g.folds for g in gaps]).T, strict=True)
        )
    slopes = first, last
    scale = np.array([curve.scale(gap.left.state) for gap in gaps])
    measured = measure(curve.single_valued, left, right, scale)
    tangents = [[measured.left, measured.right]]
    if curve.single_valued:
        # Over the parameter the same states and tangents give another cubic: both may be wrong.
        tangents.append([width * at.direction / at.direction[:, -1:] for at in (left, right)])
    wrong = np.zeros((len(gaps), len(_SHARES)))
    for first, last in tangents:
        pair = first[:, None], last[:, None]
        state = cubic(left.state[:, None], right.state[:, None], pair, _SHARES[:, None])
        expected = _amplitude(curve.problem, state[..., :-1])
        share = (state[..., -1:] - left.state[:, None, -1:]) / width[:, None]
        ends = left.amplitude[:, None], right.amplitude[:, None]
        drawn = amplitude_between(*ends, slopes, np.clip(share, 0.0, 1.0))
        wrong = np.maximum(wrong, _error(drawn, expected, each))
    worst = wrong.argmax(axis=1)
    return np.where(wrong.max(axis=1) > 1, _SHARES[worst], 0.0)


def _amplitude(problem: HarmonicBalance, unknowns: FloatArray) -> FloatArray:
    """Largest displacements (..., n_dof) of motions (..., n_unknowns)."""
    motions = unknowns.reshape(-1, problem.basis.n_components)
    return largest_displacement(problem.basis, motions)[0].reshape(*unknowns.shape[:-1], -1)


def _error(drawn: FloatArray, expected: FloatArray, each: bool) -> FloatArray:
    """Largest difference of the amplitudes (..., n_dof) over what is allowed."""
    largest = expected.max(axis=-1)
    scale = np.where(largest > 0, largest, 1.0)
    error = np.abs(drawn.max(axis=-1) - largest) / (TOLERANCE * scale)
    if not each:
        return error
    level = _OF_EACH * np.maximum(expected, _FAINT * scale[..., None])
    return np.maximum(error, (np.abs(drawn - expected) / level).max(axis=-1))


def _solved(gap: _Gap, corrector: Corrector, before: PathPoint, share: float) -> PathState | None:
    """The solution at a share of the way, if it stands with all contacts free."""
    curve = corrector.curve
    if curve.single_valued:
        found = _at_value(gap, corrector, before, share)
    else:
        found = Segment(corrector, gap.left, gap.right, before.slip).solve(share)
        low, high = sorted(end.state[-1] for end in (gap.left, gap.right))
        if found is None or not low < found.state[-1] < high:
            return None
    if found is None:
        return None
    norm = curve.evaluate(found.state[:-1], float(found.state[-1])).norm
    return found if norm <= ACCEPTED else None


def _at_value(gap: _Gap, corrector: Corrector, before: PathPoint, share: float) -> PathState | None:
    """The solution at a share of the way over the parameter."""
    curve, left, right = corrector.curve, gap.left, gap.right
    width = right.state[-1] - left.state[-1]
    slopes = tuple(width * end.direction / end.direction[-1] for end in (left, right))
    guess = cubic(left.state, right.state, slopes, share)
    scale = curve.scale(guess)
    plane = Hyperplane(guess, scale, np.sign(width) * unit_parameter(len(scale)))
    found = corrector.correct(guess, scale, plane, before.slip)
    if found is not None and not found.crosses:
        return PathState(found.point, found.direction * scale)
    value = float(guess[-1])
    anew = corrector.free(guess[:-1], value)
    if not anew.converged:
        return None
    direction = np.sign(width) * np.append(slope_of(anew.evaluation), 1.0)
    return PathState(np.append(anew.unknowns, value), direction)
