"""Slip events that a continuation step passed over.

A contact may begin and end to slip between two points of a path. Its relative motion is
interpolated there; where it comes as close to the slip limit as the interpolation error, the path
is solved for in between.
"""

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation.between.interpolation_error import ValueAndRate, value_errors
from symhbm.continuation.between.segments import Segments
from symhbm.continuation.correctors import BEYOND, Corrector
from symhbm.continuation.point import PathPoint
from symhbm.continuation.segment import Measure, PathState, measure
from symhbm.numerics import FloatArray, FourierBasis, cubic

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
    margins = np.array([point.margins for point in points])
    with np.errstate(invalid="ignore", divide="ignore"):
        limit = np.log(_motion(problem, state[:, :-1])) - margins  # NaN where nothing moves
    size = len(_SHARES) * margins.shape[1] * _angles(problem.basis)
    missed: dict[int, float] = {}
    for _ in range(_MAX_DEPTH):
        divided, dividing_shares, middles = [], [], []
        for batch in segments.batches(max(_BATCH_SIZE // size, 1)):
            measured = measure(curve.single_valued, batch.left, batch.right, batch.scale)
            shares = _doubtful_shares(problem, batch, measured, limit)
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


def _doubtful_shares(
    problem: HarmonicBalance, segments: Segments[PathState], measured: Measure, limit: FloatArray
) -> FloatArray:
    """Shares (n,) of the segments at which a contact may pass its limit, 0 where none may.

    ``limit`` (n_points, n_switches) is the logarithm of the motion at the slip limit.
    """
    states = segments.left.state, segments.right.state
    slopes = measured.left[:, None], measured.right[:, None]
    interpolated = cubic(states[0][:, None], states[1][:, None], slopes, _SHARES[:, None])
    motion = _motion(problem, interpolated[..., :-1])
    path_states = segments.before, segments.left, segments.right, segments.after
    error = value_errors(
        measured, segments.scale, *(_relative_motion(problem, at) for at in path_states)
    )
    error = np.linalg.norm(error.reshape(len(error), -1, problem.basis.n_components), axis=-1)
    outward = np.where(segments.switches, -1.0, 1.0)[:, None]
    doubtful = motion + outward * _ERROR_PROFILE[:, None] * error[:, None]
    shares = segments.begin[:, None] + segments.width[:, None] * _SHARES
    first_limit, last_limit = limit[segments.number][:, None], limit[segments.number + 1][:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        margins = (
            np.log(np.maximum(doubtful, 0.0))
            - first_limit
            - shares[..., None] * (last_limit - first_limit)
        )
        beyond = np.where(np.isfinite(first_limit + last_limit), outward * margins, -np.inf)
    highest = beyond.max(axis=-1)
    share_index = highest.argmax(axis=-1)
    return np.where(highest.max(axis=-1) > BEYOND, _SHARES[share_index], 0.0)


def _relative_motion(problem: HarmonicBalance, at: PathState) -> ValueAndRate:
    """The relative motions at all switches, and their derivatives along the tangent."""
    rows = problem.contacts.rows_of_switches
    value, rate = (
        problem.layout.relative(array[..., :-1])[..., rows, :].reshape(len(array), -1)
        for array in (at.state, at.direction)
    )
    return ValueAndRate(at, value, rate)


def _angles(basis: FourierBasis) -> int:
    return 1 if basis.has_one_harmonic and basis.n_components == 2 else _SAMPLES * basis.highest


def _motion(problem: HarmonicBalance, unknowns: FloatArray) -> FloatArray:
    """Half the range of the relative motions (..., n_switches) of responses (..., n_unknowns)."""
    basis, rows = problem.basis, problem.contacts.rows_of_switches
    relative = problem.layout.relative(unknowns.reshape(-1, unknowns.shape[-1]))[:, rows]
    if _angles(basis) == 1:
        motion = np.hypot(relative[..., 0], relative[..., 1])
    else:
        values = relative @ basis.values(2 * np.pi * np.arange(_angles(basis)) / _angles(basis)).T
        motion = np.ptp(values, axis=-1) / 2
    return motion.reshape(*unknowns.shape[:-1], -1)
