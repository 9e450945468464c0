"""Limit cycles of a structure: found along its nonlinear modes, followed over a parameter."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from symhbm.continuation.branch import Branch
from symhbm.continuation.correctors import Corrector, corrector_of
from symhbm.continuation.following import follow_with
from symhbm.continuation.newton import NewtonResult, newton
from symhbm.continuation.point import Event, EventKind, PathPoint, switched
from symhbm.continuation.segment import PathState, Segment
from symhbm.continuation.status import Status
from symhbm.continuation.unforced.modes import NO_DAMPING, NonlinearModeProblem
from symhbm.continuation.unforced.problem import LimitCycleProblem
from symhbm.numerics import FloatArray, on_one_thread

_ROUND_OFF = 1e-9
"""Share of the largest value of a parameter by which two values are the same."""
_SAME = 1e-6
"""Distance of two cycles, relative, that are one."""
_AT_END = 1.1
"""Amplitude over an end of the band of amplitudes, or below it, of a path that ended there."""
_NEAR = 1.5
"""Last frequency of a path, over the lowest one, from which on it ended for that reason."""


class Cycle(NamedTuple):
    """A cycle at a ``value`` of the parameter that moves: coefficients and frequency."""

    value: float
    unknowns: FloatArray
    solves: int = 0
    events: tuple[Event, ...] = ()


@dataclass(frozen=True)
class Cycles:
    """All cycles that were found: connected ``branches`` of them, or ``alone``, at no parameter."""

    corrector: Corrector
    status: Status
    alone: tuple[Cycle, ...] = ()
    branches: tuple[Branch, ...] = ()

    @property
    def points(self) -> Sequence[Cycle | PathPoint]:
        """Cycles that stand alone, or the points of one branch after the other."""
        return [*self.alone, *(point for branch in self.branches for point in branch.points)]

    @property
    def numbers(self) -> list[int]:
        """Numbers of the branches that points are of."""
        along = [i for i, branch in enumerate(self.branches) for _ in branch.points]
        return [*([0] * len(self.alone)), *along]

    @property
    def rejected(self) -> int:
        """Number of rejected steps."""
        return sum(branch.rejected for branch in self.branches)

    @property
    def fold(self) -> float:
        """Value of the parameter at the fold beyond which there is no cycle, NaN without."""
        points = self.points
        folds = [p.value for p in points if any(e.kind == EventKind.FOLD for e in p.events)]
        return last_fold(np.array(folds), np.array([point.value for point in points]))

    def at(self, value: float) -> list[tuple[PathState | None, int]]:
        """Cycles at a value of the parameter, each with the linear solves it took."""
        found = []
        for branch in self.branches:
            values = [point.value for point in branch.points]
            if min(values) <= value <= max(values):
                found += branch.at(value)
        return found


def last_fold(folds: FloatArray, values: FloatArray) -> float:
    """The one of the ``folds`` beyond which there is none of the ``values``, NaN without.

    Of two such folds, below all values and above, it is the first one.
    """
    for fold in folds.tolist():
        past = values - fold
        past = np.sign(past) * (np.abs(past) > _ROUND_OFF * np.abs(values).max())
        if abs(past.min(initial=0.0) + past.max(initial=0.0)) == 1:
            return fold
    return np.nan


@on_one_thread
def cycles_of_mode(branch: Branch) -> list[FloatArray]:
    """Cycles along a nonlinear mode: where its damping ratio changes its sign.

    Coefficients and frequency, (n_coefficients + 1,) each, from the first point on. Over a range of
    amplitudes without damping every motion is one; they are left out.
    """
    curve, points = branch.curve, branch.points
    assert isinstance(curve, NonlinearModeProblem)
    place, cycles = curve.damping_place, []
    ratios = [float(point.state[place]) for point in points]
    damped = [i for i, ratio in enumerate(ratios) if abs(ratio) > NO_DAMPING]
    for i, j in pairwise(damped):
        if ratios[i] * ratios[j] > 0 or j > i + 2:
            continue
        at_point = j == i + 2
        state = points[i + 1].state if at_point else _undamped(branch, points[i], points[j], place)
        cycles.append(state[:place])
    return cycles


def _undamped(branch: Branch, left: PathPoint, right: PathPoint, place: int) -> FloatArray:
    """The motion between two points whose damping ratio, at a ``place`` of the unknowns, is 0."""
    segment = Segment.of(branch.corrector, left, right)
    try:
        return segment.zero(lambda at: at.state[place]).state
    except ArithmeticError:
        # Interpolation tells well enough where to start from.
        return segment.at_value(0.0, place)[1]


def settled(
    curve: LimitCycleProblem, starts: Sequence[FloatArray], value: float
) -> tuple[list[Cycle], int]:
    """Cycles at a value of the parameter near ``starts``, one of each, and how many have none."""
    found: list[Cycle] = []
    lost = 0
    for start in starts:
        try:
            result = newton(lambda unknowns: curve.evaluate(unknowns, value), start)
        except ArithmeticError:
            lost += 1
            continue
        lost += not result.converged
        new = not any(_are_one(curve, cycle.unknowns, result.unknowns) for cycle in found)
        if result.converged and new:
            found.append(Cycle(value, result.unknowns, result.iterations))
    return sorted(found, key=lambda cycle: curve.amplitude(cycle.unknowns)), lost


def _are_one(curve: LimitCycleProblem, first: FloatArray, second: FloatArray) -> bool:
    n = curve.problem.n_unknowns
    parts = (slice(0, n), slice(n, None))
    return all(
        np.linalg.norm(first[part] - second[part]) <= _SAME * np.linalg.norm(first[part])
        for part in parts
    )


@on_one_thread
def follow_cycles(
    curve: LimitCycleProblem, seeds: Sequence[Cycle], band: tuple[float, float], max_points: int
) -> Cycles:
    """All branches through some cycles, within a ``band`` of the parameter and of amplitudes."""
    corrector, low, high = corrector_of(curve), min(band), max(band)
    branches: list[Branch] = []
    for seed in seeds:
        passes = (
            state is not None and _are_one(curve, seed.unknowns, state.state[:-1])
            for branch in branches
            for state, _ in Cycles(corrector, branch.status, branches=(branch,)).at(seed.value)
        )
        if not any(passes):
            branches.append(_through(corrector, seed, (low, high), max_points))
    status = Status.REACHED_END if branches else Status.NO_CYCLES
    incomplete = [branch.status for branch in branches if branch.status != status]
    return Cycles(corrector, incomplete[0] if incomplete else status, branches=(*branches,))


def _through(
    corrector: Corrector, seed: Cycle, band: tuple[float, float], max_points: int
) -> Branch:
    """The branch through a cycle, from its smaller end on."""
    curve = corrector.curve
    assert isinstance(curve, LimitCycleProblem)
    branch, closed = _one_way(corrector, seed, band, max_points, 1)
    points, status, rejected = branch.points, branch.status, branch.rejected
    if not closed:
        back, _ = _one_way(corrector, seed, band, max_points, -1)
        before = _backwards(curve, back.points)
        points = [*(before[:-1] if points else before), *points]
        status = back.status if status == Status.REACHED_END else status
        rejected += back.rejected
    if points and curve.amplitude(points[0].unknowns) > curve.amplitude(points[-1].unknowns):
        points = _backwards(curve, points)
    return replace(branch, points=points, status=status, rejected=rejected)


def _one_way(
    corrector: Corrector, seed: Cycle, band: tuple[float, float], max_points: int, heading: int
) -> tuple[Branch, bool]:
    """The branch of a cycle towards one end of the band, and whether it comes back to the cycle.

    Beyond a fold it may come back to the value it started from: from there it is followed on.
    """
    curve, at, closed = corrector.curve, seed, False
    assert isinstance(curve, LimitCycleProblem)

    def solve_from_scratch(value: float) -> NewtonResult:
        return newton(lambda unknowns: curve.evaluate(unknowns, value), seed.unknowns)

    whole = Branch(corrector, solve_from_scratch, False, [], [], Status.REACHED_END, 0)
    while not closed and at.value != (end := band[heading > 0]):
        run = at.value, end
        part = follow_with(corrector, solve_from_scratch, run, max_points, False, at.unknowns)
        points = [*whole.points, *part.points[bool(whole.points) :]]
        rejected = whole.rejected + part.rejected
        whole = replace(whole, points=points, status=part.status, rejected=rejected)
        if part.status != Status.TURNED_BACK or len(points) >= max_points:
            break
        at, heading = Cycle(points[-1].value, points[-1].unknowns), -heading
        closed = _are_one(curve, at.unknowns, seed.unknowns)
        whole = replace(whole, status=Status.REACHED_END)
    return _ended(curve, whole), closed


def _ended(curve: LimitCycleProblem, branch: Branch) -> Branch:
    """A branch that is complete where it ended at an end of the band of amplitudes."""
    if branch.status == Status.REACHED_END or not branch.points:
        return branch
    (low, high), last = curve.amplitudes, branch.points[-1]

    def is_at_end(point: PathPoint) -> bool:
        return not _AT_END * low < curve.amplitude(point.unknowns) < high / _AT_END

    if is_at_end(last):
        # Steps shrank towards the end: their points tell nothing.
        inside = [point for point in branch.points[:-1] if point.events or not is_at_end(point)]
        return replace(branch, points=[*inside, last], status=Status.REACHED_END)
    if curve.frequency(last.unknowns) < _NEAR * curve.lowest:
        return replace(branch, status=Status.NO_FREQUENCY)
    return branch


def _backwards(curve: LimitCycleProblem, points: Sequence[PathPoint]) -> list[PathPoint]:
    """The same points in the opposite order: what begins on the way there ends on the way back."""
    result = []
    for i in reversed(range(len(points))):
        point = points[i]
        switches = points[i - 1].switches if i else point.switches
        events = tuple(event for event in point.events if event.turns_on is None)
        changes = switched(curve.problem, point.switches, switches)
        result.append(
            point._replace(
                before=-point.after,
                after=-point.before,
                rate=-point.rate,
                switches=switches,
                events=(*changes, *events),
            )
        )
    return result
