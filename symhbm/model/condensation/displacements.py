"""A structure in coordinates that displacements of its contacts are among."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.contacts import Weights
from symhbm.model.cyclic import Sector
from symhbm.model.linear import LowRankSum, RelativeCoordinates
from symhbm.model.matrices import Model
from symhbm.model.structure import Matrices, Structure, restored
from symhbm.numerics import FloatArray


class RelativeModel(Model):
    """A `Model` whose motion is ``x = T z``: displacements of contacts are some of the ``z``.

    Its matrices are ``T^T M T``, and so on; forces are those on the structure ``beneath``.
    """

    @property
    def contact_coordinates(self) -> FloatArray:
        """Where contacts are, (n_contacts, 3) [m]."""
        return self.beneath.contact_coordinates


def in_displacements(
    structure: Model | Sector, watched: NDArray[np.intp]
) -> tuple[Model | Sector, RelativeCoordinates]:
    """A structure in displacements of its contacts, with ``watched`` degrees of freedom as before.

    Masters are numbered as its degrees of freedom are. Raises ValueError where displacements depend
    on each other in one wave around a disk, and do not in another.
    """
    if isinstance(structure, Sector):
        held = np.searchsorted(structure.kept, watched)
        coordinates = RelativeCoordinates.of(structure.directions_of(1), held)
        return structure.along_contacts(coordinates), coordinates
    coordinates = RelativeCoordinates.of(structure.directions, watched)
    change = coordinates.change(structure.directions)
    rows = sp.csr_array(structure.directions @ change)
    rows.data[np.abs(rows.data) < 1e-14 * np.abs(rows.data).max(initial=0.0)] = 0.0
    rows.eliminate_zeros()
    parts = np.split(rows.indices, rows.indptr[1:-1]), np.split(rows.data, rows.indptr[1:-1])
    ends = [_ends(*part) for part in zip(*parts, strict=True)] if structure.n_contacts else []
    matrices = {name: _congruent(getattr(structure, name), change) for name in Matrices._fields}
    names = ["groups", "places", "damping", *structure.contact_parameters]
    values = {name: getattr(structure, name) for name in names}
    of_contacts = [tuple(ends[row] for row in rows) for rows in structure.contact_rows]
    values |= dict(
        row_ends=tuple(ends),
        contacts=tuple(each[0] if len(each) == 1 else each for each in of_contacts),
        lumped=False,
        beneath=structure,
        _lift=change,
    )
    return restored(matrices | values, RelativeModel), coordinates


def names_of(structure: Structure, rows: NDArray[np.intp]) -> list[str]:
    """What displacements ``rows`` of contacts are called, by contact and by direction."""
    names = {}
    for group in structure.groups:
        for contact, of_contact in zip(group.contacts, group.rows, strict=True):
            for row, direction in zip(of_contact, group.law.directions, strict=True):
                several = f", {direction}" if len(of_contact) > 1 else ""
                names.setdefault(int(row), f"displacement of contact {contact}{several}")
    return [names[row] for row in rows.tolist()]


def _ends(dofs: NDArray, weights: NDArray) -> Any:
    """A displacement by coordinates: mostly one of them alone."""
    order = np.argsort(dofs)
    dofs, weights = dofs[order].tolist(), weights[order].tolist()
    return (dofs[0],) if weights == [1.0] else Weights(tuple(dofs), tuple(weights))


def _congruent(matrix: Any, change: Any) -> Any:
    """``T^T A T``."""
    if isinstance(matrix, LowRankSum):
        factors = change.T @ matrix.left, change.T @ matrix.right
        return LowRankSum(_congruent(matrix.sparse, change), *factors)
    return sp.csc_array(change.T @ matrix @ change)
