"""Changes of stability along a path: where a Floquet multiplier passes the unit circle.

At +1 it is a fold or a branch point, which the path knows; at -1 motions of twice the period branch
off, and at a pair of complex multipliers motions of two frequencies. The growth rate of solutions
that are solved for along the path is brought to zero.
"""

from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from symhbm.continuation import Corrector, EventKind, PathState, Segment
from symhbm.numerics import bracketed_root, refined, watching
from symhbm.time_domain.stability import Growth, growth, multiplier_at, verdict

_BESIDE = 1e-2
"""Share of a segment at which stability next to an event is computed."""
_CONTINUOUS = 1e-6
"""Growth over the frequency up to which a multiplier passes the circle, and does not jump over."""
_REAL = 1e-9
"""Imaginary part of a multiplier that is round-off."""
_HALF = 0.25
"""Distance of an imaginary part from a multiple of the frequency, over it, that truncation makes.
"""
_CLOSE = 0.1
"""Growth rate over the largest one of a path below which it may pass zero twice in a step."""
_STRAIGHT = 0.5
"""Largest distance of a growth rate from the mean of its neighbours, over itself, in between."""
_STEEPER = 2.0
"""How much faster than over the neighbouring steps a product of multipliers may fall in a step."""
_STEPS_A_DIP = 60
"""Steps of a path for each two that are looked into, so that the others bear the work."""
_INSIDE = 0.05, 0.95
"""Shares of a step between which the bottom of a dip is looked for at first."""
_MAX_IN_DIP = 8
"""Most solutions towards the bottom of a dip."""
_MAX_DEPTH = 4
_MAX_HALVINGS = 8
_PRECISION = 1e-11
"""Share of a part of the path to which a zero is located, or a jump."""
_EXPLAINED = {EventKind.FOLD, EventKind.BRANCH}


class Known(NamedTuple):
    """A solution of a path with its tangents on both sides.

    ``rate`` and ``doubling`` are as of `Growth`; ``kinds`` are those of the events there.
    """

    before: PathState
    after: PathState
    rate: float
    doubling: float
    kinds: frozenset[str]


class Change(NamedTuple):
    """A change of stability after point ``number``, at ``state``, or at that point without one."""

    number: int
    kind: EventKind
    state: PathState | None = None


def stability_changes(
    corrector: Corrector, points: Sequence[Known | None]
) -> tuple[list[Change], int]:
    """The changes along the points of one path, in their order, and how many were not located.

    A point that is None interrupts it.
    """
    changes: list[Change] = []
    close = _CLOSE * max((abs(point.rate) for point in points if point is not None), default=0.0)
    lost, before, dips = 0, -1, _dips(corrector, points)
    tell = watching().counting("steps searched for changes of stability", len(points) - 1)
    for number, (left, right) in enumerate(pairwise(points)):
        tell()
        if left is None or right is None:
            before = -1
            continue
        along = _Along(corrector, left, right, close, dips.get(number))
        try:
            samples = along.samples()
            if {before, samples[0].verdict} == {0, 1} and not left.kinds & _EXPLAINED:
                changes.append(Change(number, along.kind(left.after)))
            told = [sample for sample in samples if sample.verdict >= 0]
            for low, high in pairwise(told):
                if low.verdict != high.verdict:
                    changes.append(Change(number, *along.change(low.share, high.share)))
            before = samples[-1].verdict
        except ArithmeticError:
            lost += left.rate * right.rate < 0
            before = -1
    return changes, lost


def _dips(corrector: Corrector, points: Sequence[Known | None]) -> dict[int, float]:
    """Steps within which two multipliers may pass -1 and return, the likeliest, and about where.

    Beside such a bubble the growth rate may be constant, of pairs of multipliers that turn on a
    circle. Their product falls towards zero before such a step and rises after it.
    """
    value = np.array([np.nan if point is None else point.doubling for point in points])
    length = np.array(
        [
            np.nan if left is None or right is None else _distance(corrector, left, right)
            for left, right in pairwise(points)
        ]
    )
    heading = np.sign(value[:-1])
    left, right = heading * value[:-1], heading * value[1:]
    slope = np.concatenate([[np.nan], np.diff(value) / length, [np.nan]])
    fall = -_STEEPER * heading * length * slope[:-2]
    rise = _STEEPER * heading * length * slope[2:]
    # Where no neighbour tells, it may be anything.
    fall = np.where(np.isnan(fall), _STEEPER * left, fall)
    rise = np.where(np.isnan(rise), _STEEPER * right, rise)
    turns = (fall > 0) & (rise > 0) & (right > 0)
    # Both lines meet at the bottom.
    both = np.where(turns, fall + rise, 1.0)
    share = np.clip((left - right + rise) / both, *_INSIDE)
    found = np.flatnonzero(turns & (left * rise + right * fall < fall * rise))
    deepest = found[np.argsort(np.minimum(left, right)[found], kind="stable")]
    return {int(i): float(share[i]) for i in deepest[: 2 + 2 * (len(points) // _STEPS_A_DIP)]}


def _distance(corrector: Corrector, left: Known, right: Known) -> float:
    start, end = left.after.state, right.before.state
    return float(np.linalg.norm((end - start) / corrector.curve.scale(start))) or np.nan


def held_between(corrector: Corrector, left: PathState, right: PathState) -> Segment:
    """The path between two points of it, its contacts as they are half-way."""
    segment = Segment(corrector, left, right, np.zeros(0, dtype=bool))
    [middle], _ = segment.interpolate(np.array([0.5]))
    segment.switches = corrector.curve.evaluate(middle[:-1], middle[-1]).states.switches
    return segment


class _Sample(NamedTuple):
    """What becomes of perturbations at a share of a segment, as of `Growth`, and what it says."""

    share: float
    rate: float
    doubling: float
    verdict: int


class _Along:
    """Stability of the solutions between two neighbouring points of a path.

    Rates below ``close`` are looked at in between, too, and multipliers that may reach -1 near a
    share ``bottom``.
    """

    def __init__(
        self, corrector: Corrector, left: Known, right: Known, close: float, bottom: float | None
    ):
        self._curve = corrector.curve
        self._ends = left, right
        self._corrector, self._close, self._bottom = corrector, close, bottom

    @cached_property
    def _segment(self) -> Segment:
        """The path between both points, its contacts as they are half-way."""
        return held_between(self._corrector, self._ends[0].after, self._ends[1].before)

    def samples(self) -> list[_Sample]:
        """Growth rates from the left end to the right one; beside ends with events."""
        found = refined([self._at_end(0), self._at_end(1)], self._middle, _MAX_DEPTH)
        if self._bottom is not None and len({sample.verdict for sample in found}) == 1:
            return self._in_dip(found[0], found[-1], self._bottom)
        return found

    def _at_end(self, end: int) -> _Sample:
        point = self._ends[end]
        _, frequency = self._curve.at(float(point.after.state[-1]))
        told = verdict(point.rate, frequency)
        if not point.kinds and told >= 0:
            return _Sample(float(end), point.rate, point.doubling, told)
        return self._sample(abs(end - _BESIDE))

    def _sample(self, share: float) -> _Sample:
        found, frequency = self._growth(self._segment.at(share))
        return _Sample(share, found.rate, found.doubling, verdict(found.rate, frequency))

    def _middle(self, low: _Sample, high: _Sample) -> _Sample | None:
        """A sample between two others where the rate may pass zero twice."""
        if min(abs(low.rate), abs(high.rate)) >= self._close:
            return None
        try:
            middle = self._sample((low.share + high.share) / 2)
        except ArithmeticError:
            return None
        bend = abs(middle.rate - (low.rate + high.rate) / 2)
        same = low.verdict == middle.verdict == high.verdict
        return None if same and bend < _STRAIGHT * abs(middle.rate) else middle

    def _in_dip(self, low: _Sample, high: _Sample, share: float) -> list[_Sample]:
        """Two samples and those towards the smallest product of multipliers in between.

        It is expected at ``share``, then where a parabola has it, unless it stays far from zero.
        """
        known, heading = [low, high], np.sign(low.doubling)
        for _ in range(_MAX_IN_DIP):
            try:
                known = sorted([*known, self._sample(share)])
            except ArithmeticError:
                break
            values = heading * np.array([sample.doubling for sample in known])
            if len({sample.verdict for sample in known}) > 1 or not values.min() > 0:
                break
            first = min(max(int(np.argmin(values)) - 1, 0), len(known) - 3)
            places = np.array([sample.share for sample in known])
            bend, slope, start = np.polyfit(places[first : first + 3], values[first : first + 3], 2)
            if not (bend > 0 and start - slope**2 / (4 * bend) < values.min() / 2):
                break
            share = float(-slope / (2 * bend))
            if not low.share < share < high.share:
                break
        return known

    def change(self, low: float, high: float) -> tuple[EventKind, PathState]:
        """What happens where the growth rate passes zero, and the solution there."""
        state = self._crossing(self._segment.at(low), self._segment.at(high), 0)
        return self.kind(state), state

    def _crossing(self, left: PathState, right: PathState, depth: int) -> PathState:
        """The solution where the rate passes zero; halves a part that a cubic does not follow."""
        part = held_between(self._corrector, left, right)
        try:
            share = bracketed_root(
                lambda share: self._growth(part.at(share))[0].rate, precision=_PRECISION
            )
            return part.at(share)
        except ArithmeticError:
            if depth == _MAX_HALVINGS:
                raise
        middle = part.solve_between(0.5)
        if middle is None:
            raise ArithmeticError("the path between two points cannot be solved for")
        grows, grew = (self._growth(state)[0].rate > 0 for state in (middle, left))
        halves = (left, middle) if grows != grew else (middle, right)
        return self._crossing(*halves, depth + 1)

    def kind(self, state: PathState) -> EventKind:
        """What happens at a solution where the stability changes."""
        found, frequency = self._growth(state)
        exponent = found.exponent
        if not abs(exponent.real) <= _CONTINUOUS * frequency:
            return EventKind.STABILITY
        problem, _ = self._curve.at(float(state.state[-1]))
        multiplier = multiplier_at(problem, frequency, state.state[:-1], exponent)
        if abs(multiplier.imag) > _REAL * abs(multiplier):
            return EventKind.TORUS
        if multiplier.real < 0:
            return EventKind.DOUBLING
        # In odd harmonics, a change by even ones oscillates once more or less in the period.
        odd = all(n % 2 for n in problem.harmonics)
        half = odd and abs(abs(exponent.imag) / frequency - 1) < _HALF
        return EventKind.SYMMETRY if half else EventKind.STABILITY

    def _growth(self, state: PathState) -> tuple[Growth, float]:
        """What becomes of perturbations, and the frequency."""
        unknowns = state.state[:-1]
        problem, frequency = self._curve.at(float(state.state[-1]))
        evaluation = problem.evaluate(unknowns, frequency)
        return growth(problem, frequency, evaluation, unknowns), frequency
