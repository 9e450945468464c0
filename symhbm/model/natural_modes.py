"""Natural frequencies and modes of structures, and of sectors by nodal diameter."""

import numpy as np
from scipy.sparse import diags_array

from symhbm.model.eigenmodes import lowest_modes
from symhbm.model.structure import Structure
from symhbm.numerics import RADIANS, ComplexArray, FloatArray


def natural_modes_of(
    structure: Structure, nodal_diameter: int | None, count: int, stuck: bool = False
) -> tuple[FloatArray, ComplexArray]:
    """The lowest natural frequencies (count,) [Hz], ascending, and modes (n_whole, count).

    Modes are of unit mass, of one sector where it is one. Contacts are open, or ``stuck``.
    Raises ValueError where some motion has neither mass nor stiffness.
    """
    mass, _, stiffness = structure.matrices(nodal_diameter)
    if stuck:
        directions = structure.directions_of(nodal_diameter)
        springs = diags_array(structure.stuck_springs)
        stiffness = stiffness + directions.conj().T @ springs @ directions
    squares, shapes = lowest_modes(stiffness, mass, count)
    return np.sqrt(np.maximum(squares, 0.0)) / RADIANS, structure.expanded(shapes, nodal_diameter)
