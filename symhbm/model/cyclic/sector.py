"""A disk of identical sectors, given by the matrices of one."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from symhbm.model.contacts import Contacts
from symhbm.model.cyclic.waves import (
    Interfaces,
    check_geometry,
    components,
    displacements,
    phasors,
    rotation_of,
)
from symhbm.model.excitation import Excitation, sector_order
from symhbm.model.matrices import Model
from symhbm.model.places import NextSector
from symhbm.model.structure import Matrices, NearModes, Structure, weighted
from symhbm.numerics import ComplexArray, FloatArray, FourierBasis, check, negative_eigenvalues

LARGEST = 300
"""Degrees of freedom of a sector that is balanced as it is: larger ones are condensed."""


class Sector(Structure):
    """A tuned disk of ``n_sectors`` identical sectors, by the structure of one of them.

    Under an engine order E each sector lags the one before,
    ``X_h^(j) = X_h^(0) exp(-i h E j phi)`` for motions ``Re(X exp(i h omega t))``,
    ``phi = 2 pi / N``, so that one of them tells all: harmonic h has ``n = h E mod N`` nodal
    diameters (n above N / 2: N - n of the other sense), and the interfaces are joined by
    ``u_R = R u_L exp(-i n phi)``.

    Parameters
    ----------
    structure
        One sector, without contacts.
    left, right
        Degrees of freedom of its two interfaces, in the same order: right of a sector is left of
        the next.
    n_sectors
        Sectors of the disk.
    rotation
        The axis ``"x"``, ``"y"`` or ``"z"`` that the next sector is turned about, by a positive
        angle, where directions are cartesian: `structure` then has places. None where they are
        radial, tangential and axial, or where there is one alone.

    Raises
    ------
    TypeError, ValueError
        For a structure that is no Model or has contacts, for interfaces that do not fit each other,
        for less than two sectors, and as `Model` for contacts.

    Notes
    -----
    Contacts, given by `with_contacts`, are those of one sector. One to the neighbour is told from
    one side alone, the place beyond by `symhbm.next_sector`; what is told from both sides is two
    contacts. Contacts may act on the interfaces; one on both sides of a cut is given once, left or
    right. Its degrees of freedom are those that are not right.

    The response of the whole disk to an engine order with constant normal loads is unique, hence
    this one. Where normal loads vary it is one of possibly several.

    A sector above 300 degrees of freedom needs `symhbm.condense`.

    Examples
    --------
    A disk of 12 blades, each coupled to the next one, and rubbing on it: a sector is a blade and
    the point where the spring to the next one ends.

    >>> import symhbm as sh
    >>> blade = sh.Model([[1.0, 0], [0, 0]], [[2.0, 0], [0, 0]], [[3e4, -2e4], [-2e4, 2e4]])
    >>> disk = sh.Sector(blade, left=[0], right=[1], n_sectors=12)
    >>> sh.natural_modes(disk, nodal_diameter=3).frequency.values.round(3)
    array([35.588])
    >>> shroud = sh.Contacts(
    ...     sh.Coulomb(), (0, sh.next_sector(0)),
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> disk = disk.with_contacts(shroud=shroud)
    >>> force = sh.EngineOrder(3, pattern={0: 1.0})
    >>> response = sh.frf(sh.HarmonicBalance(disk, force), (20, 60))
    >>> response.n_peaks.item()
    1
    """

    WITHOUT_MATRICES = (
        "expected a structure with matrices, this is one sector of a disk, whose matrices differ "
        "from harmonic to harmonic; use the assembled ring, or one of sectors reduced by "
        "symhbm.craig_bampton"
    )

    structure: Model
    interfaces: Interfaces
    order: int | None
    _waves: dict[int, Matrices]
    _arrays: dict[int, tuple[ComplexArray, ...]]
    _turns: NDArray[np.bool_]

    def __init__(
        self,
        structure: Model,
        left: Iterable[Any],
        right: Iterable[Any],
        n_sectors: int,
        rotation: str | None = None,
    ):
        if not isinstance(structure, Model):
            raise TypeError(f"structure={check.shown(structure)}: expected a Model of one sector")
        if structure.n_contacts:
            raise ValueError(
                "structure: expected a Model without contacts; give them to with_contacts of the "
                "sector"
            )
        n_sectors = check.integer("n_sectors", n_sectors, minimum=2)
        places = structure.places
        ends = _numbers(structure, "left", left), _numbers(structure, "right", right)
        _check_ends(*ends)
        turned, known = rotation_of(places, structure.n_dof, rotation, n_sectors)
        check_geometry(places, *ends, rotation, n_sectors)
        others = np.setdiff1d(np.arange(structure.n_dof), ends[1])
        interfaces = Interfaces(n_sectors, *ends, others, turned)
        self._store(structure=structure, interfaces=interfaces, order=None)
        self._store(places=None if places is None else places.of(others))
        self._store(_turns=known, _waves={}, _arrays={})
        self._check_turns("left", ends[0])
        self._set_contacts({})

    def _check_turns(self, name: str, dofs: NDArray[np.intp]) -> None:
        """Raise ValueError for motions that a rotation cannot turn."""
        for dof in dofs[~self._turns[dofs]][:1]:
            raise ValueError(
                f"{name}: expected both directions across the axis at each node, degree of freedom "
                f"{int(dof)} has one alone"
            )

    def with_contacts(self, **groups: Contacts) -> Self:
        """A copy with other contacts, groups by name, see `Model`; raises as `Model` does.

        Places of the next sector are told by `symhbm.next_sector`, or by the columns ``n_dof`` to
        ``2 n_dof - 1`` of arrays of weights.
        """
        other = object.__new__(type(self))
        kept = ("structure", "places", "interfaces", "order", "_turns", "_waves")
        other._store(**{name: getattr(self, name) for name in kept}, _arrays={})
        other._set_contacts(groups)
        return other

    def _set_contacts(self, contacts: Any, **parameters: Any) -> None:
        super()._set_contacts(contacts, **parameters)
        beyond = np.unique(self._directions_as_named.nonzero()[1]) - self.n_whole
        self._check_turns("next_sector", beyond[beyond >= 0])

    def number_of(self, place: Any) -> int:
        """Number of a place among the degrees of freedom of this sector, then of the next."""
        if isinstance(place, NextSector):
            return self.n_whole + self.structure.number_of(place.place)
        return self.structure.number_of(place)

    @property
    def contact_coordinates(self) -> FloatArray:
        """Where contacts are, amid their nodes in this sector, (n_contacts, 3) [m]."""
        rows = self._directions_as_named.tolil().rows
        own = [{dof for row in each for dof in rows[row]} for each in self.contact_rows]
        inside = [{dof for dof in dofs if dof < self.n_whole} or dofs for dofs in own]
        places = self.structure.places
        result = np.zeros((self.n_contacts, 3))
        for j, dofs in enumerate(inside):
            chosen = np.array(sorted(dofs)) % self.n_whole
            _, first = np.unique(places.node[chosen], return_index=True)
            result[j] = places.coordinates[chosen][first].mean(axis=0)
        return result

    @property
    def _n_named(self) -> int:
        return 2 * self.n_whole

    @property
    def n_sectors(self) -> int:
        """Number of sectors of the disk."""
        return self.interfaces.n_sectors

    @property
    def nodal_diameters(self) -> range:
        """Nodal diameters that differ, 0 to N / 2."""
        return range(self.n_sectors // 2 + 1)

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom of a sector that are not right."""
        return len(self.interfaces.others)

    @property
    def n_whole(self) -> int:
        """Number of degrees of freedom of a sector."""
        return self.structure.n_dof

    @property
    def kept(self) -> NDArray[np.intp]:
        """The degrees of freedom that are not right, as the structure numbers them."""
        return self.interfaces.others

    def under(self, excitation: Excitation) -> Sector:
        """The sector as an engine order moves it.

        Raises ValueError for any other force, and for a sector that is to be condensed.
        """
        if self.n_dof > LARGEST:
            raise ValueError(
                f"model: a sector of {self.n_dof:,} degrees of freedom is to be condensed first, "
                "symhbm.condense(sector, excitation, frequency, harmonics, dofs=...)"
            )
        return self.in_wave(sector_order(excitation, self.n_sectors))

    def in_wave(self, order: int) -> Sector:
        """The sector under an engine order."""
        if order == self.order:
            return self
        other = object.__new__(type(self))
        other._store(**vars(self) | {"order": order})
        return other

    def wave(self, harmonic: int) -> int:
        """Nodal diameters of a harmonic, 0 to N - 1; ValueError without an engine order."""
        if self.order is None and harmonic:
            raise ValueError("order=None: expected a sector under an engine order")
        return harmonic * (self.order or 0) % self.n_sectors

    def matrices(self, nodal_diameter: int | None = None) -> Matrices:
        """``B^H M B``, ``B^H C B`` and ``B^H K B`` of a wave, sparse (n_dof, n_dof), Hermitian.

        Of the degrees of freedom that are not right, ``B`` being `Interfaces.expansion`. Complex
        but for 0 and N / 2 nodal diameters; N - n is n of the other sense, the conjugate.
        """
        n = self._wave_of(nodal_diameter)
        if n not in self._waves:
            expansion = self.interfaces.expansion(n)
            adjoint = expansion.conj().T.tocsr()
            parts = (getattr(self.structure, name) for name in Matrices._fields)
            self._waves[n] = Matrices(*((adjoint @ matrix @ expansion).tocsc() for matrix in parts))
        return self._waves[n]

    def _wave_of(self, nodal_diameter: int | None) -> int:
        if nodal_diameter is None:
            raise ValueError(
                "nodal_diameter=None: expected a number of nodal diameters, a sector moves in waves"
            )
        return check.integer("nodal_diameter", nodal_diameter) % self.n_sectors

    def directions_of(self, nodal_diameter: int | None = None) -> Any:
        """Directions ``w`` of all displacements in a wave, sparse (n_rows, n_dof), complex."""
        named, n = self._directions_as_named, self._wave_of(nodal_diameter)
        return self.interfaces.displacements(n, named)

    def expanded(self, motion: Any, nodal_diameter: int | None = None) -> Any:
        """Motion of all degrees of freedom of the sector from that of those that are not right."""
        return self.interfaces.expansion(self._wave_of(nodal_diameter)) @ motion

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

    @property
    def touched(self) -> set[int]:
        """Degrees of freedom that contacts act on, of those that are not right."""
        reach = abs(self.interfaces.expansion(0))
        named = abs(self._directions_as_named)
        turned = abs(self.interfaces.rotation)
        columns = ((named[:, : self.n_whole] + named[:, self.n_whole :] @ turned) @ reach).nonzero()
        return {*self.kept[np.unique(columns[1])].tolist()}

    def folded(self, force: ComplexArray, nodal_diameter: int) -> ComplexArray:
        """A force on a sector (n_whole, n) as its degrees of freedom feel it, ``B^H f``."""
        return self.interfaces.expansion(nodal_diameter).conj().T @ force

    def split_force(
        self, shape: FloatArray, basis: FourierBasis
    ) -> list[tuple[FloatArray, FloatArray]]:
        """A force on a sector as its degrees of freedom feel it in each harmonic."""
        parts = []
        for harmonic, part in zip(basis.harmonics, basis.by_harmonic(shape), strict=True):
            folded = self.folded(phasors(part), self.wave(harmonic))
            parts.append((components(folded, harmonic), np.zeros((0, part.shape[1]))))
        return parts

    @property
    def static_stiffness(self) -> Any:
        """Stiffness at rest, sparse (n_dof, n_dof) [N/m]."""
        return self.matrices(0).stiffness_matrix

    def dynamic_stiffness(
        self, harmonic: int, frequency: float
    ) -> tuple[ComplexArray, ComplexArray]:
        """``B^H (K + i s C - s^2 M) B``, ``s`` the harmonic's frequency, and its derivative."""
        s = harmonic * frequency
        mass, damping, stiffness = self._dense(self.wave(harmonic))[:3]
        return stiffness + 1j * s * damping - s**2 * mass, harmonic * (1j * damping - 2 * s * mass)

    @property
    def bends(self) -> bool:
        """That it does: its dynamic stiffness is a polynomial of the frequency."""
        return True

    def forces_curvature(self, harmonic: int, frequency: float) -> ComplexArray:
        """Second derivative of the dynamic stiffness by the frequency."""
        return -2 * harmonic**2 * self._dense(self.wave(harmonic))[0]

    def _dense(self, nodal_diameter: int) -> tuple[ComplexArray, ...]:
        """Mass, damping and stiffness matrices of a wave, and directions, as arrays."""
        if nodal_diameter not in self._arrays:
            parts = *self.matrices(nodal_diameter), self.directions_of(nodal_diameter)
            self._arrays[nodal_diameter] = tuple(part.toarray().astype(complex) for part in parts)
        return self._arrays[nodal_diameter]

    def modes_below(self, harmonic: int, frequency: float, springs: FloatArray) -> int:
        """Number of natural frequencies below a harmonic, counted exactly."""
        mass, _, stiffness, directions = self._dense(self.wave(harmonic))
        dynamic = stiffness + weighted(directions.conj().T, springs) @ directions
        return negative_eigenvalues(_hermitian(dynamic) - (harmonic * frequency) ** 2 * mass)

    def modes_near(
        self, harmonic: int, frequency: float, springs: FloatArray, losses: FloatArray
    ) -> NearModes | None:
        """All modes of a wave, with springs and losses; None where a motion has no inertia."""
        mass, damping, stiffness, directions = self._dense(self.wave(harmonic))
        exciting, adjoint = harmonic * frequency, directions.conj().T
        stuck = _hermitian(stiffness + weighted(adjoint, springs) @ directions)
        try:
            squares, shapes = eigh(stuck, mass)
        except np.linalg.LinAlgError:
            return None
        natural = np.sqrt(np.maximum(squares, 1e-300))
        viscous = damping + weighted(adjoint, losses / exciting) @ directions
        width = np.einsum("ik,ij,jk->k", shapes.conj(), viscous, shapes, optimize=True).real / 2
        return NearModes(natural - exciting, width, np.ones(len(natural), dtype=bool), shapes)

    def description(self) -> dict[str, Any]:
        """What tells it apart in a dataset, as JSON keeps it."""
        told = {"type": type(self).__name__, "n_sectors": self.n_sectors, "n_dof": self.n_whole}
        return {"structure": told}

    def __repr__(self) -> str:
        return (
            f"{super().__repr__()}\n  one of {self.n_sectors} sectors of {self.n_whole} degrees of "
            f"freedom, {len(self.interfaces.right)} of them those of the next"
        )


def _hermitian(matrix: ComplexArray) -> ComplexArray:
    return (matrix + matrix.conj().T) / 2


def _numbers(structure: Model, name: str, given: Any) -> NDArray[np.intp]:
    if isinstance(given, (str, bytes)) or not isinstance(given, Iterable):
        raise TypeError(f"{name}={check.shown(given)}: expected a sequence of degrees of freedom")
    return np.array([structure.number_of(place) for place in given], dtype=np.intp)


def _check_ends(left: NDArray[np.intp], right: NDArray[np.intp]) -> None:
    """Raise ValueError unless each degree of freedom on the right is another one on the left."""
    if len(left) != len(right):
        raise ValueError(
            f"left, right: expected as many degrees of freedom, got {len(left)} and {len(right)}"
        )
    both = np.concatenate([left, right])
    numbers, count = np.unique(both, return_counts=True)
    if np.any(count > 1):
        raise ValueError(
            f"left, right: expected each degree of freedom once, {int(numbers[count > 1][0])} is "
            "there twice; hold what is on the axis of the disk, or leave it out of both"
        )
