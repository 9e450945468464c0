"""Natural frequencies and modes of structures, and of sectors by nodal diameter."""

import numpy as np
from scipy.sparse import diags_array

from symhbm.model.linear.eigenmodes import gyroscopic_part, lowest_gyroscopic, lowest_modes
from symhbm.model.structure import Structure
from symhbm.numerics import RADIANS, ComplexArray, FloatArray

_GROWING = (
    "stiffness_matrix: expected a positive semidefinite one, or Coriolis forces that hold the "
    "motion; one grows, and has no natural frequency"
)


def natural_modes_of(
    structure: Structure, nodal_diameter: int | None, count: int, stuck: bool = False
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
