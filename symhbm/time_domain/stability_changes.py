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
import scipy

from symhbm.continuation import Corrector, EventKind, PathState, Segment
from symhbm.time_domain.stability import leading_exponent, multiplier_at, verdict

_BESIDE = 1e-2
"""Share of a segment at which stability beside an event is told."""
_CONTINUOUS = 1e-6
"""Growth over the frequency up to which a multiplier passes the circle, and does not jump over."""
_REAL = 1e-9
"""Imaginary part of a multiplier that is round-off."""
_HALF = 0.25
"""Distance of an imaginary part from a multiple of the frequency, over it, that truncation makes.
"""
_EXPLAINED = {EventKind.FOLD, EventKind.BRANCH}


class Known(NamedTuple):
    """A solution of a path with its tangents on both sides.

    ``stability`` is 1, 0 or -1 as in datasets; ``kinds`` are those of the events there.
    """

    before: PathState
    after: PathState
    stability: int
    kinds: frozenset[str]

    @property
    def special(self) -> bool:
        """Whether its own stability does not tell of that beside it."""
        return bool(self.kinds) or self.stability < 0


class Change(NamedTuple):
    """A change of stability after point ``number``, at ``state``, or at that point without one."""

    number: int
    kind: EventKind
    state: PathState | None = None


def stability_changes(
    corrector: Corrector, points: Sequence[Known | None]
) -> tuple[list[Change], int]:
    """The changes along the points of one path, in their order, and how many were not located.

    A point that is None, and a stability that is not known, interrupt it.
    """
    changes: list[Change] = []
    lost, before = 0, -1
    for number, (left, right) in enumerate(pairwise(points)):
        if left is None or right is None:
            before = -1
            continue
        along = _Along(corrector, left, right)
        try:
            begin, end = along.verdict_at(0), along.verdict_at(1)
            if {before, begin} == {0, 1} and not left.kinds & _EXPLAINED:
                changes.append(Change(number, along.kind(left.after)))
            if {begin, end} == {0, 1}:
                changes.append(Change(number, *along.change()))
        except ArithmeticError:
            lost += {left.stability, right.stability} == {0, 1}
            end = -1
        before = end
    return changes, lost


class _Along:
    """Stability of the solutions between two neighbouring points of a path."""

    def __init__(self, corrector: Corrector, left: Known, right: Known):
        self._curve = corrector.curve
        self._ends = left, right
        self._corrector = corrector

    @cached_property
    def _segment(self) -> Segment:
        """The path between both points, its contacts as they are half-way."""
        ends, held = (self._ends[0].after, self._ends[1].before), np.zeros(0, dtype=bool)
        segment = Segment(self._corrector, *ends, held)
        [middle], _ = segment.interpolate(np.array([0.5]))
        segment.switches = self._curve.evaluate(middle[:-1], middle[-1]).states.switches
        return segment

    def verdict_at(self, end: int) -> int:
        """Stability at the left end, 0, or the right one, 1; beside it where the end is special."""
        if not self._ends[end].special:
            return self._ends[end].stability
        exponent, frequency = self._exponent(self._solved(self._share(end)))
        return verdict(exponent.real, frequency)

    def change(self) -> tuple[EventKind, PathState]:
        """What happens where the growth rate passes zero, and the solution there."""

        def rate(share: float) -> float:
            return self._exponent(self._solved(share))[0].real

        ends = self._share(0), self._share(1)
        share = float(scipy.optimize.brentq(rate, *ends, xtol=1e-14, rtol=1e-14))  # type: ignore
        state = self._solved(share)
        return self.kind(state), state

    def kind(self, state: PathState) -> EventKind:
        """What happens at a solution where the stability changes."""
        exponent, frequency = self._exponent(state)
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

    def _share(self, end: int) -> float:
        """Share of the segment at which stability at an end is told."""
        return abs(end - _BESIDE) if self._ends[end].special else float(end)

    def _solved(self, share: float) -> PathState:
        if share in (0.0, 1.0):
            return self._ends[1].before if share else self._ends[0].after
        solution = self._segment.solve(share)
        if solution is None:
            raise ArithmeticError("the path between two points cannot be solved for")
        return solution

    def _exponent(self, state: PathState) -> tuple[complex, float]:
        """The leading exponent and the frequency."""
        unknowns = state.state[:-1]
        problem, frequency = self._curve.at(float(state.state[-1]))
        evaluation = problem.evaluate(unknowns, frequency)
        return leading_exponent(problem, frequency, evaluation, unknowns), frequency
