"""Condensation of a sector of a disk, for each number of nodal diameters that it moves in."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from symhbm.model.condensation.condensed_model import CondensedModel, CondensedStiffness
from symhbm.model.condensation.condensed_sector import CondensedSector
from symhbm.model.condensation.partition import Interior
from symhbm.model.condensation.pole_residue import PoleSum
from symhbm.model.condensation.reduced_basis import Reduced, reduce
from symhbm.model.cyclic import Sector, phasors
from symhbm.model.excitation import Excitation, sector_order
from symhbm.numerics import ComplexArray, FourierBasis


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
            springs = (touched.conj().T * sector.stuck_springs) @ touched
            reduced, certificates[n] = reduce(interior, wave.bands, springs, progress)
        else:
            reduced = _at_rest(interior)
        found[n] = CondensedStiffness(
            reduced.whole, reduced.undamped, interior.at_rest, reduced.fixed_frequencies, patterns
        )
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
