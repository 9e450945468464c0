"""Points of a path, and what happens at them."""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors import Corrected
from symhbm.continuation.problem import ContinuationProblem
from symhbm.numerics import FloatArray, length_of

UNBOUNDED_AMPLIFICATION = 1e9
"""Inertia over exciting force beyond which the balance of the two drowns in round-off."""


class EventKind(StrEnum):
    """What happens at an event."""

    ONSET = "onset of slip"
    END = "end of slip"
    FOLD = "fold"
    BRANCH = "branch point"


@dataclass(frozen=True)
class Event:
    """Change of state of one ``contact``; a fold or a branch point of the path (contact -1)."""

    kind: EventKind
    contact: int = -1


def state_changes(before: NDArray[np.bool_], after: NDArray[np.bool_]) -> tuple[Event, ...]:
    """The changes between two sets of contact states (n_contacts,)."""
    return tuple(
        Event(EventKind.ONSET if after[j] else EventKind.END, int(j))
        for j in np.flatnonzero(before != after)
    )


class PathPoint(NamedTuple):
    """A converged point of a path.

    ``state`` (n_unknowns + 1,), unknowns [m] and parameter, and ``scale``, what measures lengths
    there; ``before`` and ``after`` (n_unknowns + 1,), its derivatives by the local arc length on
    either side, equal except at an event; ``slip`` (n_contacts,), the contact states after the
    point; ``slip_margin`` (n_contacts,), the logarithm of the motion over its limit, and ``rate``
    (n_contacts,), its derivative by arc length after the point; ``amplification`` and
    ``resonances_below`` as of `Corrected`; ``solves``, the linear solves spent since the point
    before.
    """

    state: FloatArray
    scale: FloatArray
    before: FloatArray
    after: FloatArray
    slip: NDArray[np.bool_]
    slip_margin: FloatArray
    rate: FloatArray
    residual_norm: float
    amplification: float
    resonances_below: tuple[int, ...] | None
    solves: int
    events: tuple[Event, ...] = ()

    @classmethod
    def of(
        cls,
        curve: ContinuationProblem,
        found: Corrected,
        scale: FloatArray,
        slip: NDArray[np.bool_],
        solves: int,
        events: tuple[Event, ...] = (),
        beyond: Corrected | None = None,
    ) -> "PathPoint":
        """A point from a solution in a ``scale``.

        ``beyond`` is that with the tangent after it where that is another.
        """
        beyond = beyond or found
        here = curve.scale(found.point)
        ratio = scale / here
        length = length_of(beyond.direction * ratio)
        after = beyond.direction * scale / length
        before = after
        if beyond is not found:
            before = found.direction * scale / length_of(found.direction * ratio)
        return cls(
            state=found.point,
            scale=here,
            before=before,
            after=after,
            slip=slip,
            slip_margin=found.slip_margin,
            rate=beyond.rate / length,
            residual_norm=found.residual_norm,
            amplification=found.amplification,
            resonances_below=beyond.resonances_below,
            solves=solves,
            events=events,
        )

    @property
    def unknowns(self) -> FloatArray:
        """The coefficients, ``(n_unknowns,)`` [m]."""
        return self.state[:-1]

    @property
    def value(self) -> float:
        """The parameter."""
        return float(self.state[-1])
