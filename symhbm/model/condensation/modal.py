"""A condensed structure by matrices: of what is kept and of the modes of its basis.

Their condensed stiffness is the sum over poles, to round-off: a motion in time that the sum
describes at frequencies ``p`` is that of these matrices.
"""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.matrices import Model
from symhbm.model.records import record
from symhbm.model.structure import Structure, restored
from symhbm.numerics import FloatArray

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
        upper = np.concatenate([masters[:, :, :n], pull], axis=2)
        lower = np.concatenate([push[:, :, :n], inside], axis=2)
        stiffness, damping, mass = np.concatenate([upper, lower], axis=1)
        forces = np.concatenate([masters[0, :, n:], push[0, :, n:]])
        return cls(stiffness, damping, (mass + mass.T) / 2, forces)

    def model(self, contacts: Structure) -> Model:
        """A model of these matrices, with the contacts of a structure of the masters."""
        matrices = {
            f"{name}_matrix": sp.csc_array(getattr(self, name))
            for name in ("mass", "damping", "stiffness")
        }
        names = ["contacts", "row_ends", "groups", "lumped", *contacts.contact_parameters]
        own = {name: getattr(contacts, name) for name in names}
        return restored(matrices | own, Model)
