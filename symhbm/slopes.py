"""Slopes of the response over a path: where an amplitude turns between two points, or may.

Between two points the path is known to third order, and with it the slopes of all amplitudes.
"""

from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.extremes import largest_displacement
from symhbm.fourier import FloatArray
from symhbm.hermite import cubic, cubic_slope
from symhbm.residual import HarmonicBalance
from symhbm.stations import Station, measure

TIE = 1e-9
"""Responses this close, relatively, lead together; the first of them gives its name."""
STILL = 1e-9
"""Slope relative to the response below which it is constant, to round-off."""
_CONTENDER = 0.95
"""Share of the largest response that another needs somewhere to be watched in between."""
_SHARES = np.arange(1, 16) / 16
_NEARLY = 0.1
"""Slope, relative to the largest around, that may be an interpolated zero."""
_INTERPOLATED = 1e-3
"""Change of an amplitude over a stretch, relative to the whole response, that may be unseen."""
_DIP = 0.99
"""Slope, relative to the smaller end's, below which it has a dip in between."""


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
class Slopes(Station):
    """Solutions with the amplitudes of all DOFs and their slopes along the path, (..., n_dof)."""

    amplitude: FloatArray
    slope: FloatArray

    @classmethod
    def of(cls, problem: HarmonicBalance, station: Station) -> "Slopes":
        """Those of one or several stations."""
        state, direction = station.state, station.direction
        found = amplitude_and_slope(problem, state[..., :-1], direction[..., :-1])
        return cls(state, direction, *found)

    def __getitem__(self, index: Any) -> "Slopes":
        return Slopes(*(getattr(self, field.name)[index] for field in fields(self)))


class Turning(NamedTuple):
    """What becomes of amplitudes along stretches of a path, arrays (..., n_dof).

    Whether each has one maximum in between (``turns``), whether points are to be added to tell
    (``unclear``), and whether it comes close to being the largest (``contends``); ``slopes``
    (..., n, n_dof), from one end to the other.
    """

    turns: NDArray[np.bool_]
    unclear: NDArray[np.bool_]
    contends: NDArray[np.bool_]
    slopes: FloatArray


def turning(
    problem: HarmonicBalance,
    left: Slopes,
    right: Slopes,
    scale: FloatArray,
    roots: NDArray[np.bool_],
    faint: bool = False,
    halvings: int = 0,
) -> Turning:
    """What becomes of the amplitudes between two solutions, or between several pairs of them.

    ``roots`` (..., 2) tells at which end slip begins or ends: slopes there go with the square root
    of the distance. ``faint`` asks for every maximum of responses far below the largest too;
    ``halvings`` tells how often a step was divided for them.
    """
    amplitudes, inside, error = _interpolated(problem, left, right, scale, roots)
    contends = [
        np.any(amplitude >= _CONTENDER * amplitude.max(axis=-1, keepdims=True), axis=-2)
        for amplitude in (left.amplitude[..., None, :], amplitudes, right.amplitude[..., None, :])
    ]
    slopes = np.concatenate([left.slope[..., None, :], inside, right.slope[..., None, :]], axis=-2)
    first, last = slopes[..., 0, :], slopes[..., -1, :]
    falls = np.count_nonzero((slopes[..., :-1, :] > 0) & (slopes[..., 1:, :] <= 0), axis=-2)
    level = np.abs(slopes).max(axis=-2)
    still = STILL * np.maximum(left.amplitude, right.amplitude)
    moving = level > still
    turns = (first > still) & (last <= still) & moving
    climb = slopes * np.sign(first)[..., None, :]
    lowest = climb[..., 1:-1, :].min(axis=-2)
    dips = lowest < _DIP * np.minimum(climb[..., 0, :], climb[..., -1, :])
    # Next to a root of slip the slope may turn and turn back closer than any interpolant tells.
    at_root = np.where(roots[..., None], climb[..., [0, -1], :], np.inf).min(axis=-2)
    # The error of a cubic falls with the fourth power of its length.
    error = error * 16.0**-halvings
    near = np.maximum(_NEARLY * level, error)
    nearly = (dips & (lowest < near)) | (at_root < _NEARLY * level)
    if faint:
        nearly |= np.minimum(lowest, climb[..., [0, -1], :].min(axis=-2)) < error
    unclear = np.where(turns, falls > 1, (falls > 0) | ((first * last > 0) & nearly))
    return Turning(turns, unclear & moving, np.any(contends, axis=0), slopes)


def _interpolated(
    problem: HarmonicBalance,
    left: Slopes,
    right: Slopes,
    scale: FloatArray,
    roots: NDArray[np.bool_],
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Amplitudes in between, their slopes in the measure of the left end, and an error of these.

    (..., n, n_dof) the first two, (..., 1) the last.
    """
    measured = measure(problem.single_valued, left, right, scale)
    length = np.where(measured.length == 0, 1.0, measured.length)  # one point twice
    # Friction over samples has corners that no closer look makes smooth.
    unseen = _INTERPOLATED if problem.samples is None else 0.0
    error = unseen * scale[..., :1] / np.abs(length)
    tangents = measured.left[..., None, :], measured.right[..., None, :]
    ends = left.state[..., None, :], right.state[..., None, :], tangents, _SHARES[:, None]
    value, slope = cubic(*ends), cubic_slope(*ends)
    slope /= length[..., None]
    amplitudes, slopes = amplitude_and_slope(problem, value[..., :-1], slope[..., :-1])
    one_root = roots[..., 0] != roots[..., 1]
    if not one_root.any():
        return amplitudes, slopes, error
    # slope = a + c t + d t^2, t the root of the distance: both ends and the mean are known.
    at_ends = [
        amplitude_and_slope(problem, station.state[..., :-1], (tangent / length)[..., :-1])
        for station, tangent in ((left, measured.left), (right, measured.right))
    ]
    first = roots[..., :1]
    at_root, other = (
        np.where(first, at_ends[i][1], at_ends[1 - i][1])[..., None, :] for i in (0, 1)
    )
    mean = ((right.amplitude - left.amplitude) / length)[..., None, :]
    c = 6 * (mean - at_root) - 3 * (other - at_root)
    t = np.where(first, _SHARES, 1 - _SHARES)[..., None]
    rooted = at_root + c * t + (other - at_root - c) * t**2
    return amplitudes, np.where(one_root[..., None, None], rooted, slopes), error
