"""Points of a path, the events at them, and where the next one is expected: a cubic through two."""

import math
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.continuation.problem import ContinuationProblem, Corrected
from symhbm.numerics import FloatArray
from symhbm.numerics.loops import Loop

UNBOUNDED_AMPLIFICATION = 1e9
"""Inertia over exciting force beyond which round-off exceeds the difference of the two."""


class EventKind(StrEnum):
    """Kinds of event that are none of a contact."""

    FOLD = "fold"
    BRANCH = "branch point"
    CORNER = "corner"
    DAMPING_TURNS = "damping turns"
    PHASE = "phase resonance"
    DOUBLING = "period doubling"
    TORUS = "Neimark-Sacker"
    SYMMETRY = "symmetry breaking"
    STABILITY = "change of stability"


class Event(NamedTuple):
    """A switch of one ``contact`` that turns on or off, or another event of the path.

    ``kind`` is the name that the contact law gives it, or an `EventKind` (contact -1, ``turns_on``
    None).
    """

    kind: str
    contact: int = -1
    turns_on: bool | None = None


def switched(
    problem: HarmonicBalance, before: NDArray[np.bool_], after: NDArray[np.bool_]
) -> tuple[Event, ...]:
    """The events by which states ``before`` become those ``after``, both (n_switches,)."""
    events = []
    for number in np.flatnonzero(before != after).tolist():
        group, contact, place = problem.contacts.switch(number)
        names, turns_on = group.law.switches[place], bool(after[number])
        kind = names.begins if turns_on else names.ends
        events.append(Event(kind, int(group.contacts[contact]), turns_on))
    return tuple(events)


class PathPoint(NamedTuple):
    """A converged point of a path.

    ``state`` (n_unknowns + 1,), unknowns [m] and parameter, and ``scale``, the unit of lengths
    there; ``before`` and ``after`` (n_unknowns + 1,), its derivatives by the local arc length on
    either side, equal except at an event; ``switches`` (n_switches,), the contact states after the
    point; ``margins`` (n_switches,), the margins of the switches, and ``rate`` (n_switches,),
    their derivatives by arc length after the point; ``amplification``,
    ``resonances_below`` and ``springs`` as of `Corrected`; ``solves``, the linear solves spent
    since the point before.
    """

    state: FloatArray
    scale: FloatArray
    before: FloatArray
    after: FloatArray
    switches: NDArray[np.bool_]
    margins: FloatArray
    rate: FloatArray
    residual_norm: float
    amplification: float
    resonances_below: tuple[int, ...] | None
    solves: int
    events: tuple[Event, ...] = ()
    springs: FloatArray | None = None

    @classmethod
    def of(
        cls,
        curve: ContinuationProblem,
        solution: Corrected,
        scale: FloatArray,
        switches: NDArray[np.bool_],
        solves: int,
        events: tuple[Event, ...] = (),
        far_side: Corrected | None = None,
    ) -> "PathPoint":
        """The point at a solution whose direction is relative to a ``scale``.

        ``far_side`` is the solution with the tangent after an event where that differs.
        """
        far_side = far_side or solution
        scale_there = curve.scale(solution.point)
        before = after = np.empty(len(scale))
        length = _by_arc_length(far_side.direction, scale, scale_there, after)
        if far_side is not solution:
            before = np.empty(len(scale))
            _by_arc_length(solution.direction, scale, scale_there, before)
        return cls(
            state=solution.point,
            scale=scale_there,
            before=before,
            after=after,
            switches=switches,
            margins=solution.margins,
            rate=far_side.rate / length,
            residual_norm=solution.residual_norm,
            amplification=solution.amplification,
            resonances_below=far_side.resonances_below,
            solves=solves,
            events=events,
            springs=far_side.springs,
        )

    @property
    def is_smooth_fold(self) -> bool:
        """Whether the point is a fold that is no corner: its tangent is normal to the parameter."""
        is_fold = EventKind.FOLD in [event.kind for event in self.events] or self.after[-1] == 0
        return bool(is_fold) and np.array_equal(self.before, self.after)

    @property
    def unknowns(self) -> FloatArray:
        """The coefficients, ``(n_unknowns,)`` [m]."""
        return self.state[:-1]

    @property
    def value(self) -> float:
        """The parameter."""
        return float(self.state[-1])


@Loop
def _by_arc_length(direction, scale, scale_there, result) -> float:
    """Write a derivative by the arc length at a point, from a direction in other units.

    Gives the length of that direction.
    """
    square = 0.0
    for i in range(len(direction)):
        result[i] = direction[i] * scale[i]
        scaled = result[i] / scale_there[i]
        square += scaled * scaled
    length = math.sqrt(square)
    for i in range(len(direction)):
        result[i] /= length
    return length


class Predictor(NamedTuple):
    """``second`` and ``third`` derivative of a path by arc length at a point, (n_unknowns + 1,)."""

    second: FloatArray
    third: FloatArray

    @classmethod
    def straight(cls, size: int) -> "Predictor":
        """The tangent alone, for the first point of a path and for corners."""
        return cls(np.zeros(size), np.zeros(size))

    @classmethod
    def through(cls, before: PathPoint, point: PathPoint) -> "Predictor":
        """The predictor at a ``point``, from that point and the one ``before`` it."""
        if point.events:
            return cls.straight(len(point.state))
        result = cls(*np.empty((2, len(point.state))))
        between = before.state, before.after, point.state, point.after
        _through(*between, point.scale, *result)
        return result

    def at(self, point: PathPoint, length: float) -> FloatArray:
        """Unknowns and parameter at an arc length beyond the point."""
        result = np.empty(len(point.state))
        _at(point.state, point.after, self.second, self.third, length, result)
        return result


@Loop
def _at(state, after, second, third, length: float, result) -> None:
    """Write the cubic at an arc length, from its value and derivatives."""
    for i in range(len(state)):
        curved = second[i] + length / 3 * third[i]
        result[i] = state[i] + length * (after[i] + length / 2 * curved)


@Loop
def _through(first, leaving, last, arriving, scale, second, third) -> None:
    """Write the ``second`` and ``third`` derivative at the ``last`` of two points.

    ``leaving`` and ``arriving`` are the tangents at the two points by their own arc lengths.
    """
    square_of_chord = square_of_tangent = square_of_turn = 0.0
    for i in range(len(scale)):
        chord, tangent = (last[i] - first[i]) / scale[i], leaving[i] / scale[i]
        square_of_chord += chord * chord
        square_of_tangent += tangent * tangent
    if square_of_chord == 0.0:
        second[:] = third[:] = 0.0
        return
    size = math.sqrt(square_of_tangent)
    for i in range(len(scale)):
        turn = (arriving[i] - leaving[i] / size) / scale[i]
        square_of_turn += turn * turn
    # The arc of a circle whose tangent turns as much.
    length = math.sqrt(square_of_chord) * (1 + square_of_turn / 24)
    for i in range(len(scale)):
        tangent = leaving[i] / size
        mismatch = arriving[i] + tangent - 2 * (last[i] - first[i]) / length
        second[i] = (arriving[i] - tangent + 3 * mismatch) / length
        third[i] = 6 * mismatch / (length * length)
