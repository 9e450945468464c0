"""What one contact does over a period, as it is drawn."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.numerics import FloatArray


class Behaviour(IntEnum):
    """What a contact does within a period: values of ``contact_state``."""

    STICKS, SLIPS, OPENS, NEVER_TOUCHES = range(4)


class History(NamedTuple):
    """One contact over a period, closed: the last point is the first of the next period.

    ``angle`` (n,) [rad]; ``displacement`` (m, n) [m] and ``force`` (m, n) [N] in the directions of
    its law, the normal force whole; ``limit`` (n,) [N], the largest friction force that the normal
    force allows; ``state`` (n,), what it does from each point on. Events are among the points.
    """

    angle: FloatArray
    displacement: FloatArray
    force: FloatArray
    limit: FloatArray
    state: NDArray[np.intp]

    def changes(self, before: tuple[int, ...], after: tuple[int, ...]) -> NDArray[np.intp]:
        """The points at which it goes from one of some states to one of others."""
        came = np.isin(np.roll(self.state[:-1], 1), before)
        return np.flatnonzero(came & np.isin(self.state[:-1], after))


def angles_from(first: float, events: FloatArray, n_angles: int) -> FloatArray:
    """Angles of a period from ``first`` on, its end and the events among them."""
    period = 2 * np.pi
    grid = first + period * np.arange(n_angles + 1) / n_angles
    return np.unique(np.concatenate([grid, first + (events - first) % period]))
