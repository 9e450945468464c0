"""What an engine order tells of structures: sectors that move alike, and the speed of rotation.

A tuned disk under an engine order answers with a travelling wave: each sector repeats the motion of
the one before it a share of the period later, so that one of them tells all. The response with
constant normal loads is unique, hence as symmetric as structure and force are, for any harmonics.
The speed is ``Omega = omega / order``.
"""

from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.contacts import renumbered
from symhbm.model.excitation import Excitation
from symhbm.model.structure import Structure
from symhbm.numerics import FloatArray, FourierBasis

_ROUND_OFF = 1e-14
"""Of the cosines and sines of a travelling wave, relative to its amplitude."""


@dataclass(frozen=True)
class Symmetry:
    """Sectors of a structure, the first of which holds the degrees of freedom 0 to ``n_dof - 1``.

    Each of the ``n_sectors`` lags the one before it by ``lag`` turns over their number.
    ``contact_sector`` (n_contacts,) tells in which sector each contact of the whole structure is,
    ``contact_place`` (n_contacts,) which of that sector's it is.
    """

    n_sectors: int
    n_dof: int
    lag: int
    contact_sector: tuple[int, ...]
    contact_place: tuple[int, ...]

    @property
    def dof_sector(self) -> NDArray[np.intp]:
        """The sector of each degree of freedom of the whole structure, (n_dof of all,)."""
        return np.repeat(np.arange(self.n_sectors), self.n_dof)

    @cached_property
    def contacts(self) -> NDArray[np.intp]:
        """The contacts of the first sector."""
        first = np.flatnonzero(np.array(self.contact_sector, dtype=int) == 0)
        return first[np.argsort(np.array(self.contact_place, dtype=int)[first])]

    def images(self, contact: int) -> NDArray[np.intp]:
        """The contacts of all sectors that are alike to one of the first."""
        return np.flatnonzero(np.array(self.contact_place) == contact)

    def wave(self, harmonic: int) -> int:
        """Turns over the number of sectors by which each lags in one harmonic."""
        return self.lag * harmonic % self.n_sectors

    def expansion(self, basis: FourierBasis) -> sp.csr_array:
        """Coefficients of all degrees of freedom from those of the first sector, all flattened."""
        size, sector = basis.n_components, self.dof_sector
        rows, columns, values = [], [], []
        for harmonic in basis.harmonics:
            turns = self.wave(harmonic) * sector % self.n_sectors / self.n_sectors
            cosine, sine = np.cos(2 * np.pi * turns), np.sin(2 * np.pi * turns)
            at = [basis.component(harmonic)]
            entries = [(0, 0, cosine)]
            if harmonic:
                at.append(basis.component(harmonic, sine=True))
                entries += [(0, 1, -sine), (1, 0, sine), (1, 1, cosine)]
            for row, column, value in entries:
                rows.append(np.arange(len(sector)) * size + at[row])
                columns.append(np.arange(len(sector)) % self.n_dof * size + at[column])
                values.append(value)
        entry = np.concatenate(rows), np.concatenate(columns)
        shape = len(sector) * size, self.n_dof * size
        result = sp.csr_array((np.concatenate(values), entry), shape=shape)
        result.eliminate_zeros()
        return result

    def phases(self, wave: int) -> sp.csr_array:
        """``a - i b`` of all degrees of freedom from that of the first sector, in a `wave`."""
        sector = self.dof_sector
        turns = wave * sector % self.n_sectors / self.n_sectors
        entry = np.arange(len(sector)), np.arange(len(sector)) % self.n_dof
        shape = len(sector), self.n_dof
        return sp.csr_array((np.exp(-2j * np.pi * turns), entry), shape=shape)

    def spread_contacts(self, values: np.ndarray) -> np.ndarray:
        """Values (n_contacts of one sector, ...) of all contacts."""
        return values[np.array(self.contact_place, dtype=int)]

    def contact_lags(self) -> FloatArray:
        """Angle by which each contact of the whole structure lags that of the first sector."""
        sector = np.array(self.contact_sector, dtype=int)
        return 2 * np.pi * (self.lag * sector % self.n_sectors) / self.n_sectors

    def own_of_dofs(self, name: str, values: FloatArray) -> FloatArray:
        """The first sector's values of a parameter of all dofs; ValueError where they differ."""
        chosen = values[: self.n_dof]
        return self._checked(name, values, chosen, np.tile(chosen, self.n_sectors))

    def own_of_contacts(
        self, name: str, values: FloatArray, contacts: NDArray[np.intp]
    ) -> FloatArray:
        """The first sector's values of a parameter of some ``contacts``; ValueError as above."""
        everywhere = np.full(len(self.contact_place), np.nan)
        everywhere[contacts] = values
        chosen = everywhere[self.contacts]
        spread = self.spread_contacts(chosen)[contacts]
        return self._checked(name, values, chosen[np.isin(self.contacts, contacts)], spread)

    def _checked(
        self, name: str, values: FloatArray, chosen: FloatArray, spread: FloatArray
    ) -> FloatArray:
        if not np.array_equal(spread, values):
            raise ValueError(
                f"{name}: expected the same values in each of {self.n_sectors} sectors"
            )
        return chosen


def find_symmetry(model: Structure, excitation: Excitation, basis: FourierBasis) -> Symmetry | None:
    """The smallest sector that repeats itself around a structure, None if there is none.

    Degrees of freedom are to be numbered sector by sector. Sectors are equal to the bit. None is
    found without matrices.
    """
    if not model.has_matrices or model.matrix_terms:
        return None
    for n_dof in range(1, model.n_dof // 2 + 1):
        if model.n_dof % n_dof or not _repeats(model, n_dof):
            continue
        n_sectors = model.n_dof // n_dof
        order = _contact_order(model, n_dof, n_sectors)
        if order is None:
            continue
        shapes, static = model.felt_shapes(excitation, basis), model.felt_static(excitation)
        if not np.array_equal(np.roll(static, -n_dof), static):
            continue
        lags = [_lag(shape, n_dof, n_sectors, basis) for shape in shapes.values()]
        if lags[0] is not None and len({*lags}) == 1:
            return Symmetry(n_sectors, n_dof, lags[0], *order)
    return None


def _repeats(model: Structure, step: int) -> bool:
    """Whether the matrices are the same after ``step`` degrees of freedom."""
    moved = np.roll(np.arange(model.n_dof), -step)
    for matrix in (model.mass_matrix, model.damping_matrix, model.stiffness_matrix):
        # The diagonal first: it tells a mistuned structure at no cost.
        diagonal = matrix.diagonal()
        if not np.array_equal(diagonal[moved], diagonal):
            return False
        if model.lumped:
            continue
        if (matrix[moved][:, moved] != matrix).nnz:
            return False
    return True


def _contact_order(
    model: Structure, step: int, n_sectors: int
) -> tuple[tuple[int, ...], tuple[int, ...]] | None:
    """Sector of each contact and its place there, None where contacts do not repeat."""
    if model.n_contacts % n_sectors:
        return None
    values: list[list[Any]] = [[] for _ in model.contacts]
    for group in model.groups:
        of_group = np.array(list(model.values_of(group).values())).T.tolist()
        for j, row in zip(group.contacts, of_group, strict=True):
            values[j] += [group.name, *row]
    # Contacts of equal ends, side by side, are told apart by their values.
    known: dict[tuple, list[int]] = defaultdict(list)
    keys = [(ends, tuple(row)) for ends, row in zip(model.contacts, values, strict=True)]
    for j, key in enumerate(keys):
        known[key].append(j)
    sector = np.full(model.n_contacts, -1)
    place = np.full(model.n_contacts, -1)
    n_places = 0
    for j, (ends, row) in enumerate(keys):
        if sector[j] >= 0:
            continue
        twin = known[ends, row].index(j)
        for i in range(n_sectors):
            moved = renumbered(ends, partial(_further, i * step, model.n_dof))
            alike = known.get((moved, row), [])
            if twin >= len(alike) or sector[alike[twin]] >= 0:
                return None
            sector[alike[twin]], place[alike[twin]] = i, n_places
        n_places += 1
    return tuple(sector.tolist()), tuple(place.tolist())


def _further(step: int, n_dof: int, dof: int) -> int:
    return (dof + step) % n_dof


def _lag(shape: FloatArray, step: int, n_sectors: int, basis: FourierBasis) -> int | None:
    """Turns over the number of sectors by which the force lags from each to the next."""
    level = _ROUND_OFF * np.abs(shape).max(initial=0.0)
    moved = np.roll(shape, -step, axis=0)
    whole = Symmetry(n_sectors, step, 1, (), ())
    for lag in range(n_sectors):
        turned = np.zeros_like(shape)
        for harmonic in basis.harmonics:
            angle = 2 * np.pi * (whole.wave(harmonic) * lag % n_sectors) / n_sectors
            c, s = np.cos(angle), np.sin(angle)
            cosine = basis.component(harmonic)
            if not harmonic:
                turned[:, cosine] = shape[:, cosine]
                continue
            sine = basis.component(harmonic, sine=True)
            turned[:, cosine] = c * shape[:, cosine] - s * shape[:, sine]
            turned[:, sine] = s * shape[:, cosine] + c * shape[:, sine]
        if np.all(np.abs(moved - turned) <= level):
            return lag
    return None


def speed_order(model: Structure) -> float | None:
    """The engine order along which a structure or its contacts change, None where nothing does.

    ValueError for several.
    """
    orders = {model.engine_order, *(group.law.engine_order for group in model.groups)} - {None}
    if len(orders) > 1:
        raise ValueError(
            f"engine_order: expected one for the structure and its contacts, got {sorted(orders)}"
        )
    return orders.pop() if orders else None


def check_at_one_speed(name: str, structure: Structure) -> None:
    """Raise TypeError for a structure whose matrices change with the speed of rotation."""
    if getattr(structure, "speeds", None) is not None:
        raise TypeError(
            f"{name}: expected matrices that do not change with the speed of rotation; give the "
            "structure at one speed, RotatingModel.at(speed), or a sector of one by its own "
            "at(speed)"
        )


def check_speed(model: Structure, excitation: Excitation) -> None:
    """Raise ValueError unless structure, contacts and excitation turn at one speed."""
    order = speed_order(model)
    if order is None or excitation.speed_ratios <= {float(order)}:
        return
    told = ", ".join(f"{ratio:g}" for ratio in sorted(excitation.speed_ratios))
    raise ValueError(
        f"excitation={excitation!r}: expected one of frequencies {order} times the speed of "
        f"rotation, as engine_order={order} of structure and contacts says; its engine orders over "
        f"their harmonics are {told}"
    )
