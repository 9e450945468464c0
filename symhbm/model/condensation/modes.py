"""Modes of a condensed structure with its contacts, as few numbers of its dynamic stiffness tell.

At a frequency ``s`` the undamped ``Z(s)`` with the springs of the contacts has one negative
eigenvalue per mode below ``s`` beyond those that the structure has there with the kept degrees of
freedom held (Wittrick and Williams): modes are counted exactly, and none is computed.
"""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from symhbm.model.condensation.pole_residue import PoleResidueFunction
from symhbm.model.structure import NearModes
from symhbm.numerics import FloatArray, negative_eigenvalues

_BESIDE = 1e-9
"""Distance from a natural frequency of the held structure, relative, at which Z has no digits."""


class Condensed(Protocol):
    """What modes are found from; see `CondensedModel`."""

    seen: Any
    held_width: FloatArray
    matrices: dict[int, PoleResidueFunction]
    undamped: dict[int, PoleResidueFunction]

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom that are kept."""
        ...

    @property
    def directions(self) -> Any:
        """Directions of the contacts, sparse (n_contacts, n_dof)."""
        ...


def modes_near(
    model: Condensed, harmonic: int, frequency: float, spring: FloatArray, loss: FloatArray
) -> NearModes:
    """Modes near a harmonic of an angular ``frequency`` [rad/s].

    The sign of each detuning is exact, its size to first order and within the natural frequencies
    of the held structure around it; that of a mode far away is halfway between them, its width
    that of the narrower of them.

    ``spring`` and ``loss`` (n_contacts,) are the stiffness of the contacts in this harmonic and
    what they take out of it [N/m].
    """
    exciting, n_dof = harmonic * frequency, model.n_dof
    held, held_width = model.seen.held, model.held_width
    s = _beside(model, exciting)
    stiffness, slope = (part.real.astype(float) for part in model.undamped[harmonic](s))
    directions = model.directions.toarray()
    eigenvalues, vectors = np.linalg.eigh(_symmetric(stiffness) + _square(directions, spring))
    damping = _symmetric(model.matrices[harmonic](s)[0].imag[:, :n_dof])
    damping = damping + _square(directions, loss)
    # The derivative of Z by the frequency is that of the inertia of a motion, interior included.
    inertia = np.maximum(-_each(vectors, slope), 1e-300)
    below = int(np.count_nonzero(held < s))
    whole = len(held) + n_dof
    near = np.zeros(whole, dtype=bool)
    near[below : below + n_dof] = True
    # Each mode lies between two of the held structure.
    none = np.full(n_dof, np.inf)
    lowest = np.concatenate([-none, held - exciting])
    highest = np.concatenate([held - exciting, none])
    width = np.minimum(*(np.concatenate(w) for w in ((none, held_width), (held_width, none))))
    between = np.isfinite(highest - lowest)
    detuning = np.zeros(whole)
    detuning[between] = (lowest[between] + highest[between]) / 2
    detuning[near] = eigenvalues / inertia + s - exciting
    width[near] = np.abs(_each(vectors, damping)) / inertia
    shapes = vectors * np.sqrt(2 * s / inertia)
    return NearModes(np.clip(detuning, lowest, highest), width, near, shapes)


def modes_below(model: Condensed, harmonic: int, frequency: float, spring: FloatArray) -> int:
    """Number of modes below a harmonic of an angular ``frequency``, see `modes_near`."""
    s = _regular(model, harmonic * frequency)
    stiffness = _symmetric(model.undamped[harmonic](s)[0].real)
    whole = stiffness + _square(model.directions.toarray(), spring)
    return negative_eigenvalues(whole) + int(np.count_nonzero(model.seen.held < s))


def _regular(model: Condensed, s: float) -> float:
    """A frequency, or one beside it where the held structure resonates and Z is infinite."""
    beside = np.abs(model.seen.held / s - 1).min(initial=1.0) < _BESIDE
    return s * (1 + 2 * _BESIDE) if beside else s


def _beside(model: Condensed, s: float) -> float:
    """A frequency, or one beside a resonance of the held structure by half the width of that.

    Nearer to it ``Z`` without damping grows beyond all bounds and that with damping does not:
    widths of modes there would be none.
    """
    held = model.seen.held
    if not held.size:
        return s
    place = np.argmin(np.abs(held - s))
    nearest, half_width = held[place], model.held_width[place]
    to_next = np.min(np.abs(held[held != nearest] - nearest), initial=np.inf)
    distance = max(min(half_width, to_next / 4), 2 * _BESIDE * s)
    if abs(s - nearest) >= distance:
        return s
    return float(nearest + np.copysign(distance, s - nearest))


def _each(vectors: FloatArray, matrix: FloatArray) -> FloatArray:
    """The quadratic form of each column."""
    return np.sum(vectors * (matrix @ vectors), axis=0)


def _symmetric(matrix: NDArray) -> FloatArray:
    return (matrix + matrix.T) / 2


def _square(directions: FloatArray, factors: FloatArray) -> FloatArray:
    return (directions.T * factors) @ directions
