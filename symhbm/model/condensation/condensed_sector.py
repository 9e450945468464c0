"""A sector of a disk condensed, wave by wave, to the few degrees of freedom that are kept."""

from collections.abc import Mapping
from functools import cached_property
from hashlib import sha256
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.condensation.condensed_model import (
    CondensedModel,
    CondensedStiffness,
    arrays_of,
    places_of,
)
from symhbm.model.condensation.pole_residue import PoleResidueFunction
from symhbm.model.condensation.reduced_basis import Certificate
from symhbm.model.cyclic import Interfaces, Sector, components, displacements, phasors
from symhbm.model.excitation import Excitation, sector_order
from symhbm.model.records import copied
from symhbm.model.structure import AT_REST, Structure
from symhbm.numerics import ComplexArray, FloatArray, FourierBasis, check

_GONE = (
    "structure: this condensed sector was rebuilt from an archive, which does not hold the whole "
    "one; give it as structure= of symhbm.recover"
)
_INSIDE = 1e-12
"""Share of a force outside of the known patterns that is round-off."""


class _Gone(Structure):
    """The structure of a sector of which an archive holds no matrices."""

    def dynamic_stiffness(
        self, harmonic: int, frequency: float
    ) -> tuple[ComplexArray, ComplexArray]:
        """Raise TypeError: nobody knows."""
        raise TypeError(_GONE)


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

    WITHOUT_MATRICES = Sector.WITHOUT_MATRICES

    waves: Mapping[int, CondensedStiffness]
    certificates: Mapping[int, Certificate]
    _structure: Sector  # type: ignore[assignment]

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
        self._check_names(structure.contact_parameters)
        # The layout in memory decides how sums are rounded: it is that of what archives hold.
        waves = {n: copied(wave) for n, wave in waves.items()}
        self._store(**_contacts_of(structure))
        self._store(dofs=dofs, frequency=frequency, harmonics=harmonics, lumped=False)
        self._store(waves=waves, certificates=certificates, certificate=_together(certificates))
        places = places_of(structure, structure.structure.places, dofs, displacements)
        self._store(_structure=structure, places=places, displacements_kept=displacements)
        self._store(digest=digest or _digest(structure))
        if structure.order is not None:
            self._bind()

    def _bind(self) -> None:
        """The functions of the frequency of each harmonic under an engine order."""
        moving = [n for n in self.harmonics if n]
        matrices = {n: self._in(n).matrix for n in moving}
        undamped = {n: self._in(n).undamped for n in moving}
        bands = {n: self.band(n, self.frequency) for n in moving}
        self._store(
            functions={n: PoleResidueFunction(matrices[n], bands[n]) for n in moving},
            undamped={n: PoleResidueFunction(undamped[n], bands[n]) for n in moving},
            _fixed={n: (self._in(n).fixed_frequencies, self._in(n).fixed_widths) for n in moving},
        )

    _fixed: dict[int, tuple[FloatArray, FloatArray]]

    def _in(self, harmonic: int) -> CondensedStiffness:
        """The condensed stiffness of the wave of a harmonic."""
        n, n_sectors = self._structure.wave(harmonic), self._structure.n_sectors
        return self.waves[n] if 2 * n <= n_sectors else self.waves[n_sectors - n].conjugate()

    def under(self, excitation: Excitation) -> "CondensedSector":
        """The sector as an engine order moves it; ValueError for one it was not condensed for."""
        return self.in_wave(sector_order(excitation, self._structure.n_sectors))

    def in_wave(self, order: int) -> "CondensedSector":
        """The sector under an engine order."""
        if order == self._structure.order:
            return self
        sector = self._structure.in_wave(order)
        for n in self.harmonics:
            wave = sector.wave(n)
            if min(wave, sector.n_sectors - wave) not in self.waves:
                raise ValueError(
                    f"excitation: the condensed sector does not know engine order {order} (its "
                    f"harmonic {n} has {wave} nodal diameters); give it to condense, alone or in a "
                    "list"
                )
        other = object.__new__(type(self))
        other._store(**vars(self) | {"_structure": sector})
        other._bind()
        return other

    @property
    def _n_named(self) -> int:
        return 2 * self.n_whole

    @property
    def n_whole(self) -> int:
        """Number of degrees of freedom of a sector."""
        return self._structure.n_whole

    @property
    def interfaces(self) -> Interfaces:
        """Those of the sector."""
        return self._structure.interfaces

    @cached_property
    def masters(self) -> NDArray[np.intp]:  # type: ignore[override]
        """The degrees of freedom that are kept among those that are not right."""
        return np.searchsorted(self._structure.kept, self.dofs)

    @property
    def order(self) -> int | None:
        """The engine order that moves it, below the number of sectors."""
        return self._structure.order

    def wave(self, harmonic: int) -> int:
        """Nodal diameters of a harmonic, 0 to N - 1."""
        return self._structure.wave(harmonic)

    @property
    def nodal_diameters(self) -> range:
        """Nodal diameters that differ, 0 to N / 2."""
        return self._structure.nodal_diameters

    @property
    def touched(self) -> set[int]:
        """Degrees of freedom that contacts act on, as the sector numbers them."""
        return self._structure.touched

    @property
    def contact_coordinates(self) -> FloatArray:
        """Where contacts are, amid their nodes in this sector, (n_contacts, 3) [m]."""
        return self._structure.contact_coordinates

    def directions_of(self, nodal_diameter: int | None = None) -> Any:
        """Directions ``w`` of all displacements in a wave, sparse (n_rows, n_dof), complex."""
        return self._structure.directions_of(nodal_diameter)[:, self.masters]

    def directions_in(self, harmonic: int) -> Any:
        """Directions in one harmonic (n_rows, n_dof), complex."""
        return self.directions_of(self.wave(harmonic))

    @cached_property
    def directions(self) -> Any:
        """Directions of a constant motion, sparse (n_rows, n_dof)."""
        return self.directions_of(0)

    def displacements(self, basis: FourierBasis) -> Any:
        """Coefficients of all displacements from those of the degrees of freedom, flattened."""
        return displacements(self.directions_in, basis)

    def fields(self) -> dict[str, Any]:
        """What makes it again, without the matrices of the whole sector."""
        self._check_stored()
        names = "dofs", "frequency", "harmonics", "waves", "certificates", "digest"
        gone = _Gone(self.n_whole, places=self._structure.structure.places)
        fields = {"sector": self._structure._changed(structure=gone)}
        return fields | {name: getattr(self, name) for name in names}

    @classmethod
    def of_fields(cls, **fields: Any) -> "CondensedSector":
        """The condensed sector of its `fields`, without contacts."""
        none = np.zeros(0, dtype=np.intp)
        return cls(fields.pop("sector"), **fields, displacements=none)

    def _set_contacts(self, contacts: Any, **parameters: Any) -> None:
        sector = self._structure._changed()
        sector._set_contacts(contacts, **parameters)
        self._store(_structure=sector, **_contacts_of(sector))

    @property
    def structure(self) -> Sector:  # type: ignore[override]
        """The whole sector, with the contact parameters as they are here.

        TypeError for one from an archive, which has a checksum of it alone; see `of_structure`.
        """
        if isinstance(self._structure.structure, _Gone):
            raise TypeError(_GONE)
        return self._structure.with_parameters(**self.parameters)

    def of_structure(self, structure: Any) -> "CondensedSector":
        """The same with the whole sector that it was condensed from, given again.

        TypeError unless it is a Sector, ValueError where it is another one.
        """
        if not isinstance(structure, Sector):
            raise TypeError(f"structure={check.shown(structure)}: expected a Sector")
        same = structure.n_whole == self.n_whole
        if not same or _digest(structure) != self.digest:
            raise ValueError("structure: expected that which was condensed, its matrices differ")
        whole = structure._changed(order=self.order)
        whole._store(**_contacts_of(self))
        other = object.__new__(type(self))
        other._store(**vars(self) | {"_structure": whole})
        return other

    def as_felt(self, excitation: Excitation, basis: FourierBasis) -> Excitation:
        """An excitation on the sector itself, of one reduced from a larger one."""
        return self._structure.as_felt(excitation, basis)

    @property
    def modal(self) -> None:
        """None: each wave has matrices of its own."""
        return None

    @property
    def inertia(self) -> FloatArray:
        """Inertia of the kept degrees of freedom and of the quasi-static interior [kg]."""
        return self._in(next(n for n in self.harmonics if n)).undamped.polynomial[2].real

    @property
    def static_stiffness(self) -> Any:
        """Condensed stiffness at rest, sparse."""
        return sp.csc_array(self.waves[0].static[:, : self.n_dof].real)

    def linear_forces(self, harmonic: int, frequency: float) -> tuple[ComplexArray, ComplexArray]:
        """``[Z, G]`` of one harmonic and its derivative by the frequency."""
        if harmonic == 0:
            static = self.waves[0].static.astype(complex)
            return static, np.zeros_like(static)
        value, slope = self.functions[harmonic](harmonic * frequency)
        return value, harmonic * slope

    def force_shape(self, excitation: Any, basis: FourierBasis) -> FloatArray:
        """Coefficients of an excitation of unit amplitude on the whole structure."""
        return self._structure.force_shape(excitation, basis)

    def force_shapes(self, excitation: Any, basis: FourierBasis) -> dict[int, FloatArray]:
        """The same by the power of the angular frequency."""
        return self._structure.force_shapes(excitation, basis)

    def static_load(self, excitation: Any, basis: FourierBasis = AT_REST) -> FloatArray:
        """What of an excitation does not oscillate, on the whole structure [N]."""
        return self._structure.static_load(excitation, basis)

    def forces_curvature(self, harmonic: int, frequency: float) -> ComplexArray:
        """Second derivative of `linear_forces` by the frequency, from the same poles."""
        if harmonic == 0:
            return np.zeros(self.waves[0].static.shape, dtype=complex)
        return harmonic**2 * self.functions[harmonic].curvature(harmonic * frequency)

    def split_force(
        self, shape: FloatArray, basis: FourierBasis
    ) -> list[tuple[FloatArray, FloatArray]]:
        """A force on a sector: on kept degrees of freedom, shares of known patterns."""
        parts, largest = [], np.abs(shape).max(initial=0.0)
        for harmonic, part in zip(basis.harmonics, basis.by_harmonic(shape), strict=True):
            inside = self._structure.folded(phasors(part), self.wave(harmonic))
            own = inside[self.masters]
            inside[self.masters] = 0.0
            patterns = self._in(harmonic).patterns
            share = patterns.conj().T @ inside
            rest = np.abs(inside - patterns @ share)
            if rest.max() > _INSIDE * largest:
                raise ValueError(
                    "excitation: the condensed sector does not know this force (on degree of "
                    f"freedom {int(self._structure.kept[rest.argmax()])} in harmonic {harmonic}); "
                    "give it to condense, alone or in a list"
                )
            parts.append((components(own, harmonic), components(share, harmonic)))
        return parts

    def fixed_in(self, harmonic: int) -> tuple[FloatArray, FloatArray]:
        """Fixed-interface natural frequencies and half widths of a harmonic, (n,) [rad/s]."""
        return self._fixed[harmonic]


def _contacts_of(structure: Structure) -> dict[str, Any]:
    names = "contacts", "row_ends", "groups", *structure.contact_parameters
    return {name: getattr(structure, name) for name in names}


def _digest(sector: Sector) -> str:
    """Checksum of the matrices of a sector, its interfaces, and forces between blades."""
    digest, model = sha256(), sector.structure
    of_damping = model.damping_matrix if model.damping is None else model.coriolis_matrix
    matrices = model.mass_matrix, model.stiffness_matrix, of_damping
    ends = sector.interfaces.left, sector.interfaces.right
    arrays = [each for m in matrices if m is not None for each in (*arrays_of(m), *ends)]
    for influence in sector.influences:
        arrays += [*arrays_of(influence.column), *influence[1:]]
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update(repr(model.damping).encode())
    return digest.hexdigest()


def _together(certificates: Mapping[int, Certificate]) -> Certificate:
    """The largest errors of all waves, at all frequencies."""
    errors, bounds, frequencies, counts, sizes = zip(*certificates.values(), strict=True)
    together = np.concatenate(frequencies)
    return Certificate(max(errors), max(bounds), together, sum(counts), max(sizes))
