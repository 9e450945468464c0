"""Contacts that change their state for a moment between two points of a path, unseen by its step.

The relative motion of each contact is interpolated between two points. Where it comes as close to
the limit as it may be wrong, the path is solved for in between.
"""

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation.between.divisions import Segments
from symhbm.continuation.between.doubt import Known, value_errors
from symhbm.continuation.correctors import BEYOND, Corrector
from symhbm.continuation.point import PathPoint
from symhbm.continuation.segment import Measure, PathState, measure
from symhbm.numerics import FloatArray, FourierBasis, cubic

_SHARES = np.arange(1, 16) / 16
_SPREAD = (4 * _SHARES * (1 - _SHARES)) ** 2
"""Error of a cubic over the largest between two points."""
_SAMPLES = 16
"""Angles per period of the highest harmonic at which motions are looked at."""
_AT_ONCE = 2**20
"""Motions of contacts, by angles, that are looked at at once, which bounds the memory."""
_MAX_DEPTH = 6


def overlooked(points: list[PathPoint], corrector: Corrector) -> dict[int, float]:
    """Values between two points at which a contact is in another state than after the first.

    By the number of the first point.
    """
    problem, curve = corrector.curve.problem, corrector.curve
    if len(points) < 2 or not problem.n_contacts:
        return {}
    state, before, after = (
        np.array([getattr(point, name) for point in points])
        for name in ("state", "before", "after")
    )
    stretches = Segments.of(points, PathState(state, before), PathState(state, after))
    slip_margin = np.array([point.slip_margin for point in points])
    with np.errstate(invalid="ignore", divide="ignore"):
        limit = np.log(_motion(problem, state[:, :-1])) - slip_margin  # NaN where nothing moves
    size = len(_SHARES) * problem.n_contacts * _angles(problem.basis)
    found: dict[int, float] = {}
    for _ in range(_MAX_DEPTH):
        divided, shares, middles = [], [], []
        for part in stretches.parts(max(_AT_ONCE // size, 1)):
            measured = measure(curve.single_valued, part.left, part.right, part.scale)
            places = _places(problem, part, measured, limit)
            for k in np.flatnonzero(places).tolist():
                if int(part.number[k]) in found:
                    continue
                path = part.take(k).path(corrector, measured.take(k))
                middle = path.solve_between(float(places[k])) if path.length > 0 else None
                if middle is not None and path.other_states:
                    found[int(part.number[k])] = float(middle.state[-1])
                elif middle is not None:
                    divided.append(part.take([k]))
                    shares.append(places[k])
                    middles.append(middle)
        if not divided:
            break
        middle = PathState.stacked(middles)
        scale = np.array([curve.scale(state) for state in middle.state])
        stretches = Segments.joined(divided).divided(np.array(shares), middle, scale)
    return found


def _places(
    problem: HarmonicBalance, stretches: Segments[PathState], measured: Measure, limit: FloatArray
) -> FloatArray:
    """Shares (n,) of the way at which a contact may be beyond its limit, 0 where none may.

    ``limit`` (n_points, n_contacts) is the logarithm of the motion at the limit.
    """
    ends = stretches.left.state, stretches.right.state
    slopes = measured.left[:, None], measured.right[:, None]
    inside = cubic(ends[0][:, None], ends[1][:, None], slopes, _SHARES[:, None])
    motion = _motion(problem, inside[..., :-1])
    around = stretches.before, stretches.left, stretches.right, stretches.after
    error = value_errors(measured, stretches.scale, *(_relative(problem, at) for at in around))
    error = np.linalg.norm(error.reshape(len(error), -1, problem.basis.n_components), axis=-1)
    outward = np.where(stretches.slip, -1.0, 1.0)[:, None]
    doubtful = motion + outward * _SPREAD[:, None] * error[:, None]
    along = stretches.begin[:, None] + stretches.width[:, None] * _SHARES
    first, last = limit[stretches.number][:, None], limit[stretches.number + 1][:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        level = np.log(np.maximum(doubtful, 0.0)) - first - along[..., None] * (last - first)
        beyond = np.where(np.isfinite(first + last), outward * level, -np.inf)
    highest = beyond.max(axis=-1)
    top = highest.argmax(axis=-1)
    return np.where(highest.max(axis=-1) > BEYOND, _SHARES[top], 0.0)


def _relative(problem: HarmonicBalance, at: PathState) -> Known:
    """The relative motions of all contacts, and their derivatives along the tangent."""
    value, rate = (
        problem.relative(array[..., :-1]).reshape(len(array), -1)
        for array in (at.state, at.direction)
    )
    return Known(at, value, rate)


def _angles(basis: FourierBasis) -> int:
    return 1 if basis.has_one_harmonic and basis.n_components == 2 else _SAMPLES * basis.highest


def _motion(problem: HarmonicBalance, unknowns: FloatArray) -> FloatArray:
    """Half the range of the relative motions (..., n_contacts) of responses (..., n_unknowns)."""
    basis = problem.basis
    relative = problem.relative(unknowns.reshape(-1, unknowns.shape[-1]))
    if _angles(basis) == 1:
        motion = np.hypot(relative[..., 0], relative[..., 1])
    else:
        values = relative @ basis.values(2 * np.pi * np.arange(_angles(basis)) / _angles(basis)).T
        motion = np.ptp(values, axis=-1) / 2
    return motion.reshape(*unknowns.shape[:-1], -1)
