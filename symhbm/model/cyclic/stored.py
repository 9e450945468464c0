"""What archives hold of a sector beside its matrices."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.model.cyclic.influence import Coupling
from symhbm.model.cyclic.waves import Interfaces
from symhbm.model.places import DIRECTIONS, Places
from symhbm.numerics import FloatArray


class StoredPlaces(NamedTuple):
    """Places by numbers: ``direction`` and ``label`` (n_dof,) are those of lists of texts."""

    node: NDArray[np.int64]
    direction: NDArray[np.intp]
    label: NDArray[np.intp]
    coordinates: FloatArray | None

    def places(self, labels: list[str]) -> Places:
        """The places, given their labels."""
        direction, label = np.array(DIRECTIONS)[self.direction], np.array(labels)[self.label]
        return Places(self.node, direction, self.coordinates, label)


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


class SectorShape(NamedTuple):
    """How a sector hangs together; ``known`` (n_dof,), where motions can be turned."""

    interfaces: Interfaces
    influences: tuple[Coupling, ...]
    known: NDArray[np.bool_]
    places: StoredPlaces | None
    blade: Blade | None = None


RECORDS_OF_SECTOR: tuple[Any, ...] = (SectorShape, Blade, StoredPlaces, Interfaces, Coupling)


def stored_places(places: Places | None) -> tuple[StoredPlaces | None, list[str]]:
    """Places by numbers, and the labels that they name."""
    if places is None:
        return None, []
    labels, label = np.unique(places.label, return_inverse=True)
    direction = np.array([DIRECTIONS.index(text) for text in places.direction.tolist()])
    return StoredPlaces(places.node, direction, label, places.coordinates), labels.tolist()
