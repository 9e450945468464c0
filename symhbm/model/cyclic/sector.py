"""A disk of identical sectors, given by the matrices of one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.model.cyclic.influence import Coupling, Influence
from symhbm.model.cyclic.rotating import RotatingModel
from symhbm.model.cyclic.waves import Blade, Interfaces, check_geometry, paired, rotation_of
from symhbm.model.excitation import EngineOrder, Excitation, StaticLoad, sector_order
from symhbm.model.linear import Matrices, RelativeCoordinates, phasors
from symhbm.model.matrices import Model, PolynomialStructure
from symhbm.numerics import FourierBasis, check

LARGEST = 300
"""Degrees of freedom of a sector that is balanced as it is: larger ones are condensed."""
_NO_WORK = 1e-12
"""Imaginary part of the stiffness of air in a wave, over its size, that is round-off."""


class Sector(PolynomialStructure):
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
        Its two interfaces. Labels of their nodes, which are paired by their coordinates, turned by
        one sector; or degrees of freedom in the same order. Right of a sector is left of the next,
        the way the axis of rotation turns:

        .. code-block:: text

                  turns this way about the axis  --->
            ... right | left   this sector   right | left   next sector ...
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
    Contacts of `with_contacts` are those of one sector. One to the neighbour is defined from one
    side alone, the place beyond by `symhbm.next_sector`; two definitions, one from each side, are
    two contacts. Contacts may act on the interfaces; one on both sides of a cut is given once, left
    or right. Its degrees of freedom are those that are not right.

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
    ...     sh.laws.Coulomb(), (0, sh.next_sector(0)),
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> disk = disk.with_contacts(shroud=shroud)
    >>> force = sh.forces.EngineOrder(3, pattern={0: 1.0})
    >>> response = sh.frf(sh.HarmonicBalance(disk, force), (20, 60))
    >>> response.n_peaks.item()
    1
    """

    WITHOUT_MATRICES = (
        "expected a structure with matrices, this is one sector of a disk, whose matrices differ "
        "from harmonic to harmonic; symhbm.mistuned_ring makes the ring of all sectors, mostly of "
        "one that symhbm.craig_bampton has reduced"
    )

    stored = "structure", "interfaces", "influences", "_turns", "blade"
    structure: Model
    interfaces: Interfaces
    influences: tuple[Coupling, ...]
    blade: Blade | None = None
    _waves: dict[int, Matrices]
    _turns: NDArray[np.bool_]

    def __init__(
        self,
        structure: Model,
        left: str | Iterable[Any],
        right: str | Iterable[Any],
        n_sectors: int,
        rotation: str | None = None,
    ):
        check.instance("structure", structure, Model, "a Model of one sector")
        if structure.n_contacts:
            raise ValueError(
                "structure: expected a Model without contacts; give them to with_contacts of the "
                "sector"
            )
        n_sectors = check.integer("n_sectors", n_sectors, minimum=2)
        places = structure.places
        turned, known = rotation_of(places, structure.n_dof, rotation, n_sectors)
        if isinstance(left, str) and isinstance(right, str):
            ends = paired(places, left, right, rotation or "z", n_sectors)
        else:
            ends = _numbers(structure, "left", left), _numbers(structure, "right", right)
        _check_ends(*ends)
        check_geometry(places, *ends, rotation, n_sectors)
        others = np.setdiff1d(np.arange(structure.n_dof), ends[1])
        self._store(**_of(structure, Interfaces(n_sectors, *ends, others, turned)))
        self._store(places=None if places is None else places.of(others))
        self._store(_turns=known, influences=())
        self._check_turns("left", ends[0])
        self._set_contacts({})

    def _check_turns(self, name: str, dofs: NDArray[np.intp]) -> None:
        """Raise ValueError for motions that a rotation cannot turn."""
        for dof in dofs[~self._turns[dofs]][:1]:
            places = self.structure.places
            place = f"degree of freedom {int(dof)}" if places is None else places.name(int(dof))
            raise ValueError(
                f"{name}: expected both directions across the axis at each node, {place} is there "
                "alone; hold both or none at sides, of supports along one of them"
            )

    def _set_contacts(self, contacts: Any, **parameters: Any) -> None:
        super()._set_contacts(contacts, **parameters)
        beyond = np.unique(self._directions_as_named.nonzero()[1]) - self.n_whole
        self._check_turns("next_sector", beyond[beyond >= 0])

    @property
    def n_sectors(self) -> int:
        """Number of sectors of the disk."""
        return self.interfaces.n_sectors

    def loss_stiffness(self, nodal_diameter: int | None = None) -> Any:
        """That of the structure in a wave, without the air."""
        expansion = self.interfaces.expansion(self._wave_of(nodal_diameter))
        return (expansion.conj().T @ self.structure.loss_stiffness() @ expansion).tocsc()

    def under(self, excitation: Excitation) -> Sector:
        """The sector as an engine order moves it.

        Raises ValueError for any other force, and for a sector that is to be condensed.
        """
        if self.n_dof > LARGEST:
            raise ValueError(
                f"model: a sector of {self.n_dof:,} degrees of freedom is to be condensed first, "
                "symhbm.condense(sector, excitation, frequency_band, harmonics, places=...)"
            )
        order = sector_order(excitation, self.n_sectors)
        along = _of(self.structure.along(excitation), self.interfaces)
        return self._copy(**along | {"order": order, "_waves": self._waves})

    def at(self, speed: float) -> Sector:
        """The sector of a `RotatingModel` at one speed [1/min]."""
        if not isinstance(self.structure, RotatingModel):
            raise TypeError("structure: expected a RotatingModel, whose matrices change with speed")
        own = _of(self.structure.at(speed), self.interfaces)
        return self._copy(**own, groups=self.groups.at(speed))

    def without_rule(self) -> Sector:
        """The same without a rule of damping of its structure."""
        own = self.structure.without_rule()
        return self if own is self.structure else self._copy(**_of(own, self.interfaces))

    def with_influences(self, *influences: Influence) -> Sector:
        """A copy with aerodynamic forces between its blades, and no others."""
        for influence in influences:
            check.instance("influences", influence, Influence, "symhbm.Influence")
        whole = self.number_of, self.n_numbered, self.n_sectors
        return self.under_forces(each.along(*whole) for each in influences)

    def under_forces(self, couplings: Iterable[Coupling]) -> Sector:
        """A copy under such forces on all degrees of freedom that have a number."""
        if (basis := self.structure._lift) is not None:
            couplings = (
                each._replace(column=sp.csc_array(basis.T @ each.column.toarray()))
                for each in couplings
            )
        return self._copy(influences=tuple(couplings), _waves={})

    def along_contacts(self, relative: RelativeCoordinates) -> Sector:
        """The same with displacements of contacts in place of some degrees of freedom."""
        given = self.interfaces._replace(relative=relative, directions=self._directions_as_named)
        return self._copy(interfaces=given, _waves={})

    def in_wave(self, order: int) -> Sector:
        """The sector under an engine order."""
        return self if order == self.order else self._copy(order=order)

    def matrices(self, nodal_diameter: int | None = None) -> Matrices:
        """``B^H M B``, ``B^H C B`` and ``B^H K B`` of a wave, sparse (n_dof, n_dof), Hermitian.

        Of the degrees of freedom that are not right, ``B`` being `Interfaces.expansion`. Complex
        but for 0 and N / 2 nodal diameters; N - n is n of the other sense, the conjugate.
        """
        n = self._wave_of(nodal_diameter)
        if n not in self._waves:
            expansion = self.interfaces.expansion(n)
            adjoint = expansion.conj().T.tocsr()
            model = self.structure

            def seen(matrix: Any) -> Any:
                return (adjoint @ matrix @ expansion).tocsc()

            mass, stiffness = seen(model.mass_matrix), seen(model.stiffness_matrix)
            # Modes that a rule damps are those of a wave, not of a sector that is free.
            damping = model.damping_seen(seen, mass, stiffness)
            for influence in self.influences:
                column = adjoint @ influence.column
                along = (column @ column.conj().T).tocsc()
                of_damping, of_stiffness = influence.in_wave(n, self.n_sectors)
                damping, stiffness = damping + of_damping * along, stiffness + of_stiffness * along
            self._waves[n] = Matrices(mass, damping, stiffness)
        return self._waves[n]

    def dissipates(self, harmonics: Sequence[int]) -> bool:
        """Whether damping and air give energy to no motion of the waves of some harmonics."""
        for influence in self.influences:
            for wave in {n * (self.order or 0) % self.n_sectors for n in harmonics}:
                damping, stiffness = influence.in_wave(wave, self.n_sectors)
                if damping.real < 0 or abs(stiffness.imag) > _NO_WORK * abs(stiffness):
                    return False
        return True

    def rotation_powers(self, harmonic: int) -> dict[int, Any]:
        """Those of the structure, in the wave of a harmonic."""
        expansion = self.interfaces.expansion(self.wave(harmonic))
        adjoint, parts = expansion.conj().T, self.structure.rotation_powers(harmonic)
        return {power: adjoint @ part @ expansion for power, part in parts.items()}

    @classmethod
    def of_fields(cls, **fields: Any) -> Sector:
        """The sector of its `fields`, without contacts, under no engine order yet."""
        places, interfaces = fields["structure"].places, fields["interfaces"]
        places = None if places is None else places.of(interfaces.others)
        return super().of_fields(**fields | _of(fields["structure"], interfaces), places=places)

    def as_felt(self, excitation: Excitation, basis: FourierBasis) -> Excitation:
        """An excitation on the sector itself, of one reduced from a larger one."""
        if self.structure.kept is None:
            return excitation
        order = excitation.parameters.get("engine_order", self.order)
        waves: dict[int, Excitation] = {}
        for power, shape in self.structure.felt_shapes(excitation, basis).items():
            each = zip(basis.harmonics, basis.by_harmonic(shape), strict=True)
            pattern = {harmonic: phasors(part) for harmonic, part in each if harmonic}
            amplitude = 1.0 if excitation.changes else excitation.amplitude
            waves[power] = EngineOrder(order, amplitude, pattern=pattern)
        wave = waves[0] if not excitation.changes else excitation.with_forces(waves)
        static = self.static_load(excitation, basis)
        return wave + StaticLoad(static) if static.any() else wave

    @property
    def remark(self) -> str:
        """What else to tell of it in a line."""
        return (
            f"one of {self.n_sectors} sectors of {self.n_whole} degrees of "
            f"freedom, {len(self.interfaces.right)} of them those of the next"
        )


def _of(structure: Model, interfaces: Interfaces) -> dict[str, Any]:
    """What a sector has of its structure, one reduced from a larger one for example."""
    others, kept = interfaces.others, structure.kept
    same = "made_by", "reduced_from", "speed", "engine_order", "loss_factor"
    return {name: getattr(structure, name) for name in same} | dict(
        structure=structure,
        beneath=structure,
        interfaces=interfaces,
        kept=others if kept is None else kept[others],
        _n_dof=len(others),
        _waves={},
    )


def _numbers(structure: Model, name: str, given: Any) -> NDArray[np.intp]:
    if isinstance(given, (str, bytes)) or not isinstance(given, Iterable):
        raise TypeError(
            f"{name}={check.shown(given)}: expected a sequence of degrees of freedom, or labels of "
            "both interfaces"
        )
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
