"""A large structure condensed to the few degrees of freedom that are kept."""

from collections.abc import Iterable, Mapping
from hashlib import sha256
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symhbm.model.condensation.partition import Interior, names_of
from symhbm.model.condensation.pole_residue import (
    ModalMatrices,
    PoleResidueFunction,
    PoleSum,
    modes_below,
    modes_near,
)
from symhbm.model.condensation.reduced_basis import Certificate, Reduced
from symhbm.model.cyclic import components, phasors
from symhbm.model.frame import restored
from symhbm.model.linear import LowRankSum, NearModes
from symhbm.model.matrices import Model
from symhbm.model.outputs import Output
from symhbm.model.places import Place, Places, number_of
from symhbm.model.records import NotStoredError, copied, record
from symhbm.model.structure import PlacesAlone, Structure
from symhbm.numerics import RADIANS, ComplexArray, FloatArray, FourierBasis, check

_INSIDE = 1e-12
"""Share of a force outside of the known patterns that is round-off."""
_MATRICES = "mass_matrix", "damping_matrix", "stiffness_matrix"


@record
class CondensedStiffness(NamedTuple):
    """Dynamic stiffness of a structure at the kept degrees of freedom, with ``p = i n omega``.

    ``matrix``, ``[Z, G]`` (n_dof, n_dof + n_patterns): forces by motions, and by force patterns;
    ``undamped``, Z (n_dof, n_dof) without damping; ``static``, ``[Z, G]`` at rest;
    ``fixed_frequencies`` (n,) fixed-interface natural frequencies [rad/s]; ``patterns``
    (n_dof of the structure, n_patterns), orthonormal, 0 where kept; ``modal``, the same by matrices
    for motions in time, None where they are large.
    """

    matrix: PoleSum
    undamped: PoleSum
    static: FloatArray
    fixed_frequencies: FloatArray
    patterns: NDArray
    modal: ModalMatrices | None = None

    @classmethod
    def of(
        cls, reduced: Reduced, interior: Interior, patterns: NDArray, between: bool = False
    ) -> "CondensedStiffness":
        """That of a reduced interior; ``between`` tells where it is exact, see `ModalMatrices`."""
        modal = None if reduced.modal is None else reduced.modal._replace(between=between)
        sums = reduced.whole, reduced.undamped, interior.at_rest
        return cls(*sums, reduced.fixed_frequencies, patterns, modal)

    @property
    def fixed_widths(self) -> FloatArray:
        """Half widths of the fixed-interface resonances, (n,) [rad/s]."""
        poles = self.matrix.poles
        nearest = [np.argmin(np.abs(poles - 1j * natural)) for natural in self.fixed_frequencies]
        return np.abs(poles[np.array(nearest, dtype=int)].real)

    def conjugate(self) -> "CondensedStiffness":
        """That of the wave of the other sense, whose matrices are conjugate."""
        return self._replace(
            matrix=self.matrix.conjugate(),
            undamped=self.undamped.conjugate(),
            static=self.static.conjugate(),
            patterns=self.patterns.conj(),
            modal=None,
        )


class CondensedModel(Structure):
    """A `Model` condensed by `condense`: its contacts, on the degrees of freedom that are kept.

    Contact parameters stay free, mass, damping and stiffness are those of the structure.

    Attributes
    ----------
    dofs : (n_dof,)
        The degrees of freedom that are kept, as the structure numbers them, ascending; last those
        that displacements are in place of.
    displacements_kept : (n_displacements,)
        Numbers of the displacements of contacts that are kept, if those are.
    frequency
        Band of excitation frequencies [Hz] (lowest, highest).
    harmonics
        Harmonics of it that responses may have.
    certificate
        How exact it is, see `symhbm.model.condensation.reduced_basis.Certificate`.
    """

    WITHOUT_MATRICES = (
        "expected one of a structure with matrices, this is condensed, exactly over its band "
        "alone; symhbm.craig_bampton reduces the whole structure to one with matrices, and a "
        "HarmonicBalance of the attribute structure of its model is of the whole one"
    )
    bends, made_by, kind = True, "condense", "structure"
    stored = "dofs", "frequency", "harmonics", "condensed", "certificate", "digest", "places"
    dofs: NDArray[np.intp]
    displacements_kept: NDArray[np.intp] = np.zeros(0, dtype=np.intp)
    frequency: tuple[float, float]
    harmonics: tuple[int, ...]
    certificate: Certificate

    def __init__(
        self,
        structure: Model,
        dofs: NDArray[np.intp],
        frequency: tuple[float, float],
        harmonics: tuple[int, ...],
        condensed: CondensedStiffness,
        certificate: Certificate,
        displacements: NDArray[np.intp],
    ):
        self._check_names(structure.groups.owners)
        position = {int(dof): i for i, dof in enumerate(dofs)}
        self._store(**structure.groups.renumbered(position.__getitem__).attributes)
        self._store(places=places_of(structure, structure.places, dofs, displacements))
        self._store(beneath=structure, displacements_kept=displacements)
        # The layout in memory decides how sums are rounded: it is that of what archives hold.
        given = dict(condensed=copied(condensed), certificate=copied(certificate))
        self._store(digest=self._digest(structure, condensed.patterns))
        self._set_condensed(dofs=dofs, frequency=frequency, harmonics=harmonics, **given)

    def _set_condensed(self, dofs: NDArray[np.intp], **given: Any) -> None:
        """Store what tells the condensed structure, and the functions of the frequency of it."""
        self._keep(dofs, masters=dofs, **given)
        self._bind()

    def _keep(self, dofs: NDArray[np.intp], **given: Any) -> None:
        """Store which degrees of freedom are kept, and what is ``given`` beside."""
        self._store(**given, dofs=dofs, _n_dof=len(dofs), lumped=False)
        rows = self.n_whole + self.displacements_kept
        self._store(kept=np.concatenate([dofs[: self.n_watched], rows]))

    def _in(self, harmonic: int) -> CondensedStiffness:
        """The condensed stiffness of a harmonic, of a sector that of its wave."""
        if (n := self.wave(harmonic)) is None:
            return self.condensed
        n_sectors = self.interfaces.n_sectors
        return self.waves[n] if 2 * n <= n_sectors else self.waves[n_sectors - n].conjugate()

    def _bind(self) -> None:
        """The functions of the frequency of each harmonic, and the resonances of what is held."""
        moving = {n: self._in(n) for n in self.harmonics if n}
        bands = {n: self.band(n, self.frequency) for n in moving}
        inertia = next((of.undamped.polynomial[2].real for of in moving.values()), None)
        self._store(
            pole_residues={n: PoleResidueFunction(of.matrix, bands[n]) for n, of in moving.items()},
            undamped={n: PoleResidueFunction(of.undamped, bands[n]) for n, of in moving.items()},
            fixed={n: (of.fixed_frequencies, of.fixed_widths) for n, of in moving.items()},
            inertia=inertia,
            modal=self._in(0).modal,
        )

    def fields(self) -> dict[str, Any]:
        """What makes it again, without the whole structure."""
        if len(self.displacements_kept):
            raise NotStoredError(
                "archives do not hold displacements of contacts; condense the structure again, or "
                "compute on with the problem that gave this dataset"
            )
        return super().fields()

    @classmethod
    def of_fields(cls, **fields: Any) -> "CondensedModel":
        """The condensed structure of its `fields`, without the whole one and contacts."""
        model = object.__new__(cls)
        model._store(beneath=PlacesAlone(len(fields["condensed"].patterns)))
        model._set_condensed(**fields)
        model._set_contacts({})
        return model

    digest: str
    condensed: CondensedStiffness
    waves: Mapping[int, CondensedStiffness]
    sector: Any = None
    pole_residues: dict[int, PoleResidueFunction]
    undamped: dict[int, PoleResidueFunction]
    fixed: dict[int, tuple[FloatArray, FloatArray]]
    """Fixed-interface natural frequencies and half widths by harmonic, (n,) [rad/s]."""

    @staticmethod
    def band(harmonic: int, frequency: tuple[float, float]) -> tuple[float, float]:
        """Verified band of one harmonic [rad/s]: iterations may leave the band of the results."""
        low, high = frequency
        return RADIANS * harmonic * 0.95 * low, RADIANS * harmonic * 1.05 * high

    @property
    def structure(self) -> Any:
        """The whole structure or sector, with the contact parameters as they are here.

        TypeError for one from an archive, which has a checksum of it alone; see `of_structure`.
        """
        if isinstance(self.beneath, PlacesAlone):
            raise TypeError(
                f"structure: this condensed {self.kind} was rebuilt from an archive, which does "
                "not hold the whole one; give it as structure= of symhbm.datasets.recover"
            )
        whole = self.beneath if self.sector is None else self.sector
        return whole.with_parameters(**self.parameters)

    def of_structure(self, structure: Any) -> "CondensedModel":
        """The same with the whole structure that it was condensed from, given again.

        TypeError unless it is a Model, and with displacements of contacts; ValueError where it is
        another one.
        """
        check.instance("structure", structure, Model, "a Model")
        if len(self.displacements_kept):
            raise TypeError(
                "structure: expected None where displacements are kept, it has its structure"
            )
        known = structure.n_dof == self.n_whole
        if not known or self._digest(structure, self.condensed.patterns) != self.digest:
            raise ValueError("structure: expected that which was condensed, its matrices differ")
        same = *_MATRICES, "lumped", "places"
        whole = self.groups.renumbered(self.dofs.tolist().__getitem__).attributes
        whole |= {name: getattr(structure, name) for name in same}
        return self._copy(beneath=restored(whole, Model))

    def number_of(self, place: Place) -> int:
        """The number of a place in the whole structure, which forces act on."""
        if isinstance(place, str) and self.beneath.places is None:  # of an archive
            return int(self.dofs[number_of(self.places, place, self.n_whole)])
        return super().number_of(place)

    def seen(self, output: Output) -> Any:
        """Rows of an output of the whole structure by what is kept; ValueError for others."""
        rows, known = super().seen(output), self.masters
        if self.interfaces is not None:  # what else moves where displacements are kept differs
            known = known[: self.n_watched]
        others = np.setdiff1d(np.unique(rows.nonzero()[1]), known)
        beyond = rows[:, others]
        if others.size and np.abs(beyond.data).max() > _INSIDE * np.abs(rows.data).max():
            dof = others[0] if self.interfaces is None else self.interfaces.others[others[0]]
            raise ValueError(
                f"outputs[{output.name!r}]: expected degrees of freedom that are kept, {dof} is "
                "not; give the outputs to the structure in front of condensing it, or places="
            )
        return rows[:, self.masters]

    @property
    def n_watched(self) -> int:
        """Number of degrees of freedom that are kept, displacements apart."""
        return self.n_dof - len(self.displacements_kept)

    @staticmethod
    def _digest(structure: Model, patterns: NDArray) -> str:
        """Checksum of the matrices of the whole structure and of the known force patterns."""
        matrices = [array for name in _MATRICES for array in arrays_of(getattr(structure, name))]
        return checksum([patterns, *matrices, np.array(structure.loss_factor)])

    def dynamic_stiffness(
        self, harmonic: int, frequency: float
    ) -> tuple[ComplexArray, ComplexArray]:
        """Condensed dynamic stiffness of a harmonic and its derivative by the frequency."""
        value, slope = self.linear_forces(harmonic, frequency)
        return value[:, : self.n_dof], slope[:, : self.n_dof]

    def linear_forces(self, harmonic: int, frequency: float) -> tuple[ComplexArray, ComplexArray]:
        """``[Z, G]`` of one harmonic and its derivative by the frequency."""
        if harmonic == 0:
            static = self._in(0).static.astype(complex)
            return static, np.zeros_like(static)
        value, slope = self.pole_residues[harmonic](harmonic * frequency)
        return value, harmonic * slope

    def as_felt(self, excitation: Any, basis: FourierBasis) -> Any:
        """An excitation on the degrees of freedom of the whole structure, which archives lack."""
        felt = self.beneath.as_felt(excitation, basis)
        return felt.on(self.beneath) if felt.of_matrices else felt

    def forces_curvature(self, harmonic: int, frequency: float) -> ComplexArray:
        """Second derivative of `linear_forces` by the frequency, from the same poles."""
        if harmonic == 0:
            return np.zeros_like(self.linear_forces(0, frequency)[0])
        return harmonic**2 * self.pole_residues[harmonic].curvature(harmonic * frequency)

    def _split(
        self, part: FloatArray, harmonic: int, largest: float
    ) -> tuple[FloatArray, FloatArray]:
        """One harmonic of a force: on kept degrees of freedom, and shares of known patterns.

        ValueError where it is no sum of known patterns and forces on kept degrees of freedom.
        """
        inside, _ = super()._split(part, harmonic, largest)
        own = inside[self.masters]
        inside = inside.copy()
        inside[self.masters] = 0.0
        patterns, wave = self._in(harmonic).patterns, self.wave(harmonic)
        share = patterns.conj().T @ phasors(inside)
        rest = np.abs(phasors(inside) - patterns @ share)
        if rest.max() > _INSIDE * largest:
            dof = int(rest.argmax() if wave is None else self.interfaces.others[rest.argmax()])
            where = "" if wave is None else f" in harmonic {harmonic}"
            raise ValueError(
                f"excitation: the condensed {self.kind} does not know this force (on degree of "
                f"freedom {dof}{where}); give it to condense, alone or in a list"
            )
        return own, components(share, harmonic)

    def modes_below(self, harmonic: int, frequency: float, springs: FloatArray) -> int:
        """Number of natural frequencies below a harmonic, counted exactly."""
        return modes_below(self, harmonic, frequency, springs)

    def modes_near(
        self, harmonic: int, frequency: float, springs: FloatArray, losses: FloatArray
    ) -> NearModes:
        """The modes near a harmonic, from the dynamic stiffness at one frequency."""
        return modes_near(self, harmonic, frequency, springs, losses)

    @property
    def remark(self) -> str:
        """What else to tell of it in a line."""
        low, high = self.frequency
        return (
            f"kept of {self.n_whole} degrees of freedom, "
            f"{low:g} to {high:g} Hz, harmonics {self.harmonics}, "
            f"linear responses exact to {self.certificate.error:.1e}, with friction to "
            f"{self.certificate.friction_bound:.1e}; the largest response is that of these "
            f"{self.n_dof}"
        )


def places_of(
    structure: Structure, places: Places | None, dofs: NDArray[np.intp], rows: NDArray[np.intp]
) -> Places | None:
    """Places of ``dofs``, the last of which are displacements ``rows`` of contacts."""
    if places is None or not len(rows):
        return None if places is None else places.of(dofs)
    coordinates = None
    if places.coordinates is not None:
        owner = {int(row): j for j, of in enumerate(structure.groups.rows) for row in of}
        coordinates = structure.contact_coordinates[[owner[row] for row in rows.tolist()]]
    watched = places.of(dofs[: len(dofs) - len(rows)])
    return watched.beside(rows, names_of(structure, rows), coordinates)


def checksum(arrays: Iterable[NDArray]) -> str:
    """Checksum of arrays, one after the other."""
    digest = sha256()
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def arrays_of(matrix: Any) -> tuple[NDArray, ...]:
    """All numbers of a matrix."""
    if isinstance(matrix, LowRankSum):
        return matrix.arrays
    return matrix.indptr, matrix.indices, matrix.data
