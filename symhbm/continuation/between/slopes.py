"""Largest displacements along a path with their slopes, and what peaks of them are."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation.segment import PathState
from symhbm.numerics import FloatArray, FourierBasis, largest_displacement
from symhbm.numerics.loops import Loop

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
