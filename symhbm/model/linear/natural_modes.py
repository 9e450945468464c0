"""Natural frequencies and modes of structures, of sectors by nodal diameter, and their band."""

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.linalg import eigh
from scipy.sparse import diags_array
from scipy.sparse.linalg import eigsh

from symhbm.model.linear.eigenmodes import gyroscopic_part, lowest_gyroscopic, lowest_modes
from symhbm.numerics import DENSE_LIMIT, RADIANS, ComplexArray, FloatArray

_GROWING = (
    "stiffness_matrix: expected a positive semidefinite one, or Coriolis forces that hold the "
    "motion; one grows, and has no natural frequency"
)


def natural_modes_of(
    structure: Any, nodal_diameter: int | None, count: int, stuck: bool = False
) -> tuple[FloatArray, ComplexArray]:
    """The lowest natural frequencies (count,) [Hz], ascending, and modes (n_whole, count).

    Modes are of unit mass, of one sector where it is one. Contacts are open, or ``stuck``. What of
    the damping matrix takes no power, Coriolis forces, counts. Raises ValueError where some motion
    has neither mass nor stiffness, or grows.
    """
    mass, damping, stiffness = structure.matrices(nodal_diameter)
    if stuck:
        directions = structure.directions_of(nodal_diameter)
        springs = diags_array(structure.stuck_springs)
        stiffness = stiffness + directions.conj().T @ springs @ directions
    gyroscopic = gyroscopic_part(damping)
    if gyroscopic is None:
        squares, shapes = lowest_modes(stiffness, mass, count, _GROWING)
        natural = np.sqrt(np.maximum(squares, 0.0))
    else:
        natural, shapes = lowest_gyroscopic(stiffness, gyroscopic, mass, count)
    return natural / RADIANS, structure.expanded(shapes, nodal_diameter)


_BELOW, _ABOVE = 0.2, 1.2
_ZERO = 1e-6
"""Share of the highest natural frequency below which one is that of a free motion."""
_LOWEST = 12
"""Natural frequencies of a large structure that are looked at: more than it has free motions."""


def natural_band(models: Sequence[Any]) -> tuple[float, float]:
    """Band [Hz] from below all natural frequencies without contacts to above all with them stuck.

    ``models`` are of one structure with different parameters, the band holds the resonances of all.
    A condensed one has the band that it was condensed for.
    Raises ValueError for a structure without a natural frequency, or with a motion without inertia.
    """
    if models[0].frequency is not None:
        return models[0].frequency
    if models[0].n_dof > DENSE_LIMIT:
        warnings.warn(
            f"frequency=None: a band that holds all of more than {models[0].n_dof:,} resonances "
            "takes long to follow; give a band in Hz, and condense the structure for it by "
            "symhbm.condense",
            stacklevel=4,
        )
    lowest, highest = zip(*map(_extremes, models), strict=True)
    return float(_BELOW * min(lowest)), float(_ABOVE * max(highest))


def _extremes(model: Any) -> tuple[float, float]:
    """Lowest natural frequency that is not zero and highest one [Hz]."""
    directions = model.directions
    springs = directions.T @ sp.diags_array(model.stiffest_springs) @ directions
    stuck = model.stiffness_matrix + springs
    try:
        free = _squares(model.stiffness_matrix, model.mass_matrix)
        held = _squares(stuck, model.mass_matrix)
    except (np.linalg.LinAlgError, RuntimeError) as error:
        raise ValueError(
            "frequency=None: expected a structure whose mass matrix is positive definite and whose "
            f"natural frequencies can be computed ({error}); give a band in Hz"
        ) from error
    highest = held.max()
    moving = np.concatenate([free, held])
    moving = moving[moving > _ZERO**2 * highest]
    if highest <= 0 or not moving.size:
        raise ValueError(
            "frequency=None: expected a structure with a natural frequency above zero, "
            "this one has no stiffness; give a band in Hz"
        )
    return np.sqrt(float(moving.min())) / (2 * np.pi), np.sqrt(float(highest)) / (2 * np.pi)


def _squares(stiffness: Any, mass: Any) -> np.ndarray:
    """Squares of natural angular frequencies: all, or the lowest and the highest of many."""
    stiffness = 0.5 * (stiffness + stiffness.T)
    if mass.shape[0] <= DENSE_LIMIT:
        return eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True)
    stiffness, mass = stiffness.tocsc(), mass.tocsc()
    highest = np.max(eigsh(stiffness, 1, mass, which="LM", return_eigenvectors=False))
    # A little below zero the shifted matrix is regular, free motions or not.
    shift = -1e-9 * highest
    low = eigsh(stiffness, _LOWEST, mass, sigma=shift, which="LM", return_eigenvectors=False)
    return np.append(low, highest)
