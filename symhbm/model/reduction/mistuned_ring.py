"""`mistuned_ring`: a whole disk of reduced sectors, each blade with deviations of its own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from symhbm.model.contacts import Contacts
from symhbm.model.cyclic import Sector
from symhbm.model.damping import ModalDamping, StructuralDamping
from symhbm.model.excitation import EngineOrder, Excitation, ForceSum, StaticLoad, motions_of_base
from symhbm.model.frame import AT_REST
from symhbm.model.linear import LowRankSum, lagging
from symhbm.model.matrices import Model
from symhbm.model.outputs import Output
from symhbm.model.places import Place
from symhbm.model.reduction.deviations import DeviatingModel, force_as_felt
from symhbm.model.sectors import check_at_one_speed
from symhbm.numerics import DENSE_LIMIT, ComplexArray, FloatArray, FourierBasis, check


class MistunedRing(DeviatingModel):
    """All sectors of a disk, with contacts in and between them, see `mistuned_ring`.

    Attributes
    ----------
    sector
        The tuned sector.
    """

    sector: Sector
    stored_as = DeviatingModel

    def __init__(self, sector: Sector, **deviations: Any):
        model = sector.structure
        firsts = np.arange(sector.n_sectors) * model.n_whole
        kept = (firsts[:, None] + sector.kept).ravel()
        self._store(sector=sector, _lift=_spread(sector), kept=kept)
        # Sector by sector, all of the disk that it was made from.
        self._store(_n_whole=sector.n_sectors * model.n_whole)
        damping, stiffness = self._of_influences()
        base, blades = {}, {}
        for name, added in (("mass", 0), ("stiffness", stiffness)):
            parts = _blade(sector, name)
            whole: Any = sum(map(abs, parts.values()))
            base[name] = self._assembled(getattr(model, f"{name}_matrix"), whole, added)
            blades |= {key: _places(base[name], self._of_each(p)) for key, p in parts.items()}
        base["damping"] = self._damping_matrix(model, base, stiffness, damping)
        structural = model.damping if isinstance(model.damping, StructuralDamping) else None
        if structural is not None:
            base["loss"] = sp.csc_array(model.loss_factor * (base["stiffness"] - stiffness))
        self._store(speed=model.speed, stiffness_of_air=stiffness)
        super().__init__(base, blades, _contacts(sector, self._lift), structural, **deviations)
        self._store(outputs={n: self._around(out) for n, out in sector.outputs.items()})

    def _around(self, output: Output) -> Output:
        """An output of each sector, one after the other."""
        rows = self.sector.interfaces.everywhere(output.rows)
        each = sp.kron(sp.eye_array(self.sector.n_sectors), rows)
        return replace(output, several=True).of(each @ self._lift)

    def seen(self, output: Output) -> Any:
        """Rows of an output of the whole disk by the degrees of freedom of the ring."""
        model, size = self.sector.structure, self.sector.structure.n_whole
        parts = [
            model.seen(output.of(output.rows[:, j * size : (j + 1) * size]))
            for j in range(self.sector.n_sectors)
        ]
        return sp.hstack([sp.csr_array(part) for part in parts]).tocsr() @ self._lift

    def _of_each(self, matrix: Any) -> list[Any]:
        """A matrix of one sector as each of them has it among the degrees of freedom of all."""
        size = self.sector.n_whole
        rows = [self._lift[j * size : (j + 1) * size] for j in range(self.sector.n_sectors)]
        return [sp.coo_array(row.T @ matrix @ row) for row in rows]

    def _of_influences(self) -> tuple[Any, Any]:
        """Damping and stiffness of forces between blades, sparse (n_dof, n_dof)."""
        n, every = self.sector.n_sectors, np.arange(self.sector.n_sectors)
        damping = stiffness = sp.csc_array((self._lift.shape[1],) * 2)
        for influence in self.sector.influences:
            along = self._lift.T @ sp.kron(sp.eye_array(n), influence.column)
            parts = zip(*influence[1:], strict=True)
            for distance, of_stiffness, of_damping in parts:
                ahead = sp.csr_array((np.ones(n), (every, (every + distance) % n)), shape=(n, n))
                felt = along @ ahead @ along.T
                stiffness = stiffness + of_stiffness * felt
                damping = damping + of_damping * felt
        return damping, stiffness

    def _assembled(self, matrix: Any, blade: Any, added: Any = 0) -> Any:
        """Sum of one matrix of all sectors, with places for the entries of the blades."""
        every = sp.eye_array(self.sector.n_sectors)
        whole = self._lift.T @ sp.kron(every, matrix) @ self._lift + added
        places = abs(self._lift.T) @ sp.kron(every, abs(blade)) @ abs(self._lift)
        result = sp.csc_array(abs(whole) + places)
        result.sort_indices()
        result.data = (_places(result, [sp.coo_array(whole)]) @ np.ones(1)).astype(float)
        return result

    def _damping_matrix(self, model: Model, base: dict[str, Any], air: Any, added: Any) -> Any:
        given = model.damping
        if given is None:
            return self._assembled(model.damping_matrix, model.damping_matrix, added)
        if model.coriolis_matrix is not None:
            added = self._assembled(model.coriolis_matrix, model.coriolis_matrix, added)
        if isinstance(given, ModalDamping):
            result = modal_damping_of_ring(self.sector) + added
        else:
            result = sp.csc_array(given.matrix(base["mass"], base["stiffness"] - air) + added)
        if sp.issparse(result):
            result.sort_indices()
        return result

    def under(self, excitation: Excitation) -> MistunedRing:
        """The ring itself: it takes the pattern of a sector, too."""
        return self

    def number_of(self, place: Place) -> int:
        """The number of a place in the whole disk, of a name that in the first sector."""
        if isinstance(place, str):
            return self.sector.structure.number_of(place)
        return super().number_of(place)

    def expanded(self, motion: Any, nodal_diameter: int | None = None) -> Any:
        """Motion (n_whole, n) of all sectors of the whole disk from that (n_dof, n) of the ring."""
        each = np.split(self._lift @ motion, self.sector.n_sectors)
        return np.concatenate([self.sector.structure.expanded(part) for part in each])

    def force_shape(self, excitation: Excitation, basis: FourierBasis) -> FloatArray:
        """Coefficients of an excitation of unit amplitude, those of a pattern wave by wave."""
        if isinstance(excitation, ForceSum):
            return sum(
                ratio * self.force_shape(part, basis)
                for part, ratio in zip(excitation.parts, excitation._ratios, strict=True)
            )  # type: ignore[return-value]
        if not isinstance(excitation, EngineOrder) or excitation.pattern is None:
            return super().force_shape(excitation, basis)
        n, shape = self.sector.n_sectors, self.sector.structure.force_shape(excitation, basis)
        each = [lagging(shape, basis, j * int(excitation.order), n) for j in range(n)]
        return np.concatenate(each)

    def force_shapes(self, excitation: Excitation, basis: FourierBasis) -> dict[int, FloatArray]:
        """The same by the power of the angular frequency.

        ValueError for a base that moves the masses or springs of a tuned disk, where they deviate.
        """
        motions = motions_of_base(excitation)
        for name, (matrix, _, _) in self.deviations.items():
            of_base = "relative" if matrix == "mass" else "absolute"
            if of_base in motions and np.any(getattr(self, name)):
                raise ValueError(
                    f"{name}: expected 0 under a BaseMotion in {of_base} displacements, whose "
                    f"force was made with the {matrix} of the tuned sector"
                )
        return super().force_shapes(excitation, basis)

    def static_load(self, excitation: Excitation, basis: FourierBasis = AT_REST) -> FloatArray:
        """What of an excitation does not oscillate; a `StaticLoad` acts on each sector."""
        if isinstance(excitation, ForceSum):
            return np.sum([self.static_load(part, basis) for part in excitation.parts], axis=0)
        if isinstance(excitation, EngineOrder):
            return np.zeros(self.n_whole)
        if isinstance(excitation, StaticLoad):
            own = self.sector.structure.static_load(excitation, basis)
            return np.tile(own, self.sector.n_sectors)
        return super().static_load(excitation, basis)

    def _split(
        self, part: FloatArray, harmonic: int, largest: float
    ) -> tuple[FloatArray, FloatArray]:
        """One harmonic of a force on the whole disk, sector by sector."""
        each = part.reshape(self.sector.n_sectors, -1, part.shape[1])
        felt = [self.sector.structure._split(own, harmonic, largest)[0] for own in each]
        return super()._split(np.concatenate(felt), harmonic, largest)

    def as_felt(self, excitation: Excitation, basis: FourierBasis) -> Excitation:
        """An excitation as the degrees of freedom of the ring feel it."""
        return force_as_felt(self, excitation, basis)


def mistuned_ring(
    sector: Sector,
    *,
    stiffness_deviation: ArrayLike = 0.0,
    frequency_deviation: ArrayLike = 0.0,
    mass_deviation: ArrayLike = 0.0,
    **of_modes: ArrayLike,
) -> MistunedRing:
    """Make the whole disk of a sector, with deviations of each blade as parameters.

    Blade j has the stiffness ``(1 + s_j + (1 + f_j)^2 - 1) K_b`` and the mass ``(1 + m_j) M_b``
    beside the disk, ``s_j`` its ``stiffness_deviation``, ``f_j`` that of its frequency alone,
    ``m_j`` that of its mass. Mode k of the blade alone adds ``((1 + d_jk)^2 - 1) omega_k^2`` to
    the stiffness of its coordinate, ``d_jk`` the deviation of its frequency. They are parameters
    of the result, per blade, for ``over=``, `symhbm.datasets.sensitivity`, `follow` and draws,
    whose spreads are those of the deviations themselves.

    Parameters
    ----------
    sector
        The tuned sector with its contacts, mostly one reduced by `craig_bampton`, whose ``blade``
        tells ``K_b`` and ``M_b``; the whole sector is the blade otherwise.
    stiffness_deviation, frequency_deviation, mass_deviation
        One value or one per blade [-], above -1.
    of_modes
        The same of modes of the blade alone, ``frequency_deviation_0`` of the lowest and so on, of
        as many as the ``blade_modes`` of `craig_bampton`.

    Returns
    -------
    A `Model` of all sectors one after the other, contacts sector by sector. An `EngineOrder` with
    the pattern of a sector acts on all of them, a `StaticLoad` of a sector on each; other forces
    are those of the whole disk, whose degrees of freedom are numbered sector by sector. Motions of
    each sector have its own axes.

    Raises
    ------
    TypeError, ValueError
        For what is no sector, or deviations that are not above -1.
    KeyError
        For deviations of other modes.

    Notes
    -----
    Damping is that of the tuned disk. Modal damping of more than 500 degrees of freedom stays in
    factors, which `condense` takes.

    Examples
    --------
    A disk of 12 blades, one of them 2 % stiffer:

    >>> import numpy as np
    >>> import symhbm as sh
    >>> blade = sh.Model([[1.0, 0], [0, 0]], [[2.0, 0], [0, 0]], [[3e4, -2e4], [-2e4, 2e4]])
    >>> disk = sh.Sector(blade, left=[0], right=[1], n_sectors=12)
    >>> ring = sh.mistuned_ring(disk, stiffness_deviation=0.02 * (np.arange(12) == 4))
    >>> sh.natural_modes(ring, count=3).frequency.values.round(2)
    array([15.93, 19.73, 19.75])
    >>> force = sh.forces.EngineOrder(3, pattern={0: 1.0})
    >>> response = sh.frf(sh.HarmonicBalance(ring, force), (30, 40), progress=False)
    >>> response.sizes["dof"]
    12
    """
    check.instance("sector", sector, Sector, "a Sector")
    check_at_one_speed("sector", sector.structure)
    return MistunedRing(
        sector,
        stiffness_deviation=stiffness_deviation,
        frequency_deviation=frequency_deviation,
        mass_deviation=mass_deviation,
        **of_modes,
    )


def _spread(sector: Sector) -> Any:
    """Motion of each sector (n_sectors n_sector, n_dof) from that of the ring, sparse."""
    (own, beyond), n = sector.interfaces.parts, sector.n_sectors
    return (sp.kron(sp.eye_array(n), own) + sp.kron(_next(n), beyond)).tocsr()


def _next(n_sectors: int) -> Any:
    """Permutation that takes each sector to the next one."""
    every = np.arange(n_sectors)
    return sp.csr_array((np.ones(n_sectors), (every, (every + 1) % n_sectors)))


def _blade(sector: Sector, name: str) -> dict[str, Any]:
    """The parts of a matrix of a sector that are the blade's, as `Deviation` names them."""
    blade = sector.blade
    if blade is None:
        return {name: getattr(sector.structure, f"{name}_matrix")}
    parts = {name: getattr(blade, name)}
    if name == "stiffness":
        modes = enumerate(zip(2 * np.pi * blade.frequencies, blade.rows, strict=True))
        parts |= {f"mode_{k}": natural**2 * np.outer(row, row) for k, (natural, row) in modes}
    return {key: sp.csr_array(part) for key, part in parts.items()}


def _places(pattern: Any, each: list[Any]) -> Any:
    """Entries of matrices among the stored ones of a pattern, (n_entries, n_matrices)."""
    size = pattern.shape[0]
    columns = np.repeat(np.arange(size), np.diff(pattern.indptr))
    keys = columns * size + pattern.indices
    rows = [np.searchsorted(keys, part.col.astype(np.int64) * size + part.row) for part in each]
    count = [len(row) for row in rows]
    column = np.repeat(np.arange(len(each)), count)
    values = np.concatenate([part.data for part in each])
    return sp.csr_array((values, (np.concatenate(rows), column)), shape=(len(keys), len(each)))


def _contacts(sector: Sector, spread: Any) -> dict[str, Contacts]:
    """The contacts of a sector in all of them, sector by sector."""
    n, size = sector.n_sectors, sector.n_whole
    named = sector._directions_as_named
    beyond = named[:, size:] @ sector.interfaces.rotation
    each: Any = sp.kron(sp.eye_array(n), named[:, :size]) + sp.kron(_next(n), beyond)
    rows: Any = sp.csr_array(each @ spread)
    n_rows = len(sector.groups.row_ends)
    rows.sum_duplicates()
    rows.eliminate_zeros()
    result = {}
    for group in sector.groups:
        directions = [
            rows[(np.arange(n)[:, None] * n_rows + column).ravel()] for column in group.rows.T
        ]
        values = {own: np.tile(value, n) for own, value in group.values.items()}
        result[group.name] = Contacts(group.law, *directions, **values)
    return result


def modal_damping_of_ring(sector: Sector) -> Any:
    """Modal damping of each nodal diameter as a matrix of the whole ring, or in factors."""
    n, still = sector.n_sectors, sector.with_influences()
    left, right = [], []
    for wave in sector.nodal_diameters:
        mass, _, stiffness = still.matrices(wave)
        one, other = _factors(sector.structure.damping.matrix(mass, stiffness))
        phases = np.exp(-2j * np.pi * wave * np.arange(n) / n) / np.sqrt(n)
        whole = [np.kron(phases[:, None], part) for part in (one, other)]
        if 2 * wave % n == 0:
            parts = [(part.real,) for part in whole]
        else:  # with the wave of the other sense, its conjugate
            parts = [(np.sqrt(2) * part.real, np.sqrt(2) * part.imag) for part in whole]
        left += parts[0]
        right += parts[1]
    sparse = sp.csc_array((n * sector.n_dof,) * 2)
    result = LowRankSum(sparse, np.hstack(left), np.hstack(right))
    return sp.csc_array(result.toarray()) if len(result.left) <= DENSE_LIMIT else result


def _factors(matrix: Any) -> tuple[ComplexArray, ComplexArray]:
    """Factors of a Hermitian positive semidefinite matrix, ``left right^H``."""
    if isinstance(matrix, LowRankSum):
        return matrix.left, matrix.right.conj()
    sizes, vectors = np.linalg.eigh(matrix.toarray())
    chosen = sizes > 1e-14 * sizes.max(initial=0.0)
    return vectors[:, chosen] * sizes[chosen], vectors[:, chosen]
