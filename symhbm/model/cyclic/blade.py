"""The blade of a sector, for deviations of it."""

from typing import NamedTuple

from symhbm.model.records import record
from symhbm.numerics import FloatArray


@record
class Blade(NamedTuple):
    """The blade of a sector, for deviations of it.

    ``stiffness`` and ``mass`` (n_dof, n_dof), what of the matrices is the blade's; ``frequencies``
    (n_modes,), natural frequencies of the blade held at its root [Hz]; ``rows`` (n_modes, n_dof),
    coordinates [m kg^1/2] of these modes, of unit mass, from the motion.
    """

    stiffness: FloatArray
    mass: FloatArray
    frequencies: FloatArray
    rows: FloatArray
