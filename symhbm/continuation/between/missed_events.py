"""Contact events that a continuation step passed over.

A contact may begin and end to slip, or to open, between two points of a path. Its relative motion
is interpolated there; where it comes as close to a limit as the interpolation error, the path is
solved for in between.
"""

import math
from typing import NamedTuple

import numpy as np

from symhbm.balance import BalancedContacts, HarmonicBalance
from symhbm.continuation.between.segments import OF_VALUE, Batch, Doubt, Segments, errors_within
from symhbm.continuation.correctors import BEYOND, Corrector
from symhbm.continuation.point import PathPoint
from symhbm.continuation.problem import ContinuationProblem
from symhbm.continuation.segment import Measure
from symhbm.numerics import FloatArray
from symhbm.numerics.loops import Loop, interpolation

_SHARES = np.arange(1, 16) / 16
_ERROR_PROFILE = (4 * _SHARES * (1 - _SHARES)) ** 2
"""Error of a cubic along a segment over its maximum."""
_SAMPLES = 16
"""Angles per period of the highest harmonic at which relative motions are evaluated."""


class MissedEvents(Doubt):
    """Contact events between the points of a path that its steps passed over.

    A margin that stays at its limit is in doubt in all parts of a segment, however short.
    """

    depth = 6

    def __init__(self, points: list[PathPoint], corrector: Corrector):
        super().__init__(corrector)
        basis, n_switches = corrector.curve.problem.basis, len(points[0].margins)
        samples = _SAMPLES * (basis.highest if basis.n_components > 2 else 1)
        self.numbers = max(len(_SHARES) * n_switches * samples, 1)
        self._estimates = _Estimates.of(corrector.curve, points) if n_switches else None

    def look_at(self, batch: Batch) -> None:
        """Divide segments at which a contact may pass its limit."""
        if self._estimates is None:
            return
        given = batch.segments, batch.measured, self._estimates
        shares = _doubtful_shares(self.corrector.curve.problem, *given)
        for k in np.flatnonzero(shares).tolist():
            if int(batch.segments.number[k]) not in self.other_states:
                batch.divide(k, float(shares[k]))


class _Estimates(NamedTuple):
    """Estimates of margins after each path point but the last, at the values of that point.

    ``frequency`` (n,) and ``contacts`` (n,) are those of the points; ``first`` and ``last``
    (n, n_switches), what estimates are off at the point and at the next one.
    """

    frequency: FloatArray
    contacts: list[BalancedContacts]
    first: FloatArray
    last: FloatArray

    @classmethod
    def of(cls, curve: ContinuationProblem, points: list[PathPoint]) -> "_Estimates":
        """Those of the points of a path."""
        at = [curve.at_point(point.state) for point in points[:-1]]
        frequency = np.array([frequency for _, frequency in at])
        contacts = [problem.contacts for problem, _ in at]
        unknowns = np.array([point.unknowns[: curve.problem.n_unknowns] for point in points])
        ends = np.stack([unknowns[:-1], unknowns[1:]], axis=1)
        known = np.array([point.margins for point in points])
        known = np.stack([known[:-1], known[1:]], axis=1)
        exact = np.zeros(known.shape)
        within = curve.problem.contacts.margins_within(ends, frequency, exact, contacts)
        with np.errstate(invalid="ignore"):
            first, last = np.moveaxis(within - known, 1, 0)
        return cls(frequency, contacts, first, last)


def _doubtful_shares(
    problem: HarmonicBalance, segments: Segments, measured: Measure, estimates: _Estimates
) -> FloatArray:
    """Shares (n,) of the segments at which a contact may pass its limit, 0 where none may."""
    ends = segments.left.state, segments.right.state, measured.left, measured.right
    shape = len(segments.number), len(_SHARES)
    motions = np.empty((*shape, problem.n_unknowns))
    interpolation.interpolate(*ends, _SHARES, motions)
    layout, n = problem.layout, problem.n_unknowns
    by_component = errors_within(segments, measured, lambda at: layout.relative(at[:, :n]))
    by_row = np.linalg.norm(by_component.reshape(shape[0], layout.n_rows, -1), axis=-1)
    by_row *= OF_VALUE * np.abs(measured.length)
    sizes = problem.contacts.sizes_at_switches(by_row)
    error = np.where(segments.switches, -sizes, sizes)[:, None] * _ERROR_PROFILE[:, None]
    of_point = segments.number
    frequency, contacts = estimates.frequency[of_point], estimates.contacts
    within = problem.contacts.margins_within(
        motions, frequency, error, [contacts[k] for k in of_point.tolist()]
    )
    off = estimates.first[of_point], estimates.last[of_point]
    shares = np.zeros(len(of_point))
    _most_beyond(within, *off, segments.begin, segments.width, segments.switches, shares)
    return shares


@Loop
def _most_beyond(within, first, last, begin, width, switches, shares) -> None:
    """Write the share of each segment at which a margin is the farthest beyond its limit.

    Margins ``within`` (n, s, n_switches) are corrected by what they are off at the ends of a step,
    ``first`` and ``last``. Segments in which all are within their limits are left out.
    """
    for i in range(len(within)):
        farthest = BEYOND
        for h in range(within.shape[1]):
            at = begin[i] + width[i] * _SHARES[h]
            for k in range(within.shape[2]):
                if not (math.isfinite(first[i, k]) and math.isfinite(last[i, k])):
                    continue
                off = first[i, k] + at * (last[i, k] - first[i, k])
                outward = off - within[i, h, k] if switches[i, k] else within[i, h, k] - off
                if outward > farthest:
                    farthest, shares[i] = outward, _SHARES[h]
