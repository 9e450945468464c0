"""Segments between the points of a path, divided until it is known what lies within them.

A doubt looks at segments, a batch at a time, and asks for solutions within some of them. Both parts
of these are looked at again, until none is left or a segment was divided as often as it may be.

Errors of cubics within segments are estimated: the cubic through the two points before a segment,
or the two after it, predicts the slope at the far end of the segment. The difference from the
actual slope measures the fourth derivative.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors import Corrector
from symhbm.continuation.point import UNBOUNDED_AMPLIFICATION, PathPoint
from symhbm.continuation.problem import ContinuationProblem
from symhbm.continuation.segment import Measure, PathState, Segment, ahead, measure
from symhbm.numerics import FloatArray, watching
from symhbm.numerics.loops import Loop, interpolation


class Segments(NamedTuple):
    """Segments of a path without an event in between, arrays along the first axis.

    ``number`` (n,) is the index of the path point before each; ``begin`` and ``width`` (n,) are
    shares of the distance from that point to the next. ``left`` and ``right`` are the solutions at
    both ends; ``before`` and ``after`` those next to them, NaN where there are none or an event
    lies between. ``scale`` is (n, n_unknowns + 1), ``slip_events`` (n, 2) tells at which end slip
    begins or ends, ``folds`` (n, 2) which are smooth folds, ``switches`` (n, n_contacts) holds the
    contact states.
    """

    number: NDArray[np.intp]
    begin: FloatArray
    width: FloatArray
    left: PathState
    right: PathState
    before: PathState
    after: PathState
    scale: FloatArray
    switch_events: NDArray[np.bool_]
    folds: NDArray[np.bool_]
    switches: NDArray[np.bool_]

    @classmethod
    def of(cls, points: Sequence[PathPoint]) -> Self:
        """The segments between consecutive points, without those of unbounded amplification."""
        columns: Any = PathPoint._make(zip(*points, strict=True))
        state = np.array(columns.state)
        before, after = (PathState(state, np.array(way)) for way in (columns.before, columns.after))
        turns = [{event.turns_on for event in events} for events in columns.events]
        smooth = ~np.array([bool(turn) for turn in turns])
        onset, end = (np.array([on in turn for turn in turns]) for on in (True, False))
        folds = np.array([point.is_smooth_fold for point in points])
        unbounded = np.array(columns.amplification) > UNBOUNDED_AMPLIFICATION
        count = len(points) - 1
        segments = cls(
            number=np.arange(count),
            begin=np.zeros(count),
            width=np.ones(count),
            left=after[:-1],
            right=before[1:],
            before=_neighbours(after, smooth[:-1], np.arange(-1, count - 1)),
            after=_neighbours(before, smooth[1:], np.arange(2, count + 2)),
            scale=np.array(columns.scale[:-1]),
            switch_events=np.stack([onset[:-1], end[1:]], axis=-1),
            folds=np.stack([folds[:-1], folds[1:]], axis=-1),
            switches=np.array(columns.switches[:-1]),
        )
        return segments.take(~(unbounded[:-1] | unbounded[1:]))

    def take(self, index: Any) -> Self:
        """A selection of the segments."""
        columns: Any = (values[index] for values in self)
        return type(self)(*columns)

    def batches(self, size: int) -> list[Self]:
        """The segments in batches of at most ``size``, one where there are no more."""
        count = len(self.number)
        if count <= size:
            return [self]
        return [self.take(slice(i, i + size)) for i in range(0, count, size)]

    def segment(self, index: int, corrector: Corrector, measured: Measure) -> Segment:
        """One segment, with a corrector."""
        own = Measure(*(values[index] for values in measured))
        given = self.switches[index], self.scale[index], own
        return Segment(corrector, self.left[index], self.right[index], *given)

    def divided(self, curve: ContinuationProblem, share: FloatArray, middle: PathState) -> Self:
        """Both parts of each segment, divided at solutions ``middle`` at a ``share`` (n,) of it."""
        ends, folds = self.switch_events, self.folds
        first = self._replace(
            width=self.width * share,
            right=middle,
            after=self.right,
            switch_events=ends & [True, False],
            folds=folds & [True, False],
        )
        second = self._replace(
            begin=self.begin + self.width * share,
            width=self.width * (1 - share),
            left=middle,
            before=self.left,
            scale=np.array([curve.scale(state) for state in middle.state]),
            switch_events=ends & [False, True],
            folds=folds & [False, True],
        )
        return self.joined([first, second])

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """The segments of several collections in one."""
        if len(parts) == 1:
            return parts[0]
        columns: Any = []
        for column in zip(*parts, strict=True):
            is_path_state: Any = isinstance(column[0], PathState)
            columns.append(column[0].joined(column) if is_path_state else np.concatenate(column))
        return cls(*columns)


def _neighbours(
    path_states: PathState, valid: NDArray[np.bool_], index: NDArray[np.intp]
) -> PathState:
    """The path states at an index (n,), NaN where not ``valid`` or out of range."""
    size = len(path_states.state)
    valid = (valid & (index >= 0) & (index < size))[:, None]
    values = (
        array[np.clip(index, 0, size - 1)] for array in (path_states.state, path_states.direction)
    )
    return PathState(*(np.where(valid, array, np.nan) for array in values))


_BATCH_SIZE = 2**20
"""Numbers evaluated at once, which bounds the memory of large structures."""


class Batch:
    """Segments that are looked at together, with their measures, and the solutions within them.

    ``is_last`` tells that they are not divided any more.
    """

    def __init__(self, segments: Segments, doubt: "Doubt", is_last: bool):
        self.segments, self.is_last, self._doubt = segments, is_last, doubt
        ends = segments.left, segments.right
        self.measured = measure(doubt.corrector.curve.single_valued, *ends, segments.scale)
        self.middles: dict[int, tuple[float, PathState]] = {}

    def segment(self, k: int) -> Segment:
        """The segment of a number in this batch."""
        return self.segments.segment(k, self._doubt.corrector, self.measured)

    def divide(self, k: int, share: float) -> bool:
        """Whether the segment of a number in this batch is divided, at a share of its length.

        It is not where a contact is in another state there, which the doubt keeps.
        """
        segment, doubt = self.segment(k), self._doubt
        can_be = segment.length > 0 and not self.is_last
        middle = doubt.solution(segment, share) if can_be else None
        doubt.tell()
        if middle is not None and segment.other_states and not doubt.ignore_states:
            doubt.other_states[int(self.segments.number[k])] = float(middle.state[-1])
            return False
        if middle is not None:
            self.middles[k] = share, middle
        return middle is not None


class Doubt(ABC):
    """What a path may have passed over between its points.

    ``other_states`` holds a parameter value where a contact is in another state than at both ends,
    by the index of the point before, unless ``ignore_states`` is set. ``numbers`` is how many
    numbers it evaluates for one segment, ``depth`` how often that is divided at most.
    """

    numbers: int
    depth = 12

    def __init__(self, corrector: Corrector, ignore_states: bool = False):
        self.corrector, self.ignore_states = corrector, ignore_states
        self.tell = watching().counting("places between points solved for")
        self.other_states: dict[int, float] = {}

    @abstractmethod
    def look_at(self, batch: Batch) -> None:
        """Divide the segments that are in doubt, and keep what is found in others."""

    def solution(self, segment: Segment, share: float) -> PathState | None:
        """A solution strictly between both ends, at or near a share of the length."""
        return segment.solve_between(share)

    def settled(self, segments: Segments) -> Segments:
        """The segments, divided until none is in doubt."""
        whole = [
            some.take(np.delete(np.arange(len(some.number)), divided)) if divided else some
            for some, divided in self.settle(segments)
        ]
        return Segments.joined(whole)

    def settle(self, segments: Segments) -> list[tuple[Segments, list[int]]]:
        """Divide segments until none is in doubt: all batches, and which of each were divided."""
        whole: list[tuple[Segments, list[int]]] = []
        for depth in range(self.depth + 1):
            parts = []
            for some in segments.batches(max(_BATCH_SIZE // self.numbers, 1)):
                batch = Batch(some, self, depth == self.depth)
                if len(some.number):
                    self.look_at(batch)
                whole.append((some, divided := [*batch.middles]))
                if divided:
                    shares, middles = zip(*batch.middles.values(), strict=True)
                    given = np.array(shares), PathState.stacked(middles)
                    parts.append(some.take(divided).divided(self.corrector.curve, *given))
            if not parts:
                break
            segments = Segments.joined(parts)
        return whole


_SAFETY_FACTOR = 8.0
"""Ratio by which the fourth derivative may exceed its estimate."""
_SLOPE_ERROR, _VALUE_ERROR = 0.0962, 1 / 32
"""Largest errors of slope and value of a cubic with a constant fourth derivative, over the result
of `errors_within`."""
OF_SLOPE, OF_VALUE = _SAFETY_FACTOR * _SLOPE_ERROR, _SAFETY_FACTOR * _VALUE_ERROR
"""Error bounds of interpolated slopes per unit of length, and of values over the length, both over
the result of `errors_within`."""
_LONE_SHARE = 0.5
"""Share of the third derivative's contribution taken as slope error where there is no neighbour."""
_MIN_ALIGNMENT = 0.3
"""Smallest cosine between the tangent of a neighbour and a segment for which its cubic is used."""


@Loop
def _distance(first, second, direction, normal, scale) -> float:
    """Distance of two solutions along a normal, NaN where a tangent leads elsewhere."""
    distance, along, size = 0.0, 0.0, 0.0
    for k in range(len(normal)):
        tangent = direction[k] / scale[k]
        distance += normal[k] * (second[k] - first[k]) / scale[k]
        along += normal[k] * tangent
        size += tangent * tangent
    valid = along > _MIN_ALIGNMENT * math.sqrt(size) and distance > 0
    return distance if valid else math.nan


@Loop
def _one_sided(
    distance: float,
    length: float,
    neighbour: tuple[float, float],
    near: tuple[float, float],
    far_slope: float,
) -> float:
    """Scaled error of the slope at the far end, extrapolated from the near end and its neighbour.

    Those are values and slopes. NaN where there is no suitable neighbour.
    """
    slopes = distance * neighbour[1], distance * near[1]
    expected = (
        interpolation.cubic_slope_at(neighbour[0], near[0], slopes, 1 + length / distance)
        / distance
    )
    reach = length * length / ((length + distance) * (2 * length + distance))
    return abs(reach * (far_slope - expected))


def errors_within(
    segments: Segments, measured: Measure, quantities: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Extrapolation errors (n, m) of ``quantities`` (.., m), linear in solutions (.., size).

    The larger one of both sides, scaled to the length of the segment.
    """
    around = segments.before, segments.left, segments.right, segments.after
    solutions = np.array([*(at.state for at in around), *(at.direction for at in around)])
    found = quantities(solutions.reshape(-1, solutions.shape[-1]))
    found = np.ascontiguousarray(found).reshape(*solutions.shape[:2], -1)
    error = np.empty(found.shape[1:])
    write_errors(solutions, found, measured.normal, measured.length, segments.scale, error)
    return error


@Loop
def write_errors(solutions, quantities, normal, length, scale, error) -> None:
    """Write the `errors_within` (n, m) of segments.

    ``solutions`` (8, n, n_unknowns + 1) are the one before a segment, those at its ends and the one
    after it, then their tangents, NaN where there are none; so are the ``quantities`` (8, n, m)
    with their derivatives along the tangents. ``normal`` and ``scale`` are (n, n_unknowns + 1),
    ``length`` (n, 1).
    """
    along = np.empty(4)
    for i in range(len(error)):
        across, unit = normal[i], scale[i]
        for k in range(4):
            along[k] = ahead(solutions[4 + k, i], across, unit)
        left, right = solutions[1, i], solutions[2, i]
        to_before = _distance(solutions[0, i], left, solutions[4, i], across, unit)
        to_after = _distance(right, solutions[3, i], solutions[7, i], across, unit)
        width = length[i, 0] if length[i, 0] != 0 else 1.0
        for k in range(error.shape[1]):
            value, rate = quantities[:4, i, k], quantities[4:, i, k]
            first, last = rate[1] / along[1], rate[2] / along[2]
            before, after = rate[0] / along[0], -rate[3] / along[3]
            error[i, k] = _larger(
                _one_sided(to_before, width, (value[0], before), (value[1], first), last),
                _one_sided(to_after, width, (value[3], after), (value[2], -last), -first),
                1.5 * ((value[2] - value[1]) / width - (first + last) / 2),
            )


@Loop
def _larger(forward: float, backward: float, alone: float) -> float:
    """The larger one of both errors that are numbers, or that of a segment without neighbours."""
    if math.isnan(forward) and math.isnan(backward):
        return _LONE_SHARE / OF_SLOPE * abs(alone)
    if math.isnan(forward) or math.isnan(backward):
        return backward if math.isnan(forward) else forward
    return max(forward, backward)
