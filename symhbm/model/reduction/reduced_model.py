"""A structure reduced by Craig and Bampton: a `Model` on some of its degrees of freedom."""

from typing import Any, NoReturn

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.contacts import renumbered
from symhbm.model.excitation import Excitation
from symhbm.model.matrices import Model
from symhbm.model.reduction.certificate import ReductionCertificate
from symhbm.model.reduction.component import Component, projected
from symhbm.model.reduction.deviations import force_as_felt
from symhbm.model.structure import PlacesAlone
from symhbm.numerics import FloatArray, FourierBasis


class ReducedModel(Model):
    """A `Model` on the degrees of freedom that `craig_bampton` keeps, with matrices of its own.

    Forces are those of the whole structure, on any of its degrees of freedom.

    Attributes
    ----------
    dofs : (n_dof,)
        The degrees of freedom that are kept, as the whole structure numbers them: those of the
        boundary, then one for each mode.
    basis : (n_whole, n_dof)
        Motion of the whole structure by that of the kept degrees of freedom.
    fixed_frequencies : (n_modes,)
        Natural frequencies with the boundary held [Hz].
    modal_rows : (n_modes, n_dof)
        Coordinates [m kg^1/2] of the modes with the boundary held, of unit mass, from the motion.
    certificate
        How exact it is, see `ReductionCertificate`.
    """

    dofs: NDArray[np.intp]
    basis: FloatArray
    fixed_frequencies: FloatArray
    modal_rows: FloatArray
    certificate: ReductionCertificate

    def __init__(
        self, structure: Model, dofs: NDArray[np.intp], component: Component, n_right: int = 0
    ):
        basis = component.basis
        self._store(lumped=False, dofs=dofs, basis=basis, kept=dofs, _lift=basis)
        given = structure.places
        self._store(places=None if given is None else given.of(dofs), reduced_from=len(basis))
        self._store(beneath=PlacesAlone(len(basis), places=given))
        natural = np.sqrt(np.maximum(component.squares, 0.0)) / (2 * np.pi)
        self._store(fixed_frequencies=natural, modal_rows=component.modal_rows)
        if structure.damping is not None:
            self._store(damping=structure.damping.of_at_most(len(dofs) - n_right))
        names = "damping_matrix" if structure.damping is None else "coriolis_matrix"
        for name in ("mass_matrix", names, "stiffness_matrix"):
            if (matrix := getattr(structure, name)) is not None:
                self._put_matrix(name, projected(matrix, basis))
        self._store(speed=structure.speed)
        position = {int(dof): i for i, dof in enumerate(dofs)}
        self._store(
            contacts=renumbered(structure.contacts, position.__getitem__),
            row_ends=renumbered(structure.row_ends, position.__getitem__),
            groups=structure.groups,
            **{name: getattr(structure, name) for name in structure.contact_parameters},
        )
        self._store(outputs={n: out.of(self.seen(out)) for n, out in structure.outputs.items()})

    stored_as = Model

    def fields(self) -> dict[str, Any]:
        """What makes a `Model` of the same matrices, places and speed."""
        names = "damping", "damping_matrix", "coriolis_matrix", "lumped", "speed", "places"
        chosen = {"mass_matrix", "stiffness_matrix", *names}
        return {name: value for name, value in super().fields().items() if name in chosen}

    def _put_matrix(self, name: str, matrix: FloatArray) -> None:
        self._store(**{name: sp.csc_array(matrix)})

    def with_contacts(self, **groups: Any) -> NoReturn:
        """Raise TypeError: it is reduced to the contacts that it has."""
        raise TypeError(
            "with_contacts: expected a whole structure, this one is reduced to its contacts; "
            "reduce the structure with the others"
        )

    def as_felt(self, excitation: Excitation, basis: FourierBasis) -> Excitation:
        """An excitation as the kept degrees of freedom feel it."""
        return force_as_felt(self, excitation, basis)

    @property
    def remark(self) -> str:
        """What else to tell of it in a line."""
        return (
            f"reduced from {self.n_whole} degrees of freedom, "
            f"{len(self.fixed_frequencies)} modes with what is kept held, "
            f"{self.certificate!r}"
        )
