"""Contact events that a continuation step passed over.

A contact may begin and end to slip, or to open, between two points of a path. Its relative motion
is interpolated there; where it comes as close to a limit as the interpolation error, the path is
solved for in between.
"""

from typing import NamedTuple

import numpy as np

from symhbm.balance import BalancedContacts, HarmonicBalance
from symhbm.continuation.between.interpolation_error import ValueAndRate, value_errors
from symhbm.continuation.between.segments import Segments
from symhbm.continuation.correctors import BEYOND, Corrector
from symhbm.continuation.point import PathPoint
from symhbm.continuation.problem import ContinuationProblem
from symhbm.continuation.segment import Measure, PathState, measure
from symhbm.numerics import FloatArray, cubic

_SHARES = np.arange(1, 16) / 16
_ERROR_PROFILE = (4 * _SHARES * (1 - _SHARES)) ** 2
"""Error of a cubic along a segment over its maximum."""
_SAMPLES = 16
"""Angles per period of the highest harmonic at which relative motions are evaluated."""
_BATCH_SIZE = 2**20
"""Contact motions, by angles, evaluated at once, which bounds the memory."""
_MAX_DEPTH = 6


def find_missed_events(points: list[PathPoint], corrector: Corrector) -> dict[int, float]:
    """Parameter values where a contact is in another state than after the path point before.

    By the index of that point.
    """
    problem, curve = corrector.curve.problem, corrector.curve
    if len(points) < 2 or not len(points[0].margins):
        return {}
    state, before, after = (
        np.array([getattr(point, name) for point in points])
        for name in ("state", "before", "after")
    )
    segments = Segments.of(points, PathState(state, before), PathState(state, after))
    estimates = _Estimates.of(curve, points, state)
    samples = problem.basis.highest if problem.basis.n_components > 2 else 1
    size = len(_SHARES) * len(points[0].margins) * _SAMPLES * samples
    missed: dict[int, float] = {}
    for _ in range(_MAX_DEPTH):
        divided, dividing_shares, middles = [], [], []
        for batch in segments.batches(max(_BATCH_SIZE // size, 1)):
            measured = measure(curve.single_valued, batch.left, batch.right, batch.scale)
            shares = _doubtful_shares(problem, batch, measured, estimates)
            for k in np.flatnonzero(shares).tolist():
                if int(batch.number[k]) in missed:
                    continue
                segment = batch.take(k).segment(corrector, measured.take(k))
                middle = segment.solve_between(float(shares[k])) if segment.length > 0 else None
                if middle is not None and segment.other_states:
                    missed[int(batch.number[k])] = float(middle.state[-1])
                elif middle is not None:
                    divided.append(batch.take([k]))
                    dividing_shares.append(shares[k])
                    middles.append(middle)
        if not divided:
            break
        middle = PathState.stacked(middles)
        scale = np.array([curve.scale(state) for state in middle.state])
        segments = Segments.joined(divided).divided(np.array(dividing_shares), middle, scale)
    return missed


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
    def of(
        cls, curve: ContinuationProblem, points: list[PathPoint], state: FloatArray
    ) -> "_Estimates":
        """Those of the points of a path, whose states are (n_points, n_unknowns + 1)."""
        at = [curve.at(point.value) for point in points[:-1]]
        frequency = np.array([frequency for _, frequency in at])
        contacts = [problem.contacts for problem, _ in at]
        ends = np.stack([state[:-1, :-1], state[1:, :-1]], axis=1)
        known = np.array([point.margins for point in points])
        known = np.stack([known[:-1], known[1:]], axis=1)
        exact = np.zeros(known.shape)
        within = curve.problem.contacts.margins_within(ends, frequency, exact, contacts)
        with np.errstate(invalid="ignore"):
            first, last = np.moveaxis(within - known, 1, 0)
        return cls(frequency, contacts, first, last)


def _doubtful_shares(
    problem: HarmonicBalance,
    segments: Segments[PathState],
    measured: Measure,
    estimates: _Estimates,
) -> FloatArray:
    """Shares (n,) of the segments at which a contact may pass its limit, 0 where none may."""
    states = segments.left.state, segments.right.state
    slopes = measured.left[:, None], measured.right[:, None]
    interpolated = cubic(states[0][:, None], states[1][:, None], slopes, _SHARES[:, None])
    path_states = segments.before, segments.left, segments.right, segments.after
    error = value_errors(
        measured, segments.scale, *(_relative_motion(problem, at) for at in path_states)
    )
    by_row = np.linalg.norm(error.reshape(len(error), -1, problem.basis.n_components), axis=-1)
    error = problem.contacts.sizes_at_switches(by_row)[:, None]
    outward = np.where(segments.switches, -1.0, 1.0)[:, None]
    of_point = segments.number
    within = problem.contacts.margins_within(
        interpolated[..., :-1],
        estimates.frequency[of_point],
        outward * _ERROR_PROFILE[:, None] * error,
        [estimates.contacts[k] for k in of_point.tolist()],
    )
    first, last = estimates.first[of_point][:, None], estimates.last[of_point][:, None]
    shares = segments.begin[:, None] + segments.width[:, None] * _SHARES
    with np.errstate(invalid="ignore"):
        margins = within - first - shares[..., None] * (last - first)
        beyond = np.where(np.isfinite(first + last), outward * margins, -np.inf)
    highest = beyond.max(axis=-1)
    share_index = highest.argmax(axis=-1)
    return np.where(highest.max(axis=-1) > BEYOND, _SHARES[share_index], 0.0)


def _relative_motion(problem: HarmonicBalance, at: PathState) -> ValueAndRate:
    """All relative motions, and their derivatives along the tangent."""
    value, rate = (
        problem.layout.relative(array[..., :-1]).reshape(len(array), -1)
        for array in (at.state, at.direction)
    )
    return ValueAndRate(at, value, rate)
