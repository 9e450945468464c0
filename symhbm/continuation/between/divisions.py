"""Stretches between the points of a path, many at once, and their division."""

from collections.abc import Sequence
from typing import Any, Generic, NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors import Corrector
from symhbm.continuation.point import UNBOUNDED_AMPLIFICATION, EventKind, PathPoint
from symhbm.continuation.segment import Measure, PathState, Segment
from symhbm.numerics import FloatArray

At = TypeVar("At", bound=PathState)


class Segments(NamedTuple, Generic[At]):
    """Stretches of a path without an event in between, arrays along the first axis.

    ``number`` (n,) of the point of the path before each, and its ``begin`` and ``width`` (n,) as
    shares of the way from that point to the next; the solutions at both ends, and those next to
    them, NaN where there are none or an event stands between; the ``scale`` (n, n_unknowns + 1);
    ``roots`` (n, 2), at which end slip begins or ends; the contact states ``slip`` (n, n_contacts).
    """

    number: NDArray[np.intp]
    begin: FloatArray
    width: FloatArray
    left: At
    right: At
    before: PathState
    after: PathState
    scale: FloatArray
    roots: NDArray[np.bool_]
    slip: NDArray[np.bool_]

    @classmethod
    def of(cls, points: Sequence[PathPoint], before: At, after: At) -> Self:
        """From each point of a path to the next, but where the response drowns its balance.

        ``before`` and ``after`` are the points with their tangents on either side.
        """
        smooth = ~np.array([bool(point.events) for point in points])
        onset, end = (
            np.array([any(event.kind == kind for event in p.events) for p in points])
            for kind in (EventKind.ONSET, EventKind.END)
        )
        drowned = np.array([p.amplification > UNBOUNDED_AMPLIFICATION for p in points])
        count = len(points) - 1
        every = cls(
            number=np.arange(count),
            begin=np.zeros(count),
            width=np.ones(count),
            left=after[:-1],
            right=before[1:],
            before=_beside(after, smooth[:-1], np.arange(-1, count - 1)),
            after=_beside(before, smooth[1:], np.arange(2, count + 2)),
            scale=np.array([point.scale for point in points[:-1]]),
            roots=np.stack([onset[:-1], end[1:]], axis=-1),
            slip=np.array([point.slip for point in points[:-1]]),
        )
        return every.take(~(drowned[:-1] | drowned[1:]))

    def take(self, index: Any) -> Self:
        """Some of them."""
        columns: Any = (values[index] for values in self)
        return type(self)(*columns)

    def parts(self, most: int) -> list[Self]:
        """The same in parts of so many at most."""
        return [self.take(slice(i, i + most)) for i in range(0, len(self.number), most)]

    def path(self, corrector: Corrector, measured: Measure) -> Segment:
        """The path along one of them."""
        return Segment(corrector, self.left, self.right, self.slip, self.scale, measured)

    def divided(self, share: FloatArray, middle: At, scale: FloatArray) -> Self:
        """The parts before and after solutions at a ``share`` (n,) of the way."""
        inner = np.zeros(len(share), dtype=bool)
        first = self._replace(
            width=self.width * share,
            right=middle,
            after=self.right.bare(),
            roots=np.stack([self.roots[:, 0], inner], axis=-1),
        )
        second = self._replace(
            begin=self.begin + self.width * share,
            width=self.width * (1 - share),
            left=middle,
            before=self.left.bare(),
            scale=scale,
            roots=np.stack([inner, self.roots[:, 1]], axis=-1),
        )
        return self.joined([first, second])

    @classmethod
    def joined(cls, several: Sequence[Self]) -> Self:
        """Several in one."""
        columns: Any = []
        for column in zip(*several, strict=True):
            is_station: Any = isinstance(column[0], PathState)
            columns.append(column[0].joined(column) if is_station else np.concatenate(column))
        return cls(*columns)


def _beside(station: PathState, tells: NDArray[np.bool_], at: NDArray[np.intp]) -> PathState:
    """The stations at some places, NaN where they tell nothing or there are none."""
    size = len(station.state)
    tells = (tells & (at >= 0) & (at < size))[:, None]
    values = (array[np.clip(at, 0, size - 1)] for array in (station.state, station.direction))
    return PathState(*(np.where(tells, array, np.nan) for array in values))
