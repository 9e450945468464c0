"""Following of nonlinear modes over their amplitude or a parameter, with turns of their damping."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation.branch import Branch
from symhbm.continuation.correctors import Corrector, corrector_of
from symhbm.continuation.events import find_folds
from symhbm.continuation.following import follow_with
from symhbm.continuation.newton import NewtonResult, newton
from symhbm.continuation.point import Event, EventKind, PathPoint
from symhbm.continuation.segment import Segment
from symhbm.continuation.status import Status
from symhbm.continuation.unforced.modes import (
    NO_DAMPING,
    LinearMode,
    ModeOverParameterProblem,
    NonlinearModeProblem,
    mode_start,
)
from symhbm.numerics import on_one_thread, refined

_LOWEST = 1e-2
"""Frequency over that of the linear mode below which a motion does not oscillate any more."""
_NEAR = 1.5
"""Last frequency of a path, over that lowest one, from which on it ended for another reason."""
_STRAIGHT = 2e-3
"""Error of lines between points, relative to the frequency and to the largest damping ratio."""
_MOST_PASSES = 4
"""How often a branch goes on beyond a motion in which its amplitude is zero."""
_SMALL = 0.1
"""Change of a motion, relative, over a small amplitude that becomes negative."""
_SHARES = np.array([0.25, 0.5, 0.75])
_CONSTANT = 1e-6
"""Slope of a damping ratio by the arc length that errors of tangents explain."""


@on_one_thread
def follow_mode(
    curve: NonlinearModeProblem, linear: LinearMode, band: tuple[float, float], max_points: int
) -> Branch:
    """The branch of a mode over a ``band`` of common logarithms of amplitudes [m], ascending.

    It starts from the ``linear`` mode, at smaller amplitudes if need be. Where the damping ratio
    has a maximum or a minimum is a point, an event of its own kind. Straight lines between points
    tell frequencies and damping ratios. Where a harmonic resonates with another mode, the amplitude
    may come back to the smallest one while that mode moves: the branch goes on beyond zero.
    """
    curve.lowest = _LOWEST * linear.frequency
    start = partial(mode_start, curve, linear)
    branch = _followed(curve, lambda value: start(10.0**value), band, max_points)
    for _ in range(_MOST_PASSES):
        if branch.status != Status.TURNED_BACK:
            return branch
        beyond = _beyond_zero(curve, branch.points[-1])
        if beyond is None:
            break
        more = _followed(curve, lambda _, at=beyond: at, band, max_points - len(branch.points))
        more.corrector.solves += branch.corrector.solves
        points, rejected = branch.points + more.points, branch.rejected + more.rejected
        branch = replace(more, points=points, rejected=rejected)
    return replace(branch, status=Status.MODE_TURNED_BACK)


def _beyond_zero(curve: NonlinearModeProblem, last: PathPoint) -> NewtonResult | None:
    """The motion beyond one in which the degree of freedom that tells the amplitude rests.

    It has the amplitude of the ``last`` point with the opposite sign, which a delay by half a
    period makes positive. None where all comes to rest, and where the delay makes it the same.
    """
    size, basis = curve.problem.n_unknowns, curve.problem.basis
    guess = last.unknowns - 2 / np.log(10.0) * last.before[:-1] / last.before[-1]
    guess[:size] *= np.tile((-1.0) ** basis.order, curve.problem.n_dof)
    found = newton(partial(curve.evaluate, value=last.value), guess)
    moved, off = (
        np.linalg.norm((found.unknowns - known)[:size]) for known in (last.unknowns, guess)
    )
    allowed = _SMALL * np.linalg.norm(last.unknowns[:size])
    return found if found.converged and off < allowed < moved else None


@on_one_thread
def follow_mode_over(
    curve: ModeOverParameterProblem,
    linear: Callable[[HarmonicBalance], LinearMode],
    band: tuple[float, float],
    max_points: int,
) -> Branch:
    """The branch of a mode of one amplitude over a ``band`` of a parameter, as `follow_mode`.

    ``linear`` tells the linear mode of the problem at a value; the nonlinear one is followed from
    it over the amplitude to the first value of the band.
    """
    curve.lowest = _LOWEST * linear(curve.problem_at(band[0])).frequency

    def start(value: float) -> NewtonResult:
        problem = curve.problem_at(value)
        over_amplitude = NonlinearModeProblem(problem, curve.dof)
        over_amplitude.lowest = curve.lowest
        found = mode_start(over_amplitude, linear(problem), curve.level)
        if not found.converged:
            return found
        return newton(partial(curve.evaluate, value=value), found.unknowns)

    return _followed(curve, start, band, max_points)


def _followed(
    curve: NonlinearModeProblem,
    start: Callable[[float], NewtonResult],
    band: tuple[float, float],
    max_points: int,
) -> Branch:
    """The branch of a mode from where it is found at the first value of a band."""
    corrector = corrector_of(curve)

    def solve_from_scratch(value: float) -> NewtonResult:
        result = start(value)
        corrector.solves += result.iterations
        return result

    branch = follow_with(corrector, solve_from_scratch, band, max_points, per_dof=False)
    points, status = branch.points, branch.status
    if points and curve.frequency(points[-1].unknowns) < _NEAR * curve.lowest:
        status = Status.NO_FREQUENCY
    points = _filled(corrector, _with_turns(corrector, curve.damping_place, points))
    return replace(branch, points=points, status=status)


def _with_turns(corrector: Corrector, place: int, points: list[PathPoint]) -> list[PathPoint]:
    """The points of a path, and those at which one of its unknowns turns."""
    turn, result = Event(EventKind.DAMPING_TURNS), points[:1]
    last = _sign(points[0].after[place]) if points else 0
    for left, right in pairwise(points):
        leaving, arriving = _sign(left.after[place]), _sign(right.before[place])
        if leaving * arriving:
            for state in find_folds(corrector, left, right, place) or ():
                scale = corrector.curve.scale(state.state)
                row = state.direction / scale
                solution = corrector.tangent(state.state, scale, row, left.switches)
                if solution is not None:
                    given = corrector.curve, solution, scale, left.switches, 0, (turn,)
                    result.append(PathPoint.of(*given))
        # At a corner, or at a point that is a turn by chance.
        before, after = arriving or last, _sign(right.after[place])
        turns = before * after < 0
        last = after or (before if not right.events else 0)
        result.append(right._replace(events=(*right.events, turn)) if turns else right)
    return result


def _sign(slope: float) -> int:
    """1 or -1, 0 of a slope that is none but for errors of tangents."""
    return int(np.sign(slope)) if abs(slope) > _CONSTANT else 0


def _filled(corrector: Corrector, points: list[PathPoint]) -> list[PathPoint]:
    """The points of a path, and those between them that straight lines need."""
    curve = corrector.curve
    assert isinstance(curve, NonlinearModeProblem)
    places = [curve.problem.n_unknowns, curve.damping_place]
    damping = max([NO_DAMPING, *(abs(point.state[places[1]]) for point in points)])

    def middle(left: PathPoint, right: PathPoint) -> PathPoint | None:
        segment = Segment.of(corrector, left, right)
        curved = segment.interpolate(_SHARES)[0]
        width = right.value - left.value
        share = (curved[:, -1:] - left.value) / width if width else _SHARES[:, None]
        line = left.state[places] + share * (right.state - left.state)[places]
        allowed = _STRAIGHT * np.array([left.state[places[0]], damping])
        if not segment.length > 0 or np.all(np.abs(curved[:, places] - line) <= allowed):
            return None
        solution = segment.corrected(0.5)
        if solution is None or solution.crosses:
            return None
        return PathPoint.of(curve, solution, segment.scale, left.switches, 0)

    return refined(points, middle)
