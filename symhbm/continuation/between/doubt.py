"""Division of the segments of a path until it is known what lies between its points.

A doubt looks at segments, a batch at a time, and asks for solutions within some of them. Both parts
of these are looked at again, until none is left or a segment was divided as often as it may be.
"""

from abc import ABC, abstractmethod

import numpy as np

from symhbm.continuation.between.segments import Segments
from symhbm.continuation.correctors import Corrector
from symhbm.continuation.segment import PathState, Segment, measure

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
        self.other_states: dict[int, float] = {}

    @abstractmethod
    def look_at(self, batch: Batch) -> None:
        """Divide the segments that are in doubt, and keep what is found in others."""

    def solution(self, segment: Segment, share: float) -> PathState | None:
        """A solution strictly between both ends, at or near a share of the length."""
        return segment.solve_between(share)

    def settled(self, segments: Segments) -> Segments:
        """The segments, divided until none is in doubt."""
        whole = [segments.take(slice(0))]
        for depth in range(self.depth + 1):
            parts = []
            for some in segments.batches(max(_BATCH_SIZE // self.numbers, 1)):
                batch = Batch(some, self, depth == self.depth)
                self.look_at(batch)
                divided = [*batch.middles]
                whole.append(some.take(np.delete(np.arange(len(some.number)), divided)))
                if divided:
                    shares, middles = zip(*batch.middles.values(), strict=True)
                    given = np.array(shares), PathState.stacked(middles)
                    parts.append(some.take(divided).divided(self.corrector.curve, *given))
            if not parts:
                break
            segments = Segments.joined(parts)
        return Segments.joined(whole)
