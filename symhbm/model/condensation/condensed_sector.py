"""A sector of a disk condensed, wave by wave, to the few degrees of freedom that are kept."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from symhbm.model.condensation.condensed_model import (
    CondensedModel,
    CondensedStiffness,
    arrays_of,
    checksum,
    places_of,
)
from symhbm.model.condensation.partition import Interior
from symhbm.model.condensation.pole_residue import PoleSum
from symhbm.model.condensation.reduced_basis import Certificate, Reduced, reduce
from symhbm.model.cyclic import Sector, phasors
from symhbm.model.excitation import Excitation, sector_order
from symhbm.model.records import copied
from symhbm.model.structure import PlacesAlone
from symhbm.numerics import ComplexArray, FourierBasis, check


class CondensedSector(CondensedModel):
    """A `Sector` condensed by `condense`: its contacts, on the degrees of freedom that are kept.

    Each harmonic has the condensed stiffness of its own wave around the disk; waves of ``n`` and of
    ``N - n`` nodal diameters share one. Beside the attributes of a `CondensedModel`:

    Attributes
    ----------
    waves
        By nodal diameters, 0 to N / 2, the condensed stiffness.
    certificates
        How exact each is; ``certificate`` has the largest errors of all.
    """

    WITHOUT_MATRICES, kind = Sector.WITHOUT_MATRICES, "sector"
    stored = "dofs", "frequency", "harmonics", "waves", "certificates", "digest"

    certificates: Mapping[int, Certificate]
    sector: Sector

    def __init__(
        self,
        structure: Sector,
        dofs: NDArray[np.intp],
        frequency: tuple[float, float],
        harmonics: tuple[int, ...],
        waves: Mapping[int, CondensedStiffness],
        certificates: Mapping[int, Certificate],
        displacements: NDArray[np.intp],
        digest: str | None = None,
    ):
        self._check_names(structure.groups.owners)
        # The layout in memory decides how sums are rounded: it is that of what archives hold.
        waves = {n: copied(wave) for n, wave in waves.items()}
        self._store(**structure.groups.attributes, displacements_kept=displacements)
        self._store(frequency=frequency, harmonics=harmonics, beneath=structure.structure)
        self._store(waves=waves, certificates=certificates, certificate=_together(certificates))
        places = places_of(structure, structure.structure.places, dofs, displacements)
        self._store(digest=digest or _digest(structure), interfaces=structure.interfaces)
        self._keep(dofs, places=places, masters=np.searchsorted(structure.kept, dofs))
        self._set_sector(structure)

    def _set_sector(self, sector: Sector) -> None:
        self._store(sector=sector, order=sector.order)
        if sector.order is not None:
            self._bind()

    def under(self, excitation: Excitation) -> "CondensedSector":
        """The sector as an engine order moves it; ValueError for one it was not condensed for."""
        return self.in_wave(sector_order(excitation, self.sector.n_sectors))

    def in_wave(self, order: int) -> "CondensedSector":
        """The sector under an engine order."""
        if order == self.order:
            return self
        sector = self.sector.in_wave(order)
        for n in self.harmonics:
            wave = sector.wave(n)
            if min(wave, sector.n_sectors - wave) not in self.waves:
                raise ValueError(
                    f"excitation: the condensed sector does not know engine order {order} (its "
                    f"harmonic {n} has {wave} nodal diameters); give it to condense, alone or in a "
                    "list"
                )
        other = self._copy()
        other._set_sector(sector)
        return other

    def fields(self) -> dict[str, Any]:
        """What makes it again, without the matrices of the whole sector."""
        gone = PlacesAlone(self.n_whole, places=self.beneath.places)
        return super().fields() | {"sector": self.sector._copy(structure=gone)}

    @classmethod
    def of_fields(cls, **fields: Any) -> "CondensedSector":
        """The condensed sector of its `fields`, without contacts."""
        none = np.zeros(0, dtype=np.intp)
        return cls(fields.pop("sector"), **fields, displacements=none)

    def _set_contacts(self, contacts: Any, **parameters: Any) -> None:
        sector = self.sector._copy()
        sector._set_contacts(contacts, **parameters)
        self._forget()
        self._store(sector=sector, **sector.groups.attributes)

    def of_structure(self, structure: Any) -> "CondensedSector":
        """The same with the whole sector that it was condensed from, given again.

        TypeError unless it is a Sector, ValueError where it is another one.
        """
        check.instance("structure", structure, Sector, "a Sector")
        same = structure.n_whole == self.n_whole
        if not same or _digest(structure) != self.digest:
            raise ValueError("structure: expected that which was condensed, its matrices differ")
        whole = structure._copy(**self.groups.attributes, order=self.order)
        return self._copy(sector=whole, beneath=whole.structure)


def _digest(sector: Sector) -> str:
    """Checksum of the matrices of a sector, its interfaces, and forces between blades."""
    model = sector.structure
    of_damping = model.damping_matrix if model.damping is None else model.coriolis_matrix
    matrices = model.mass_matrix, model.stiffness_matrix, of_damping
    ends = sector.interfaces.left, sector.interfaces.right
    arrays = [each for m in matrices if m is not None for each in (*arrays_of(m), *ends)]
    for influence in sector.influences:
        arrays += [*arrays_of(influence.column), *influence[1:]]
    return checksum([*arrays, np.frombuffer(repr(model.damping).encode(), dtype=np.uint8)])


def _together(certificates: Mapping[int, Certificate]) -> Certificate:
    """The largest errors of all waves, at all frequencies."""
    errors, bounds, frequencies, counts, sizes = zip(*certificates.values(), strict=True)
    together = np.concatenate(frequencies)
    return Certificate(max(errors), max(bounds), together, sum(counts), max(sizes))


class _Wave(NamedTuple):
    """A wave of some nodal diameters: bands [rad/s], negative of the other sense, and forces."""

    bands: list[tuple[float, float]]
    forces: list[ComplexArray]


def condense_sector(
    sector: Sector,
    excitations: Sequence[Excitation],
    band: tuple[float, float],
    basis: FourierBasis,
    dofs: NDArray[np.intp],
    displacements: NDArray[np.intp],
    progress: bool | None = False,
) -> CondensedSector:
    """Condense a sector to ``dofs``, see `symhbm.condense`.

    The last of them are ``displacements`` of contacts, by their numbers.

    Matrices of ``N - n`` nodal diameters are the conjugates of those of ``n``; the condensed
    stiffness there is the conjugate of the other at minus the frequency.
    """
    place = np.searchsorted(sector.kept, dofs)
    others = np.setdiff1d(np.arange(sector.n_dof), place)
    found, certificates = {}, {}
    for n, wave in sorted(_waves(sector, excitations, band, basis).items()):
        matrices = sector.matrices(n)
        forces = np.column_stack([np.zeros((sector.n_dof, 0)), *wave.forces])
        if not np.iscomplexobj(matrices.stiffness_matrix):
            forces = np.hstack([forces.real, forces.imag])
        patterns = orthonormal(forces, place)
        interior = Interior(matrices, place, patterns[others])
        if wave.bands:
            touched = sector.directions_of(n)[:, place].toarray()
            springs = (touched.conj().T * sector.groups.stuck_springs) @ touched
            reduced, certificates[n] = reduce(interior, wave.bands, springs, progress)
        else:
            reduced = _at_rest(interior)
        # Matrices of one wave tell nothing of motions in others.
        found[n] = CondensedStiffness.of(reduced, interior, patterns)._replace(modal=None)
    arguments = dofs, band, basis.harmonics, found, certificates, displacements
    condensed = CondensedSector(sector, *arguments)
    return condensed.under(excitations[0]) if len(excitations) == 1 else condensed


def orthonormal(shapes: NDArray, masters: NDArray[np.intp]) -> NDArray:
    """Orthonormal force patterns (n_dof, n_patterns) of forces, 0 where kept."""
    size = np.abs(shapes).max(axis=0, initial=0.0)
    shapes = shapes[:, size > 0] / size[size > 0]
    shapes[masters] = 0.0
    q, r, _ = qr(shapes, mode="economic", pivoting=True)  # type: ignore
    return np.asarray(q)[:, np.abs(r.diagonal()) > 1e-13]


def _waves(
    sector: Sector,
    excitations: Sequence[Excitation],
    band: tuple[float, float],
    basis: FourierBasis,
) -> dict[int, _Wave]:
    """By nodal diameters 0 to N / 2, what is asked of each wave."""
    found = {0: _Wave([], [])}  # where it stands in the mean
    for force in excitations:
        bound = sector.in_wave(sector_order(force, sector.n_sectors))
        each = [basis.by_harmonic(s) for s in sector.force_shapes(force, basis).values()]
        static = sector.static_load(force, basis)
        pairs = [pair for shapes in each for pair in zip(basis.harmonics, shapes, strict=True)]
        for harmonic, shape in pairs:
            n = bound.wave(harmonic)
            phasor = phasors(shape) if harmonic else static.astype(complex)
            push = bound.interfaces.folded(phasor, n)
            reverse = 2 * n > sector.n_sectors
            wave = found.setdefault(sector.n_sectors - n if reverse else n, _Wave([], []))
            wave.forces.append(push.conj() if reverse else push)
            if harmonic:
                low, high = CondensedModel.band(harmonic, band)
                wave.bands.append((-high, -low) if reverse else (low, high))
    return found


def _at_rest(interior: Interior) -> Reduced:
    """Nothing but what is known at rest, of a wave that no harmonic moves in."""
    n, columns = len(interior.masters), interior.n_columns
    sums = PoleSum(
        polynomial=np.zeros((3, n, columns), dtype=complex),
        left=np.zeros((3, n, 0), dtype=complex),
        right=np.zeros((3, 0, columns), dtype=complex),
        poles=np.zeros(0, dtype=complex),
    )
    return Reduced(sums, np.zeros((0, 0), dtype=complex), sums, np.zeros(0))
