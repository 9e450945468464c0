"""Motion of the base that holds a structure, as the force that it makes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from symhbm.model.excitation.excitation import Changing, Excitation
from symhbm.model.excitation.forces import EngineOrder, FieldForce
from symhbm.model.excitation.frequency_force import FrequencyForce
from symhbm.model.excitation.values import check_values, complex_number, shape_of, spread
from symhbm.model.places import Place
from symhbm.numerics import ComplexArray, FloatArray, FourierBasis, check

_GIVEN = {"displacement": "m", "velocity": "m s-1", "acceleration": "m s-2"}
"""What is given of the base, in the order of derivatives."""
_ROUND_OFF = 1e-12
"""Change of a translation by a turn of the disk, relative, that is round-off."""


@dataclass(frozen=True, repr=False, kw_only=True)
class BaseMotion(Changing):
    """Motion ``Re(u exp(i harmonic omega t))`` of the base that all springs to the ground stand on.

    One of ``displacement`` [m], ``velocity`` [m/s] and ``acceleration`` [m/s^2] is its complex
    amplitude, the same at all frequencies; its size is the parameter ``force_amplitude``. A base
    that moves otherwise over the frequency is a `FrequencyForce`.

    Parameters
    ----------
    displacement, velocity, acceleration
        One of them [m, m/s, m/s^2].
    direction
        ``"x"``, ``"y"``, ``"z"`` or ``"axial"``: the base translates along it, in a structure with
        places. Without, all degrees of freedom are along the motion.
    influence : (n_dof,) or {dof: value}
        Where the structure goes with a unit motion of the base that deforms nothing, instead.
    harmonic
        Harmonic of the excitation frequency.
    motion
        ``"relative"``: displacements are those relative to the base, and the ground of contacts
        moves with it. ``"absolute"``: they are absolute, and the ground of contacts stands still.
        Results state it, and `symhbm.datasets.seen_from` gives one from the other.

    Raises
    ------
    TypeError, ValueError
        Unless exactly one amplitude is given, and for bad values; a problem raises for directions
        that its structure has not, for one whose speed changes, for Coriolis forces along the
        motion, and for one without matrices.

    Notes
    -----
    Relative, with ``x = z + r u``: ``M z'' + C z' + K z + f(z) = -M r u''``, whatever damping is,
    where all of it is between the structure and the base. Absolute: ``C r u' + K r u`` on the right
    side. ``M`` is the mass matrix of what is free: what a consistent one couples to nodes that are
    held is left out. Where some supports move, or some nodes of the matrices are prescribed, a
    `FrequencyForce` of their stiffness, damping and mass is the force.

    A reduced or condensed structure takes ``motion.on(structure)``, made with the matrices of the
    whole one, as does a `symhbm.Sector` for a motion along its axis.

    Examples
    --------
    A blade on a shaker, 1 m/s^2 at all frequencies:

    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.BaseMotion(acceleration=1.0))
    >>> response = sh.frf(problem, (10, 30))
    >>> response.attrs["displacements"], response.peak_amplitude.values.round(7)
    ('relative to the moving base', array([0.0003085]))
    """

    displacement: complex | None = None
    velocity: complex | None = None
    acceleration: complex | None = None
    direction: str | None = None
    influence: ArrayLike | Mapping[Place, float] | None = None
    harmonic: int = 1
    motion: Literal["relative", "absolute"] = "relative"
    amplitude: float = None  # type: ignore[assignment]

    _of_places: ClassVar = ("influence",)

    def __post_init__(self):
        put = object.__setattr__
        given = {name: getattr(self, name) for name in _GIVEN if getattr(self, name) is not None}
        if len(given) != 1:
            raise ValueError(
                f"displacement, velocity, acceleration: expected one of them, got {len(given)}"
            )
        ((name, value),) = given.items()
        number = complex_number(name, value)
        put(self, name, number)
        size = abs(number) if self.amplitude is None else self.amplitude
        put(self, "amplitude", check.scalar("amplitude", size))
        put(self, "harmonic", check.integer("harmonic", self.harmonic, 1))
        check.one_of("motion", self.motion, ("relative", "absolute"))
        if self.direction is not None:
            check.one_of("direction", self.direction, ("x", "y", "z", "axial"))
            if self.influence is not None:
                raise ValueError("influence: expected None beside a direction")
        if self.influence is not None:
            put(self, "influence", check_values("influence", self.influence))

    @property
    def _name(self) -> str:
        return next(name for name in _GIVEN if getattr(self, name) is not None)

    @property
    def units(self) -> str:  # type: ignore[override]
        """Units of what is given of the base."""
        return _GIVEN[self._name]

    @property
    def meaning(self) -> str:  # type: ignore[override]
        """What its amplitude is."""
        return f"amplitude of the {self._name} of the base"

    @property
    def of_matrices(self) -> frozenset[str]:
        """The mass matrix, or in absolute displacements those of springs and dashpots."""
        return frozenset(["mass"] if self.motion == "relative" else ["stiffness", "damping"])

    def shapes(self, structure: Any, basis: FourierBasis) -> dict[int, FloatArray]:
        """Coefficients at unit amplitude by the power of the angular frequency."""
        _check_whole(structure)
        return {
            power: shape_of({self.harmonic: force}, structure.n_dof, basis)
            for power, force in self._forces(structure).items()
        }

    def translation(self, structure: Any) -> FloatArray:
        """Where a structure goes with a unit motion of the base, (n_dof,).

        Raises ValueError for a direction that it has not.
        """
        n_dof, places = structure.n_dof, structure.places
        if self.influence is not None:
            result = spread("influence", self.influence, n_dof)  # type: ignore[arg-type]
        else:
            known = [] if places is None else np.unique(places.direction).tolist()
            if self.direction is None and len(known) > 1:
                raise ValueError(
                    "direction=None: expected that of the base, or influence, in a structure with "
                    f"the directions {', '.join(known)}"
                )
            if self.direction is not None and self.direction not in known:
                raise ValueError(
                    f"direction={self.direction!r}: expected one of the structure, which has "
                    f"{', '.join(known) or 'no places'}"
                )
            result = np.ones(n_dof)
            if places is not None and self.direction is not None:
                result = (places.direction == self.direction).astype(float)
        if not result.any():
            raise ValueError("influence: expected a motion, all values are 0")
        return result

    def _forces(self, structure: Any) -> dict[int, ComplexArray]:
        """Complex forces (n_dof,) at unit amplitude, by the power of the angular frequency.

        On all degrees of freedom of a sector.
        """
        interfaces = getattr(structure, "interfaces", None)
        model = structure if interfaces is None else structure.structure
        moved, n = self.translation(model), self.harmonic
        _check_axis(model, moved)
        given = complex(getattr(self, self._name))
        phase = given / abs(given) if given else 1.0
        # The displacement is what is given over so many powers of i n omega.
        order = [*_GIVEN].index(self._name)
        if self.motion == "relative":
            inertia = model.mass_matrix @ moved
            return {2 - order: phase * n**2 * (1j * n) ** -order * inertia}
        elastic = model.stiffness_matrix @ moved.astype(complex)
        if model.loss_factor:
            elastic = elastic + 1j * (model.loss_stiffness() @ moved)
            return {-order: phase * (1j * n) ** -order * elastic}
        if interfaces is None or model.damping is None:
            viscous = model.damping_matrix @ moved
        else:  # modes that a rule damps are those of the disk
            viscous, own = np.zeros(len(moved)), interfaces.others
            viscous[own] = (
                structure.with_influences().matrices(0).damping_matrix @ moved[own]
            ).real
        return {
            -order: phase * (1j * n) ** -order * elastic,
            1 - order: phase * (1j * n) ** (1 - order) * viscous,
        }

    def on(self, structure: Any) -> Excitation:
        """The force that matrices of a structure make of it: they may be reduced afterwards.

        Of a `symhbm.Sector`, whose base moves along the axis, a force of engine order 0. Raises
        TypeError or ValueError as a problem does.
        """
        placed = self.placed(structure.number_of)
        interfaces = getattr(structure, "interfaces", None)
        whole = structure if interfaces is None else structure.structure
        _check_whole(whole)
        if self.motion == "absolute" and getattr(whole, "speeds", None) is not None:
            raise ValueError(
                "excitation: expected a structure at one speed, RotatingModel.at(speed), for a "
                "motion in absolute displacements: their force is of the stiffness, which changes"
            )
        moved = placed.translation(whole)
        if interfaces is not None:
            turned = interfaces.rotation @ moved
            if np.abs(turned - moved).max() > _ROUND_OFF * np.abs(moved).max():
                raise ValueError(
                    f"direction={self.direction!r}: expected a motion of the base along the axis "
                    "of the disk, any other moves each sector in another direction of its own"
                )
        forces: dict[int, Excitation] = {}
        for power, force in placed._forces(structure).items():
            pattern = {self.harmonic: force}
            forces[power] = (
                FieldForce(pattern) if interfaces is None else EngineOrder(0, pattern=pattern)
            )
        return replace(placed, influence=moved, direction=None).with_forces(forces)

    def with_forces(self, forces: dict[int, Excitation]) -> Excitation:
        """The same amplitude with these forces."""
        return FrequencyForce(forces, self.amplitude, self.units, self.meaning, self)


def bases_of(excitation: Excitation) -> list[BaseMotion]:
    """The motions of the base that an excitation is made of."""
    parts = getattr(excitation, "scaled", (excitation,))
    bases = [getattr(part, "base", None) or part for part in parts]
    pairs = zip(parts, bases, strict=True)
    return [replace(b, amplitude=p.amplitude) for p, b in pairs if isinstance(b, BaseMotion)]


def motions_of_base(excitation: Excitation) -> set[str]:
    """What displacements are under an excitation: relative, absolute, or none without a base."""
    return {base.motion for base in bases_of(excitation)}


def _check_axis(structure: Any, moved: FloatArray) -> None:
    """Raise ValueError for a motion across the axis that a structure at one speed turns about."""
    if structure.speed is None:
        return
    # What is not symmetric of its damping matrix are Coriolis forces.
    damping = structure.damping_matrix if structure.damping is None else structure.coriolis_matrix
    if damping is None:
        return
    largest = (abs(damping) @ np.abs(moved)).max()
    if np.abs(damping @ moved - damping.T @ moved).max() > _ROUND_OFF * largest:
        raise ValueError(
            "excitation: expected a motion of the base along the axis of rotation, where no "
            "Coriolis forces act; across it the base moves a structure that turns in directions "
            "that change, give the force as a symhbm.forces.FrequencyForce"
        )


def _check_whole(structure: Any) -> None:
    """Raise TypeError or ValueError for a structure whose matrices do not make the force."""
    if getattr(structure, "interfaces", None) is not None or structure.kept is not None:
        raise TypeError(
            "excitation: expected BaseMotion(...).on(structure) with the matrices of the whole "
            "structure, this one is reduced, condensed or a sector"
        )
    if structure.engine_order is not None:
        raise ValueError(
            "excitation: expected a structure that does not turn; a base moves one that turns in "
            "directions that change, give the force as a symhbm.forces.FrequencyForce"
        )
