"""Slopes of the response over a path: where an amplitude turns between two points, or may.

Between two points the path is known to third order, and with it the slopes of all amplitudes.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.continuation.between.doubt import Known, slope_errors
from symhbm.continuation.segment import Measure, PathState, ahead, measure
from symhbm.numerics import FloatArray, cubic, cubic_slope, largest_displacement

TIE = 1e-9
"""Responses this close, relatively, lead together; the first of them gives its name."""
STILL = 1e-9
"""Slope relative to the response below which it is constant, to round-off."""
_CONTENDER = 0.95
"""Share of the largest response that another needs somewhere to be watched in between."""
_SHARES = np.arange(1, 16) / 16
_SPREAD = 4 * np.linspace(0, 1, 17) * (1 - np.linspace(0, 1, 17))
"""Error of a slope over the largest between two points: none at both, where it is known."""
_NARROW = 4
"""Shares within which a slope that changes its sign does so once."""
_NEARLY = 0.1
"""Slope next to an end of slip, relative to the largest around, that may turn in between."""


def leading(amplitude: FloatArray) -> int:
    """The DOF with the largest response, the first among those that tie."""
    return int(np.argmax(amplitude >= (1 - TIE) * amplitude.max()))


def amplitude_and_slope(
    problem: HarmonicBalance, unknowns: FloatArray, derivative: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Largest displacements of motions ``(..., n_unknowns)`` and their slopes, ``(..., n_dof)``."""
    size = problem.basis.n_components
    shape = (*unknowns.shape[:-1], problem.n_dof)
    coefficients = unknowns.reshape(-1, size)
    if problem.basis.has_one_harmonic and size == 2:
        amplitude = np.hypot(coefficients[:, 0], coefficients[:, 1])
        along = np.sum(coefficients * derivative.reshape(-1, 2), axis=1)
        slope = along / np.where(amplitude > 0, amplitude, 1.0)
        return amplitude.reshape(shape), slope.reshape(shape)
    amplitude, angle = largest_displacement(problem.basis, coefficients)
    values = problem.basis.values(angle)
    # The angle of a maximum moves, but the derivative by it vanishes there.
    sign = np.sign(np.einsum("dm,dm->d", values, coefficients))
    slope = sign * np.einsum("dm,dm->d", values, derivative.reshape(-1, size))
    return amplitude.reshape(shape), slope.reshape(shape)


@dataclass(frozen=True)
class Slopes(PathState):
    """Solutions with the amplitudes of all DOFs and their slopes along the path, (..., n_dof)."""

    amplitude: FloatArray
    slope: FloatArray

    @classmethod
    def of(cls, problem: HarmonicBalance, station: PathState) -> "Slopes":
        """Those of one or several stations."""
        state, direction = station.state, station.direction
        found = amplitude_and_slope(problem, state[..., :-1], direction[..., :-1])
        return cls(state, direction, *found)


class Turning(NamedTuple):
    """What becomes of amplitudes along stretches of a path, arrays (..., n_dof).

    Whether each has one maximum in between (``turns``), whether points are to be added to tell
    (``unclear``), and whether it comes close to being the largest (``contends``); ``slopes``
    (..., n, n_dof), from one end to the other, and the ``error`` (..., n_dof) they may have, by the
    length as ``measured``.
    """

    turns: NDArray[np.bool_]
    unclear: NDArray[np.bool_]
    contends: NDArray[np.bool_]
    slopes: FloatArray
    error: FloatArray
    measured: Measure

    def falls_from(self) -> NDArray[np.bool_]:
        """Whether each amplitude does not but fall from a maximum at the left end, (..., n_dof)."""
        return (self.slopes + _SPREAD[:, None] * self.error[..., None, :])[..., 1:-1, :].max(-2) < 0

    def rises_to(self) -> NDArray[np.bool_]:
        """Whether each amplitude does not but rise to a maximum at the right end, (..., n_dof)."""
        return (self.slopes - _SPREAD[:, None] * self.error[..., None, :])[..., 1:-1, :].min(-2) > 0

    def take(self, index: Any) -> Self:
        """That of some stretches."""
        columns: Any = [values[index] for values in self[:-1]] + [self.measured.take(index)]
        return type(self)(*columns)


def turning(
    problem: HarmonicBalance,
    left: Slopes,
    right: Slopes,
    before: PathState,
    after: PathState,
    scale: FloatArray,
    roots: NDArray[np.bool_],
) -> Turning:
    """What becomes of the amplitudes between two solutions, or between several pairs of them.

    ``roots`` (..., 2) tells at which end slip begins or ends: slopes there go with the square root
    of the distance. ``before`` and ``after``, the points next to the
    stretches, are NaN where there are none or an event stands between.
    """
    measured = measure(problem.single_valued, left, right, scale)
    length = np.where(measured.length == 0, 1.0, measured.length)  # one point twice
    amplitudes, slopes = _interpolated(problem, left, right, scale, measured, length, roots)
    known = (
        Known(at.bare(), at.state[..., :-1], at.direction[..., :-1])
        for at in (before, left, right, after)
    )
    error = slope_errors(measured, scale, *known)
    shape = *error.shape[:-1], -1, problem.basis.n_components
    error = np.linalg.norm(error.reshape(shape), axis=-1)
    if problem.samples is not None:
        error = np.zeros_like(error)  # its corners are no less of corners at a closer look
    margin = (error * length)[..., None, :]
    contends = [
        np.any(level + more >= _CONTENDER * level.max(axis=-1, keepdims=True), axis=-2)
        for level, more in (
            (left.amplitude[..., None, :], 0.0),
            (amplitudes, margin),
            (right.amplitude[..., None, :], 0.0),
        )
    ]
    first, last = slopes[..., 0, :], slopes[..., -1, :]
    level = np.abs(slopes).max(axis=-2)
    still = STILL * np.maximum(left.amplitude, right.amplitude)
    moving = level > still
    turns = (first > still) & (last <= still) & moving
    rises = (first > 0)[..., None, :]
    climb = np.where(rises, slopes, -slopes)
    margin = _SPREAD[:, None] * error[..., None, :]
    # Where the slope may have changed its sign already, and where it may not have done so yet.
    may_fall, may_climb = climb < margin, climb > -margin
    other = (first > 0) != (last > 0)
    first_fall = np.argmax(may_fall, axis=-2)
    last_climb = len(_SPREAD) - 1 - np.argmax(may_climb[..., ::-1, :], axis=-2)
    unclear = np.where(other, last_climb - first_fall > _NARROW, may_fall[..., 1:-1, :].any(-2))
    # Next to a root of slip the slope may turn and turn back closer than any interpolant tells.
    at_root = np.where(roots[..., None], climb[..., [0, -1], :], np.inf).min(axis=-2)
    unclear |= ~other & (at_root < _NEARLY * level)
    changes = np.count_nonzero((slopes[..., 1:, :] > 0) != (slopes[..., :-1, :] > 0), axis=-2)
    unclear |= changes > other
    return Turning(turns, unclear & moving, np.any(contends, axis=0), slopes, error, measured)


def _interpolated(
    problem: HarmonicBalance,
    left: Slopes,
    right: Slopes,
    scale: FloatArray,
    measured: Measure,
    length: FloatArray,
    roots: NDArray[np.bool_],
) -> tuple[FloatArray, FloatArray]:
    """Amplitudes in between (..., n, n_dof), and slopes with those at both ends, by the length."""
    tangents = measured.left[..., None, :], measured.right[..., None, :]
    ends = left.state[..., None, :], right.state[..., None, :], tangents, _SHARES[:, None]
    value, slope = cubic(*ends), cubic_slope(*ends)
    slope /= length[..., None]
    amplitudes, inside = amplitude_and_slope(problem, value[..., :-1], slope[..., :-1])
    at_left, at_right = (
        station.slope / ahead(station, measured.normal, scale) for station in (left, right)
    )
    one_root = roots[..., 0] != roots[..., 1]
    if one_root.any():
        # slope = a + c t + d t^2, t the root of the distance: both ends and the mean are known.
        first = roots[..., :1]
        at_root = np.where(first, at_left, at_right)[..., None, :]
        other = np.where(first, at_right, at_left)[..., None, :]
        mean = ((right.amplitude - left.amplitude) / length)[..., None, :]
        c = 6 * (mean - at_root) - 3 * (other - at_root)
        t = np.where(first, _SHARES, 1 - _SHARES)[..., None]
        rooted = at_root + c * t + (other - at_root - c) * t**2
        inside = np.where(one_root[..., None, None], rooted, inside)
    slopes = [at_left[..., None, :], inside, at_right[..., None, :]]
    return amplitudes, np.concatenate(slopes, axis=-2)
