"""Modes of a condensed structure with its contacts, from its dynamic stiffness at one frequency.

The fixed-interface structure is the one whose kept degrees of freedom are held at rest. The number
of modes below ``s`` is that of the fixed-interface modes below ``s`` plus that of the negative
eigenvalues of the undamped ``Z(s)`` with the springs of the contacts (Wittrick and Williams). So
modes are counted exactly, and none is computed.
"""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from symhbm.model.condensation.pole_residue import PoleResidueFunction
from symhbm.model.structure import NearModes, weighted
from symhbm.numerics import ComplexArray, FloatArray, negative_eigenvalues

_NEAR_POLE = 1e-9
"""Relative distance from a fixed-interface frequency, a pole of Z, at which Z has no digits."""


class Condensed(Protocol):
    """Data of the modes of a condensed structure; see `CondensedModel`."""

    functions: dict[int, PoleResidueFunction]
    undamped: dict[int, PoleResidueFunction]

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom that are kept."""
        ...

    def fixed_in(self, harmonic: int) -> tuple[FloatArray, FloatArray]:
        """Fixed-interface natural frequencies and half widths (n,) [rad/s]."""
        ...

    def directions_in(self, harmonic: int) -> Any:
        """Directions of the contacts in a harmonic, sparse (n_contacts, n_dof)."""
        ...


def modes_near(
    model: Condensed, harmonic: int, frequency: float, spring: FloatArray, loss: FloatArray
) -> NearModes:
    """Modes near a harmonic of an angular ``frequency`` [rad/s].

    The sign of each detuning is exact, its size to first order and within the natural frequencies
    of the fixed-interface structure around it; that of a mode far away is halfway between them, its
    width that of the narrower of them.

    ``spring`` and ``loss`` (n_rows,) or (n_rows, n_rows) are the stiffness and the loss stiffness
    of the contacts in this harmonic [N/m].
    """
    exciting, n_dof = harmonic * frequency, model.n_dof
    fixed, fixed_width = model.fixed_in(harmonic)
    s = _beside_resonance(fixed, fixed_width, exciting)
    directions = model.directions_in(harmonic).toarray()
    stiffness, slope = (_of_kind(directions, part) for part in model.undamped[harmonic](s))
    stiffness = _hermitian(stiffness) + _contact_matrix(directions, spring)
    eigenvalues, vectors = np.linalg.eigh(stiffness)
    matrix = model.functions[harmonic](s)[0][:, :n_dof]
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


def modes_below(model: Condensed, harmonic: int, frequency: float, spring: FloatArray) -> int:
    """Number of modes below a harmonic of an angular ``frequency``, see `modes_near`."""
    fixed, _ = model.fixed_in(harmonic)
    s = _off_pole(fixed, harmonic * frequency)
    directions = model.directions_in(harmonic).toarray()
    stiffness = _hermitian(_of_kind(directions, model.undamped[harmonic](s)[0]))
    dynamic = stiffness + _contact_matrix(directions, spring)
    return negative_eigenvalues(dynamic) + int(np.count_nonzero(fixed < s))


def _of_kind(directions: NDArray, matrix: ComplexArray) -> NDArray:
    """A Hermitian matrix, real where the directions are: then it is so but for round-off."""
    return matrix if np.iscomplexobj(directions) else matrix.real.astype(float)


def _off_pole(fixed: FloatArray, s: float) -> float:
    """A frequency, or one beside it where it is a fixed-interface frequency, a pole of Z."""
    at_pole = np.abs(fixed / s - 1).min(initial=1.0) < _NEAR_POLE
    return s * (1 + 2 * _NEAR_POLE) if at_pole else s


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


def _hermitian(matrix: NDArray) -> NDArray:
    return (matrix + matrix.conj().T) / 2


def _contact_matrix(directions: NDArray, factors: FloatArray) -> NDArray:
    return weighted(directions.conj().T, factors) @ directions
