"""Condensed structures as sums over poles: the function, how many modes it has, its matrices.

A condensed stiffness has as many poles as the interior has modes; only those near a band vary
quickly within it. All others together are a polynomial, to round-off: the cost of a frequency does
not depend on the number of modes.

The fixed-interface structure is the one whose kept degrees of freedom are held at rest. The number
of modes below ``s`` is that of the fixed-interface modes below ``s`` plus that of the negative
eigenvalues of the undamped ``Z(s)`` with the springs of the contacts (Wittrick and Williams). So
modes are counted exactly, and none is computed.

Matrices of what is kept and of the modes of its basis have the same condensed stiffness, to
round-off: a motion in time that the sum describes at frequencies ``p`` is that of these matrices.
"""

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from symhbm.model.frame import restored
from symhbm.model.linear import NearModes, hermitian, weighted
from symhbm.model.matrices import Model
from symhbm.model.records import record
from symhbm.model.structure import Structure
from symhbm.numerics import ComplexArray, FloatArray, negative_eigenvalues

_NEAR = 3.0
"""Sum of the half axes, over half the band, of the ellipse around it whose poles are kept."""
_TERMS = 40
"""Terms of the polynomial: the truncation error falls as a power of `_NEAR`, to 1e-19."""
_ROUND_OFF = 1e-17
"""Size of a term, relative to the largest one, that is left out."""
OUTSIDE = 1e-9
"""Distance beyond the ends of a band, over half of it, that is round-off."""


@record
class PoleSum(NamedTuple):
    """``P(p) - sum_k left_k(p) right_k(p) / (p - pole_k)`` at ``p = i s``, (n_rows, n_columns).

    ``polynomial`` (3, n_rows, n_columns), ``left`` (3, n_rows, n_poles) and ``right``
    (3, n_poles, n_columns) are the coefficients of 1, ``p`` and ``p^2``; ``poles`` (n_poles,)
    [rad/s].
    """

    polynomial: ComplexArray
    left: ComplexArray
    right: ComplexArray
    poles: ComplexArray

    def __call__(self, s: float) -> ComplexArray:
        """The sum over all poles at one angular frequency [rad/s]."""
        polynomial, left, right = (at(part, 1j * s) for part in self[:3])
        return polynomial - (left / (1j * s - self.poles)) @ right

    def terms(self, s: float) -> FloatArray:
        """The sum of the absolute values of all terms."""
        polynomial, left, right = (np.abs(at(part, 1j * s)) for part in self[:3])
        return polynomial + (left / np.abs(1j * s - self.poles)) @ right

    def conjugate(self) -> "PoleSum":
        """The function whose value at ``s`` is the conjugate of that of this one at ``-s``."""
        return PoleSum(*(part.conj() for part in self))

    def of(self, chosen: NDArray[np.bool_]) -> "PoleSum":
        """The polynomial with some of the poles only."""
        left, right = self.left[:, :, chosen], self.right[:, chosen]
        return PoleSum(self.polynomial, left, right, self.poles[chosen])


def at(coefficients: ComplexArray, p: complex) -> ComplexArray:
    """Value of coefficients of 1, ``p`` and ``p^2``."""
    return coefficients[0] + p * coefficients[1] + p**2 * coefficients[2]


class PoleResidueFunction:
    """A `PoleSum` that is fast within one ``band`` (first, last) [rad/s], and its derivative.

    Nothing is fitted: terms of poles near the band are kept, the others become the polynomial.

    Attributes
    ----------
    middle, half
        Of the band [rad/s].
    terms : (n_terms, 2 n_rows n_columns)
        Chebyshev polynomial of the value, by rows, real and imaginary parts side by side.
    derivative : (n_terms, n_terms)
        What makes the terms of the derivative of those of the value [s/rad].
    poles : (n_poles,)
        Those near the band [rad/s].
    left, right : (n_rows, n_poles), (n_poles, n_columns)
        Factors of their terms ``left right / (i s - pole)``.
    """

    def __init__(self, whole: PoleSum, band: tuple[float, float]):
        self.middle, self.half = (band[0] + band[1]) / 2, (band[1] - band[0]) / 2
        position = (-1j * whole.poles - self.middle) / self.half
        root = np.sqrt(position**2 - 1)
        close = np.maximum(np.abs(position + root), np.abs(position - root)) < _NEAR
        near, far = whole.of(close), whole.of(~close)
        self.shape = whole.polynomial.shape[1:]
        self.poles = poles = near.poles
        self.left = -_diagonal(near.left, poles)
        self.right = _diagonal(near.right.transpose(0, 2, 1), poles).T.copy()

        def smooth(s: float) -> ComplexArray:
            """The function without the poles: their factors vary along the band."""
            p = 1j * s
            moved_right = near.right[1] + near.right[2] * (p + poles)[:, None]
            moved_left = near.left[1] + near.left[2] * (p + poles)
            return far(s) - at(near.left, p) @ moved_right - moved_left @ self.right

        angle = np.pi * (np.arange(_TERMS) + 0.5) / _TERMS
        values = np.array([smooth(s) for s in self.middle + self.half * np.cos(angle)])
        weights = 2 / _TERMS * np.cos(np.outer(np.arange(_TERMS), angle))
        weights[0] /= 2
        terms = np.tensordot(weights, values, 1)
        size = np.abs(terms).max(axis=(1, 2))
        n_terms = 2 + int(np.flatnonzero(size > _ROUND_OFF * size.max())[-1])
        terms = terms[: max(n_terms, 2)]
        # Real and imaginary parts side by side: the weights of the terms are real.
        self.terms = np.ascontiguousarray(terms).reshape(len(terms), -1).view(float)
        self.derivative = np.zeros((len(terms),) * 2)
        self.derivative[:-1] = chebyshev.chebder(np.eye(len(terms))) / self.half
        self._last: tuple[float, tuple[ComplexArray, ComplexArray]] | None = None

    def __call__(self, s: float) -> tuple[ComplexArray, ComplexArray]:
        """Value and derivative by ``s``, an angular frequency within the band [rad/s].

        ArithmeticError outside the band, and on a pole. What is returned is not to be written to.
        """
        last = self._last
        if last is not None and last[0] == s:
            return last[1]
        weights, inverse = self._weights(s)
        both = np.array([weights, weights @ self.derivative])
        value, slope = (both @ self.terms).view(complex).reshape(2, *self.shape)
        factors = np.stack([inverse, -1j * inverse**2])
        near = (self.left * factors[:, None]).reshape(2 * self.shape[0], len(inverse)) @ self.right
        value += near[: self.shape[0]]
        slope += near[self.shape[0] :]
        # A point is evaluated several times.
        self._last = s, (value, slope)
        return value, slope

    def curvature(self, s: float) -> ComplexArray:
        """Second derivative by ``s`` [rad/s], (n_rows, n_columns); raises as a value does."""
        weights, inverse = self._weights(s)
        bends = weights @ self.derivative @ self.derivative @ self.terms
        smooth = bends.view(complex).reshape(self.shape)
        return smooth - 2 * (self.left * inverse**3) @ self.right

    def _weights(self, s: float) -> tuple[FloatArray, ComplexArray]:
        """Weights (n_terms,) of the polynomial and ``1 / (i s - pole)`` (n_poles,)."""
        position, gap = (s - self.middle) / self.half, 1j * s - self.poles
        if abs(position) > 1 + OUTSIDE:
            raise ArithmeticError(f"{s / (2 * np.pi):g} Hz is outside the band of the condensation")
        if not gap.all():
            raise ZeroDivisionError(f"{s / (2 * np.pi):g} Hz is a resonance of the held structure")
        angles = np.arange(len(self.terms)) * np.arccos(np.clip(position, -1, 1))
        return np.cos(angles), 1 / gap


def _diagonal(coefficients: ComplexArray, poles: ComplexArray) -> ComplexArray:
    """Each column (n_rows, n_poles) at its own pole."""
    return coefficients[0] + coefficients[1] * poles + coefficients[2] * poles**2


_NEAR_POLE = 1e-9
"""Relative distance from a fixed-interface frequency, a pole of Z, at which Z has no digits."""


def modes_near(
    model: Any, harmonic: int, frequency: float, spring: FloatArray, loss: FloatArray
) -> NearModes:
    """Modes of a `CondensedModel` near a harmonic of an angular ``frequency`` [rad/s].

    The sign of each detuning is exact, its size to first order and within the natural frequencies
    of the fixed-interface structure around it; that of a mode far away is halfway between them, its
    width that of the narrower of them.

    ``spring`` and ``loss`` (n_rows,) or (n_rows, n_rows) are the stiffness and the loss stiffness
    of the contacts in this harmonic [N/m].
    """
    exciting, n_dof = harmonic * frequency, model.n_dof
    fixed, fixed_width = model.fixed[harmonic]
    s = _beside_resonance(fixed, fixed_width, exciting)
    directions = model.directions_in(harmonic).toarray()
    stiffness, slope = (_of_kind(directions, part) for part in model.undamped[harmonic](s))
    stiffness = hermitian(stiffness) + _contact_matrix(directions, spring)
    eigenvalues, vectors = np.linalg.eigh(stiffness)
    matrix = model.pole_residues[harmonic](s)[0][:, :n_dof]
    damping = _of_kind(directions, (matrix - matrix.conj().T) / 2j)
    damping = damping + _contact_matrix(directions, loss)
    # The inertia of a mode, interior included, is in the derivative of Z by the frequency.
    inertia = np.maximum(-_quadratic_forms(vectors, slope), 1e-300)
    n_fixed_below = int(np.count_nonzero(fixed < s))
    n_modes = len(fixed) + n_dof
    near = np.zeros(n_modes, dtype=bool)
    near[n_fixed_below : n_fixed_below + n_dof] = True
    # Each mode lies between two fixed-interface frequencies.
    infinite = np.full(n_dof, np.inf)
    lowest = np.concatenate([-infinite, fixed - exciting])
    highest = np.concatenate([fixed - exciting, infinite])
    width = np.minimum(
        np.concatenate([infinite, fixed_width]), np.concatenate([fixed_width, infinite])
    )
    between = np.isfinite(highest - lowest)
    detuning = np.zeros(n_modes)
    detuning[between] = (lowest[between] + highest[between]) / 2
    detuning[near] = eigenvalues / inertia + s - exciting
    width[near] = np.abs(_quadratic_forms(vectors, damping)) / inertia
    shapes = vectors * np.sqrt(2 * s / inertia)
    return NearModes(np.clip(detuning, lowest, highest), width, near, shapes)


def modes_below(model: Any, harmonic: int, frequency: float, spring: FloatArray) -> int:
    """Number of modes below a harmonic of an angular ``frequency``, see `modes_near`."""
    fixed, _ = model.fixed[harmonic]
    s = harmonic * frequency
    if np.abs(fixed / s - 1).min(initial=1.0) < _NEAR_POLE:
        s *= 1 + 2 * _NEAR_POLE  # beside a fixed-interface frequency, a pole of Z
    directions = model.directions_in(harmonic).toarray()
    stiffness = hermitian(_of_kind(directions, model.undamped[harmonic](s)[0]))
    dynamic = stiffness + _contact_matrix(directions, spring)
    return negative_eigenvalues(dynamic) + int(np.count_nonzero(fixed < s))


def _of_kind(directions: NDArray, matrix: ComplexArray) -> NDArray:
    """A Hermitian matrix, real where the directions are: then it is so but for round-off."""
    return matrix if np.iscomplexobj(directions) else matrix.real.astype(float)


def _beside_resonance(fixed: FloatArray, fixed_widths: FloatArray, s: float) -> float:
    """A frequency, but no closer to a fixed-interface frequency than half the width of that.

    Closer to it ``Z`` grows without bound if undamped and does not if damped, which would give
    modes without width.
    """
    if not fixed.size:
        return s
    i = np.argmin(np.abs(fixed - s))
    nearest, half_width = fixed[i], fixed_widths[i]
    to_next = np.min(np.abs(fixed[fixed != nearest] - nearest), initial=np.inf)
    distance = max(min(half_width, to_next / 4), 2 * _NEAR_POLE * s)
    if abs(s - nearest) >= distance:
        return s
    return float(nearest + np.copysign(distance, s - nearest))


def _quadratic_forms(vectors: NDArray, matrix: NDArray) -> FloatArray:
    """The quadratic form ``v' A v`` of each column ``v``."""
    return np.sum(vectors.conj() * (matrix @ vectors), axis=0).real


def _contact_matrix(directions: NDArray, factors: FloatArray) -> NDArray:
    return weighted(directions.conj().T, factors) @ directions


def joined_blocks(masters: NDArray, pull: NDArray, push: NDArray, inside: NDArray) -> NDArray:
    """Stiffness, damping and mass (3, n, n) of masters and basis, see `Interior.projected`."""
    n = pull.shape[1]
    upper = np.concatenate([masters[:, :, :n], pull], axis=2)
    lower = np.concatenate([push[:, :, :n], inside], axis=2)
    return np.concatenate([upper, lower], axis=1)


LARGEST_MODAL = 400
"""Masters and modes up to which matrices are kept: Floquet multipliers of more take too long."""


@record
class ModalMatrices(NamedTuple):
    """A structure in coordinates of its masters and of fixed-interface modes, (n, n) each.

    ``forces`` (n, n_patterns) are the known force patterns in these coordinates; ``between`` tells
    whether they are exact between the harmonics, too.
    """

    stiffness: FloatArray
    damping: FloatArray
    mass: FloatArray
    forces: FloatArray
    between: bool = False

    @classmethod
    def of(
        cls, masters: NDArray, pull: NDArray, push: NDArray, inside: NDArray
    ) -> "ModalMatrices | None":
        """From coefficients of 1, ``p`` and ``p^2`` of four blocks, see `Interior.projected`.

        None where there are more than `LARGEST_MODAL` coordinates, and of a wave around a disk.
        """
        n = pull.shape[1]
        if n + len(inside[0]) > LARGEST_MODAL or np.iscomplexobj(inside):
            return None
        stiffness, damping, mass = joined_blocks(masters, pull, push, inside)
        forces = np.concatenate([masters[0, :, n:], push[0, :, n:]])
        return cls(stiffness, damping, (mass + mass.T) / 2, forces)

    def model(self, contacts: Structure) -> Model:
        """A model of these matrices, with the contacts of a structure of the masters."""
        matrices = {
            f"{name}_matrix": sp.csc_array(getattr(self, name))
            for name in ("mass", "damping", "stiffness")
        }
        own = contacts.groups.attributes | {"lumped": contacts.lumped}
        return restored(matrices | own, Model)
