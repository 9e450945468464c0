"""Slopes of amplitudes along a path, and estimates of their sign changes between two points.

States and tangents at two points give a cubic in between, and with it all amplitudes and slopes.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.continuation.between.interpolation_error import ValueAndRate, slope_errors
from symhbm.continuation.segment import Measure, PathState, ahead, measure
from symhbm.numerics import FloatArray, cubic, cubic_slope, largest_displacement

TIE = 1e-9
"""Relative difference below which two responses are equal; the first of them is the leading one."""
FLAT_SLOPE = 1e-9
"""Slope relative to the response below which the response is constant to round-off."""
_MIN_SHARE = 0.95
"""Share of the largest response that another one must reach to be examined."""
_SHARES = np.arange(1, 16) / 16
_ERROR_PROFILE = 4 * np.linspace(0, 1, 17) * (1 - np.linspace(0, 1, 17))
"""Error of a slope along a segment over its maximum: zero at both ends, where it is exact."""
_MAX_SIGN_RANGE = 4
"""Samples within which a change of sign counts as a single one."""
_SMALL_SLOPE = 0.1
"""Slope near an end of slip, relative to the largest, that may change its sign in between."""


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
        projection = np.sum(coefficients * derivative.reshape(-1, 2), axis=1)
        slope = projection / np.where(amplitude > 0, amplitude, 1.0)
        return amplitude.reshape(shape), slope.reshape(shape)
    amplitude, angle = largest_displacement(problem.basis, coefficients)
    values = problem.basis.values(angle)
    # The angle of the maximum varies, but the displacement is stationary by the angle.
    sign = np.sign(np.einsum("dm,dm->d", values, coefficients))
    slope = sign * np.einsum("dm,dm->d", values, derivative.reshape(-1, size))
    return amplitude.reshape(shape), slope.reshape(shape)


@dataclass(frozen=True)
class Slopes(PathState):
    """Solutions with the amplitudes of all DOFs and their slopes along the path, (..., n_dof)."""

    amplitude: FloatArray
    slope: FloatArray

    @classmethod
    def of(cls, problem: HarmonicBalance, path_state: PathState) -> "Slopes":
        """Amplitudes and slopes of one or several path states."""
        state, direction = path_state.state, path_state.direction
        values = amplitude_and_slope(problem, state[..., :-1], direction[..., :-1])
        return cls(state, direction, *values)


class SlopeEstimate(NamedTuple):
    """Estimated slopes of amplitudes along segments, arrays (..., n_dof).

    ``has_maximum``: whether the slope changes from positive to negative; ``ambiguous``: whether
    further points are needed to tell; ``may_lead``: whether the amplitude comes close to the
    largest. ``slopes`` (..., n, n_dof) run from one end to the other, ``error`` (..., n_dof) bounds
    their errors, per unit of length as ``measured``.
    """

    has_maximum: NDArray[np.bool_]
    ambiguous: NDArray[np.bool_]
    may_lead: NDArray[np.bool_]
    slopes: FloatArray
    error: FloatArray
    measured: Measure

    def falls_from(self) -> NDArray[np.bool_]:
        """Whether each amplitude surely falls all along from the left end, (..., n_dof)."""
        upper = self.slopes + _ERROR_PROFILE[:, None] * self.error[..., None, :]
        return upper[..., 1:-1, :].max(-2) < 0

    def rises_to(self) -> NDArray[np.bool_]:
        """Whether each amplitude surely rises all along to the right end, (..., n_dof)."""
        lower = self.slopes - _ERROR_PROFILE[:, None] * self.error[..., None, :]
        return lower[..., 1:-1, :].min(-2) > 0

    def take(self, index: Any) -> Self:
        """A selection of the segments."""
        columns: Any = [values[index] for values in self[:-1]] + [self.measured.take(index)]
        return type(self)(*columns)


def estimate_slopes(
    problem: HarmonicBalance,
    left: Slopes,
    right: Slopes,
    before: PathState,
    after: PathState,
    scale: FloatArray,
    switch_events: NDArray[np.bool_],
) -> SlopeEstimate:
    """Slopes of amplitudes between two solutions, or between several pairs of them.

    ``slip_events`` (..., 2) tells at which end slip begins or ends: slopes there vary with the
    square root of the distance. ``before`` and ``after``, the points next to the segments, are NaN
    where there are none or an event lies between.
    """
    measured = measure(problem.single_valued, left, right, scale)
    length = np.where(measured.length == 0, 1.0, measured.length)  # coincident ends
    amplitudes, slopes = _interpolated(problem, left, right, scale, measured, length, switch_events)
    samples = (
        ValueAndRate(at.bare(), at.state[..., :-1], at.direction[..., :-1])
        for at in (before, left, right, after)
    )
    error = slope_errors(measured, scale, *samples)
    shape = *error.shape[:-1], -1, problem.basis.n_components
    error = np.linalg.norm(error.reshape(shape), axis=-1)
    if problem.samples is not None:
        error = np.zeros_like(error)  # piecewise linear forces have corners at any resolution
    margin = (error * length)[..., None, :]
    may_lead = [
        np.any(value + reserve >= _MIN_SHARE * value.max(axis=-1, keepdims=True), axis=-2)
        for value, reserve in (
            (left.amplitude[..., None, :], 0.0),
            (amplitudes, margin),
            (right.amplitude[..., None, :], 0.0),
        )
    ]
    first, last = slopes[..., 0, :], slopes[..., -1, :]
    largest_slope = np.abs(slopes).max(axis=-2)
    constant = FLAT_SLOPE * np.maximum(left.amplitude, right.amplitude)
    moving = largest_slope > constant
    has_maximum = (first > constant) & (last <= constant) & moving
    starts_rising = (first > 0)[..., None, :]
    signed_slopes = np.where(starts_rising, slopes, -slopes)
    margin = _ERROR_PROFILE[:, None] * error[..., None, :]
    # Shares at which the slope may have changed its sign already, or may keep its first sign.
    may_be_negative, may_be_positive = signed_slopes < margin, signed_slopes > -margin
    changes_sign = (first > 0) != (last > 0)
    first_negative = np.argmax(may_be_negative, axis=-2)
    last_positive = len(_ERROR_PROFILE) - 1 - np.argmax(may_be_positive[..., ::-1, :], axis=-2)
    ambiguous = np.where(
        changes_sign,
        last_positive - first_negative > _MAX_SIGN_RANGE,
        may_be_negative[..., 1:-1, :].any(-2),
    )
    # Near an onset or end of slip the slope may change its sign twice within one sample.
    slip_slope = np.where(switch_events[..., None], signed_slopes[..., [0, -1], :], np.inf).min(
        axis=-2
    )
    ambiguous |= ~changes_sign & (slip_slope < _SMALL_SLOPE * largest_slope)
    sign_changes = np.count_nonzero((slopes[..., 1:, :] > 0) != (slopes[..., :-1, :] > 0), axis=-2)
    ambiguous |= sign_changes > changes_sign
    return SlopeEstimate(
        has_maximum, ambiguous & moving, np.any(may_lead, axis=0), slopes, error, measured
    )


def _interpolated(
    problem: HarmonicBalance,
    left: Slopes,
    right: Slopes,
    scale: FloatArray,
    measured: Measure,
    length: FloatArray,
    switch_events: NDArray[np.bool_],
) -> tuple[FloatArray, FloatArray]:
    """Amplitudes inside (..., n, n_dof), and slopes per unit of length with those at both ends."""
    tangents = measured.left[..., None, :], measured.right[..., None, :]
    ends = left.state[..., None, :], right.state[..., None, :], tangents, _SHARES[:, None]
    value, slope = cubic(*ends), cubic_slope(*ends)
    slope /= length[..., None]
    amplitudes, inside = amplitude_and_slope(problem, value[..., :-1], slope[..., :-1])
    left_slope, right_slope = (
        end.slope / ahead(end, measured.normal, scale) for end in (left, right)
    )
    one_slip_event = switch_events[..., 0] != switch_events[..., 1]
    if one_slip_event.any():
        # slope = a + c t + d t^2 with t the square root of the distance from the slip event, fitted
        # to the slopes at both ends and the mean slope.
        at_left = switch_events[..., :1]
        slip_slope = np.where(at_left, left_slope, right_slope)[..., None, :]
        other_slope = np.where(at_left, right_slope, left_slope)[..., None, :]
        mean = ((right.amplitude - left.amplitude) / length)[..., None, :]
        c = 6 * (mean - slip_slope) - 3 * (other_slope - slip_slope)
        t = np.where(at_left, _SHARES, 1 - _SHARES)[..., None]
        fitted = slip_slope + c * t + (other_slope - slip_slope - c) * t**2
        inside = np.where(one_slip_event[..., None, None], fitted, inside)
    slopes = [left_slope[..., None, :], inside, right_slope[..., None, :]]
    return amplitudes, np.concatenate(slopes, axis=-2)
