"""Largest displacements along a path with their slopes, peaks of them, and where they turn.

A cubic goes through them, and with it all amplitudes and slopes. A segment holds no maximum, or it
holds one to be located, or it needs further points to tell.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.continuation.between.segments import OF_SLOPE, Segments, errors_within
from symhbm.continuation.segment import Measure, PathState, ahead
from symhbm.numerics import FloatArray, FourierBasis, largest_displacement
from symhbm.numerics.loops import Loop, interpolation

TIE = 1e-9
"""Relative difference below which two responses are equal; the first of them is the leading one."""
FLAT_SLOPE = 1e-9
"""Slope relative to the response below which the response is constant to round-off."""


class PeakKind(StrEnum):
    """Kinds of peaks; an unbounded one exceeds what the balance resolves in double precision."""

    SMOOTH = "smooth"
    CORNER = "corner"
    UNBOUNDED = "unbounded"


@dataclass(frozen=True)
class Peak:
    """A peak: parameter ``value``, ``amplitude`` [m] of ``dof`` and the solution there.

    Of a goal, its value with ``dof`` -1.
    """

    value: float
    amplitude: float
    dof: int
    kind: PeakKind
    unknowns: FloatArray
    residual_norm: float


def leading(amplitude: FloatArray) -> int:
    """The DOF with the largest response, the first among those that tie."""
    return int(np.argmax(amplitude >= (1 - TIE) * amplitude.max()))


def amplitude_and_slope(
    problem: HarmonicBalance, unknowns: FloatArray, derivative: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Largest values of what has peaks at motions ``(..., n_unknowns)``, and their slopes.

    Both ``(..., n_peaking)``: displacements, or rows of an output.
    """
    shape = (*unknowns.shape[:-1], problem.peaking.n)
    motions, rates = (
        problem.peaking.of(each).reshape(-1, problem.basis.n_components)
        for each in (unknowns, derivative)
    )
    amplitude, slope = largest_and_slope(problem.basis, motions, rates)
    return amplitude.reshape(shape), slope.reshape(shape)


def largest_and_slope(
    basis: FourierBasis, motions: FloatArray, rates: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Largest values (n,) of motions (n, n_components), and their slopes from their ``rates``."""
    if basis.has_one_harmonic and basis.n_components == 2:
        amplitude, slope = np.empty((2, len(motions)))
        rows = np.ascontiguousarray(motions), np.ascontiguousarray(rates)
        _of_one_harmonic(*rows, amplitude, slope)
        return amplitude, slope
    amplitude, angle = largest_displacement(basis, motions)
    values = basis.values(angle)
    # The angle of the maximum varies, but the displacement is stationary by the angle.
    sign = np.sign(np.einsum("dm,dm->d", values, motions))
    return amplitude, sign * np.einsum("dm,dm->d", values, rates)


@Loop
def _of_one_harmonic(motions, derivatives, amplitude, slope) -> None:
    """Write amplitudes (n,) of one harmonic each, and their slopes, from cosines and sines."""
    for i in range(len(motions)):
        cosine, sine = motions[i, 0], motions[i, 1]
        size = np.hypot(cosine, sine)
        projection = cosine * derivatives[i, 0] + sine * derivatives[i, 1]
        amplitude[i], slope[i] = size, projection / size if size > 0 else 0.0


@dataclass(eq=False, slots=True)
class Slopes(PathState):
    """Solutions with the amplitudes of all that has peaks, and their slopes, (..., n_peaking)."""

    amplitude: FloatArray
    slope: FloatArray

    @classmethod
    def of(cls, problem: HarmonicBalance, path_state: PathState) -> "Slopes":
        """Amplitudes and slopes of one or several path states."""
        state, direction = path_state.state, path_state.direction
        n = problem.n_unknowns  # of coefficients, ahead of other unknowns
        values = amplitude_and_slope(problem, state[..., :n], direction[..., :n])
        return cls(state, direction, *values)


_MIN_SHARE = 0.95
"""Share of the largest response that another one must reach to be examined."""
_MANY = 4
"""Motions of several harmonics from which leaving out those that cannot lead takes less time."""
_SHARES = np.arange(1, 16) / 16
N_SLOPES = len(_SHARES) + 2
_MAX_SIGN_RANGE = 4
"""Samples within which a change of sign counts as a single one."""
_SMALL_SLOPE = 0.1
"""Slope near an end of slip, relative to the largest, that may change its sign in between."""


class SlopeEstimate(NamedTuple):
    """Estimated slopes of amplitudes along segments, arrays (n, n_dof).

    ``turns``: whether the slope changes from positive to negative; ``is_doubtful``: whether further
    points are needed to tell. Both are false for responses that are not examined: those that stay
    below the largest one, and those that equal one before them at both ends. ``slopes``
    (n, n_shares, n_dof) run from one end to the other, ``error`` (n, n_dof) bounds their errors,
    per unit of length as of `Measure`. ``left`` and ``right`` are both ends. ``of_states``
    (n, n_shares - 2, n_dof) are slopes by the share of interpolated states: less accurate beside an
    onset or end of slip, but they tell where the largest displacement passes to another instant.
    """

    turns: NDArray[np.bool_]
    is_doubtful: NDArray[np.bool_]
    slopes: FloatArray
    error: FloatArray
    left: Slopes
    right: Slopes
    of_states: FloatArray

    def goes(self, sign: int, segment: Any, dof: Any) -> NDArray[np.bool_]:
        """Whether an amplitude surely rises all along within a segment, or falls (``sign`` -1)."""
        error = 4 * _SHARES * (1 - _SHARES) * self.error[segment, dof][..., None]
        slopes = sign * self.slopes[segment, :, dof][..., 1:-1]
        return np.all((slopes > error) & (sign * self.of_states[segment, :, dof] > 0), axis=-1)


def estimate_slopes(
    problem: HarmonicBalance, segments: Segments, measured: Measure, per_dof: bool = False
) -> SlopeEstimate:
    """Slopes of the largest amplitude in segments, or of each one ``per_dof``."""
    left, right = (Slopes.of(problem, end) for end in (segments.left, segments.right))
    scale = segments.scale
    (n, n_dof), n_shares = left.amplitude.shape, len(_SHARES)
    error = np.zeros((n, n_dof))
    if problem.samples is None:  # else piecewise linear forces have corners at any resolution
        by_component = errors_within(
            segments, measured, lambda at: problem.peaking.of(at[:, : problem.n_unknowns])
        )
        error = OF_SLOPE * np.linalg.norm(by_component.reshape(n, n_dof, -1), axis=-1)
    motions, rates = np.empty((2, n, n_shares, problem.n_unknowns))
    ends = left.state, right.state, measured.left, measured.right
    interpolation.interpolate(*ends, _SHARES, motions)
    interpolation.differentiate(*ends, _SHARES, rates)
    if per_dof or n_dof < _MANY or problem.basis.has_one_harmonic:
        amplitudes, inside = amplitude_and_slope(problem, motions, rates)
    else:
        amplitudes, inside = np.zeros((2, n, n_shares, n_dof))
        motions, rates = problem.peaking.of(motions), problem.peaking.of(rates)
        examined = _may_lead(problem.basis, motions, error * measured.length)
        for at in (left, right):
            examined |= at.amplitude >= _MIN_SHARE * at.amplitude.max(axis=1, keepdims=True)
        chosen = np.broadcast_to(examined[:, None], amplitudes.shape)
        found = largest_and_slope(problem.basis, motions[chosen], rates[chosen])
        amplitudes[chosen], inside[chosen] = found
    ends = (left.amplitude, right.amplitude), (left.slope, right.slope)
    slopes = np.empty((n, N_SLOPES, n_dof))
    turns, is_doubtful = np.empty((2, n, n_dof), dtype=bool)
    tangents = left.direction, right.direction
    metric = measured.normal, measured.length, scale
    _write_slopes(*ends, tangents, *metric, inside, segments.switch_events, slopes)
    given = ends[0], amplitudes, slopes, inside, error, measured.length
    _judge(*given, segments.switch_events, per_dof, turns, is_doubtful)
    return SlopeEstimate(turns, is_doubtful, slopes, error, left, right, inside)


def _may_lead(basis: FourierBasis, motions: FloatArray, reserve: FloatArray) -> NDArray[np.bool_]:
    """Which motions (n, n_shares, n_dof, n_components) may be among the largest, (n, n_dof).

    A largest value is no more than the sum of the harmonics. It may be in error by a ``reserve``
    (n, n_dof).
    """
    of_harmonics = basis.order[:, None] == np.array(basis.harmonics)
    most = np.sqrt(motions**2 @ of_harmonics).sum(axis=-1)
    first = np.argmax(most, axis=-1)[..., None, None]
    one = np.take_along_axis(motions, first, axis=2).reshape(-1, basis.n_components)
    largest = largest_displacement(basis, one)[0].reshape(*most.shape[:2], 1)
    return np.any(~(most + reserve[:, None] < _MIN_SHARE * largest), axis=1)


@Loop
def _write_slopes(
    amplitudes, end_slopes, tangents, normal, length, scale, inside, switch_events, slopes
) -> None:
    """Write slopes per unit of length: at both ends, and ``inside`` from those by the share."""
    n, n_slopes, n_dof = slopes.shape
    for i in range(n):
        before = ahead(tangents[0][i], normal[i], scale[i])
        after = ahead(tangents[1][i], normal[i], scale[i])
        distance = length[i, 0] if length[i, 0] != 0 else 1.0  # coincident ends
        at_left, at_right = switch_events[i, 0], switch_events[i, 1]
        for j in range(n_dof):
            first, last = end_slopes[0][i, j] / before, end_slopes[1][i, j] / after
            slopes[i, 0, j], slopes[i, n_slopes - 1, j] = first, last
            for h in range(1, n_slopes - 1):
                slopes[i, h, j] = inside[i, h - 1, j] / distance
            if at_left == at_right:
                continue
            # slope = a + c t + d t^2 with t the square root of the distance from the slip event,
            # fitted to the slopes at both ends and the mean slope.
            mean = (amplitudes[1][i, j] - amplitudes[0][i, j]) / distance
            slip_slope, other_slope = (first, last) if at_left else (last, first)
            rise = other_slope - slip_slope
            c = 6 * (mean - slip_slope) - 3 * rise
            for h in range(1, n_slopes - 1):
                t = h / (n_slopes - 1)
                t = t if at_left else 1 - t
                slopes[i, h, j] = slip_slope + c * t + (rise - c) * (t * t)


@Loop
def _judge(
    ends, amplitudes, slopes, inside, error, length, switch_events, per_dof: bool, turns,
    is_doubtful,
) -> None:  # fmt: skip
    """Write which amplitudes of segments turn, and of which that is doubtful."""
    n_inside = amplitudes.shape[1]
    top = np.empty(n_inside + 2)
    for i in range(len(slopes)):
        top[0], top[n_inside + 1] = ends[0][i].max(), ends[1][i].max()
        for h in range(n_inside):
            top[1 + h] = amplitudes[i, h].max()
        leader = -1
        for j in range(slopes.shape[2]):
            turns[i, j] = is_doubtful[i, j] = False
            begin, end = ends[0][i, j], ends[1][i, j]
            if not per_dof:
                leads = begin >= _MIN_SHARE * top[0] or end >= _MIN_SHARE * top[n_inside + 1]
                for h in range(n_inside):
                    reserve = error[i, j] * length[i, 0]
                    leads = leads or amplitudes[i, h, j] + reserve >= _MIN_SHARE * top[1 + h]
                if not leads:
                    continue
            if leader < 0:
                leader = j
            elif (
                abs(begin - ends[0][i, leader]) <= TIE * top[0]
                and abs(end - ends[1][i, leader]) <= TIE * top[n_inside + 1]
            ):
                continue
            constant = FLAT_SLOPE * max(begin, end)
            turns[i, j], is_doubtful[i, j] = _turn_of(
                slopes[i, :, j], inside[i, :, j], error[i, j], constant, switch_events[i]
            )


@Loop
def _turn_of(slopes, inside, error: float, constant: float, switch_events) -> tuple[bool, bool]:
    """Whether one amplitude turns, and whether further points are needed to tell."""
    last = len(slopes) - 1
    largest, sign_changes, of_states = 0.0, 0, 0
    for h in range(last + 1):
        largest = max(largest, abs(slopes[h]))
        sign_changes += h > 0 and (slopes[h] > 0) != (slopes[h - 1] > 0)
        before = slopes[0] if h <= 1 else inside[h - 2]
        at = slopes[h] if h in (0, last) else inside[h - 1]
        of_states += h > 0 and (at > 0) != (before > 0)
    sign_changes = max(sign_changes, of_states)
    if not largest > constant:
        return False, False
    turns = slopes[0] > constant and slopes[last] <= constant
    changes_sign = (slopes[0] > 0) != (slopes[last] > 0)
    sign = 1.0 if slopes[0] > 0 else -1.0
    # Shares at which the slope may have changed its sign already, or may keep its first sign.
    first_negative, last_positive, any_negative = -1, -1, False
    for h in range(last + 1):
        margin = 4 * h * (last - h) / (last * last) * error  # exact at both ends
        if sign * slopes[h] < margin:
            first_negative = h if first_negative < 0 else first_negative
            any_negative = any_negative or 0 < h < last
        if sign * slopes[h] > -margin:
            last_positive = h
    if changes_sign:
        last_positive = last if last_positive < 0 else last_positive
        is_doubtful = last_positive - max(first_negative, 0) > _MAX_SIGN_RANGE
        return turns, is_doubtful or sign_changes > 1
    # Near an onset or end of slip the slope may change its sign twice within one sample.
    for end in range(2):
        near = sign * slopes[end * last]
        any_negative = any_negative or (switch_events[end] and near < _SMALL_SLOPE * largest)
    return turns, any_negative or sign_changes > 0
