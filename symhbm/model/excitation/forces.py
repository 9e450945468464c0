"""Forces: at a point, the wave of an engine order, any harmonic pattern, and those at rest.

What does not change with time is weight, the pull of rotation, or an assembly force.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from symhbm.model.excitation.excitation import Excitation
from symhbm.model.excitation.frequency_force import leaves
from symhbm.model.excitation.values import (
    acting,
    check_contained,
    check_pattern,
    check_values,
    scaled,
    shape_of,
    spread,
)
from symhbm.model.places import Place, check_place
from symhbm.numerics import FloatArray, FourierBasis, check, check_harmonics


@dataclass(frozen=True, repr=False)
class StaticLoad(Excitation):
    """Constant force ``values`` [N]: one value per degree of freedom, or ``{dof: value}``.

    A ``dof`` is a number, or a name in a structure with places, as in ``{"tip:x": 5.0}``. The load
    acts on harmonic 0, which responses need, and ``force_amplitude`` of a sum leaves it as it is,
    as the speed of rotation does along an engine order.
    By itself it does not oscillate and has no named parameter.

    Raises TypeError or ValueError for what is neither, and for values that are not finite.

    Examples
    --------
    A blade that vibrates about the place where 20 N hold it:

    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> force = sh.forces.PointForce(amplitude=2.0) + sh.forces.StaticLoad([20.0])
    >>> point = sh.solve(sh.HarmonicBalance(blade, force, (0, 1)), 19.5)
    >>> point.coefficient.sel(harmonic=0, component="cos").values.round(6)
    array([0.002])
    """

    values: Any

    _fields: ClassVar = {}
    _of_places: ClassVar = ("values",)

    def __post_init__(self):
        object.__setattr__(self, "values", check_values("values", self.values))

    @property
    def amplitude(self) -> float:  # type: ignore[override]
        """Nothing oscillates."""
        return 0.0

    @property
    def still(self) -> Excitation:
        """All of it."""
        return self

    def shape(self, n_dof: int, basis: FourierBasis) -> FloatArray:
        """Nothing, ``(n_dof, n_components)``."""
        return np.zeros((n_dof, basis.n_components))

    def static(self, n_dof: int) -> FloatArray:
        """The load, ``(n_dof,)`` [N]; ValueError if it misfits."""
        return spread("values", self.values, n_dof)


@dataclass(frozen=True, repr=False)
class PointForce(Excitation):
    """Force ``amplitude cos(harmonic omega t + phase)`` on one degree of freedom [N, rad].

    ``place`` is its number, or its name in a structure with places, as ``"tip:y"``.

    Examples
    --------
    One newton on the tip of a structure whose places are known:

    >>> import numpy as np
    >>> import symhbm as sh
    >>> tip = sh.Places(node=[7, 7], direction=["x", "y"], label=["tip", "tip"])
    >>> blade = sh.Model(np.eye(2), np.eye(2), 1e4 * np.eye(2), places=tip)
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce("tip:y", amplitude=1.0))
    >>> sh.solve(problem, 10.0).amplitude.values.round(8)
    array([0.        , 0.00016522])
    """

    place: Place = 0
    amplitude: float = 1.0
    phase: float = 0.0
    harmonic: int = 1

    _of_places: ClassVar = ("place",)

    def __post_init__(self):
        put = object.__setattr__
        put(self, "place", check_place("place", self.place))
        put(self, "amplitude", check.scalar("amplitude", self.amplitude))
        put(self, "phase", check.scalar("phase", self.phase))
        put(self, "harmonic", check.integer("harmonic", self.harmonic, 1))

    def shape(self, n_dof: int, basis: FourierBasis) -> FloatArray:
        """Coefficients at unit amplitude, ``(n_dof, n_components)``; ValueError if out of range."""
        dof = check.integer("place", self.place, 0, n_dof - 1)
        turned = complex(np.cos(self.phase), np.sin(self.phase))
        return shape_of({self.harmonic: {dof: turned}}, n_dof, basis)


@dataclass(frozen=True, repr=False)
class EngineOrder(Excitation):
    """Travelling wave ``amplitude cos(harmonic omega t - 2 pi order i / N)`` on blade i, Eq. (12).

    This is how the source's Eq. (12) is read. As printed it has no time, and its cosine and sine
    add up to an amplitude of ``sqrt(2) f0``; as forces in phase they would move tuned blades
    differently.

    ``places`` lists the degrees of freedom of the N blades in their order around the disk, by
    number or by name; by default all degrees of freedom. Orders ``order`` and ``order + N`` are the
    same force.

    A `symhbm.Sector` needs a ``pattern``: the force ``amplitude Re(p_h exp(i h omega t))`` on one
    sector, a pressure field for example, that on the next ones lags by ``h order`` times the angle
    between them. ``{dof: p}``, by numbers or names, and an array ``p`` (n_dof,) are of harmonic 1,
    ``{harmonic: such}`` of any; where amplitudes are complex, their phases count.

    Examples
    --------
    >>> import symhbm as sh
    >>> force = sh.forces.EngineOrder(3, amplitude=2.0, pattern={1: {0: 1.0, 4: 0.5j}, 2: {0: 0.1}})
    """

    order: int
    amplitude: float = 1.0
    places: Sequence[Place] | None = None
    harmonic: int = 1
    pattern: Mapping[Any, Any] | ArrayLike | None = None

    _fields: ClassVar = {"force_amplitude": "amplitude", "engine_order": "order"}
    _of_places: ClassVar = ("places", "pattern")

    def __post_init__(self):
        put = object.__setattr__
        put(self, "order", check.integer("engine_order", self.order))
        put(self, "amplitude", check.scalar("amplitude", self.amplitude))
        put(self, "harmonic", check.integer("harmonic", self.harmonic, 1))
        if self.places is not None:
            if isinstance(self.places, str) or not isinstance(self.places, Iterable):
                raise TypeError(f"places={check.shown(self.places)}: expected a sequence of DOFs")
            places = tuple(check_place("places", dof) for dof in self.places)
            if not places or len(set(places)) != len(places):
                raise ValueError(f"places={check.shown(self.places)}: expected distinct DOFs")
            put(self, "places", places)
        if self.pattern is not None:
            if self.places is not None or self.harmonic != 1:
                raise ValueError(
                    "pattern: expected places=None and harmonic=1 beside it, it tells degrees of "
                    "freedom and harmonics itself"
                )
            put(self, "pattern", check_pattern(self.pattern))

    @property
    def speed_ratios(self) -> frozenset[float]:
        """``order / harmonic``; none of order 0, which does not tell how fast it turns."""
        return frozenset({abs(self.order) / self.harmonic} if self.order else ())

    def shape(self, n_dof: int, basis: FourierBasis) -> FloatArray:
        """Coefficients at unit amplitude, ``(n_dof, n_components)``; ValueError if out of range.

        Those of a pattern are of one sector.
        """
        if self.pattern is not None:
            return shape_of(self.pattern, n_dof, basis)  # type: ignore[arg-type]
        given = range(n_dof) if self.places is None else self.places
        blades = [check.integer("places", dof, 0, n_dof - 1) for dof in given]
        # Reduced in integers first, so that aliased orders give the same force to the bit.
        count = len(blades)
        turns = (self.order % count * np.arange(count)) % count / count
        wave = np.cos(2 * np.pi * turns) - 1j * np.sin(2 * np.pi * turns)
        return shape_of({self.harmonic: dict(zip(blades, wave, strict=True))}, n_dof, basis)

    def fields(self) -> dict[str, Any]:
        """What makes it again, of a pattern what acts."""
        pattern = None if self.pattern is None else acting(self.pattern)  # type: ignore[arg-type]
        return super().fields() | {"pattern": pattern}


@dataclass(frozen=True, repr=False)
class HarmonicForce(Excitation):
    """Any force: ``amplitude sum_n cosine[n] cos(n omega t) + sine[n] sin(n omega t)``.

    ``cosine`` and ``sine`` map a harmonic to one coefficient per degree of freedom, or to
    ``{dof: coefficient}`` by numbers or names, dimensionless where ``amplitude`` is in N.
    ``amplitude cosine[0]`` does not oscillate: it becomes the ``mean`` [N], by degree of freedom as
    they are, which stays as it is when ``force_amplitude`` changes.

    Examples
    --------
    Unit force on the first of two degrees of freedom, and a tenth of it at the third harmonic:

    >>> import symhbm as sh
    >>> force = sh.forces.HarmonicForce(cosine={1: [1, 0]}, sine={3: [0.1, 0]}, amplitude=2.0)
    """

    cosine: Mapping[int, ArrayLike] = field(default_factory=dict)
    sine: Mapping[int, ArrayLike] = field(default_factory=dict)
    amplitude: float = 1.0
    mean: ArrayLike | Mapping[Place, float] | None = None

    _of_places: ClassVar = ("cosine", "sine", "mean")

    def __post_init__(self):
        put = object.__setattr__
        put(self, "amplitude", check.scalar("amplitude", self.amplitude))
        for name in ("cosine", "sine"):
            given = getattr(self, name)
            check.instance(name, given, Mapping, "a mapping from harmonics")
            lowest = 1 if name == "sine" else 0
            table = {
                check.integer(f"harmonic of {name}", harmonic, lowest): check_values(
                    f"{name}[{harmonic}]", values
                )
                for harmonic, values in given.items()
            }
            put(self, name, table)
        if not self.cosine and not self.sine and self.mean is None:
            raise ValueError("cosine={}, sine={}: expected at least one harmonic")
        check_harmonics({*self.cosine, *self.sine, 1})
        mean = self.mean
        if 0 in self.cosine:
            if mean is not None:
                raise ValueError(f"mean={check.shown(mean)}: expected None beside cosine[0]")
            # The table is this force's own.
            mean = scaled(self.cosine.pop(0), self.amplitude)  # type: ignore[attr-defined]
        if mean is not None:
            put(self, "mean", check_values("mean", mean))

    def shape(self, n_dof: int, basis: FourierBasis) -> FloatArray:
        """Coefficients at unit amplitude, ``(n_dof, n_components)``; ValueError if they misfit."""
        shape = np.zeros((n_dof, basis.n_components))
        for name, table in (("cosine", self.cosine), ("sine", self.sine)):
            for harmonic, row in table.items():
                check_contained(harmonic, basis)
                values = spread(f"{name}[{harmonic}]", row, n_dof)  # type: ignore[arg-type]
                shape[:, basis.component(harmonic, name == "sine")] = values
        return shape

    def static(self, n_dof: int) -> FloatArray:
        """The mean, ``(n_dof,)`` [N]; ValueError if it misfits."""
        if self.mean is None:
            return super().static(n_dof)
        return spread("mean", self.mean, n_dof)  # type: ignore[arg-type]

    @property
    def still(self) -> Excitation | None:
        """The mean alone."""
        return None if self.mean is None else replace(self, cosine={}, sine={})


@dataclass(frozen=True, repr=False)
class FieldForce(Excitation):
    """Force ``amplitude Re(p_h exp(i h omega t))``, complex ``p_h`` over degrees of freedom.

    ``pattern`` is an array (n_dof,), ``{dof: p}`` by numbers or names, or a field over nodes and
    directions, see `nodal_field`, also as an xarray DataArray with these two dimensions. Such are
    of harmonic 1; ``{harmonic: such}`` tells others. On a reduced or condensed structure degrees of
    freedom are those of the whole one.

    Raises TypeError or ValueError for what is none of these and for numbers that are not finite;
    a problem raises for a length that is not n_dof and for unknown places.

    Examples
    --------
    >>> import symhbm as sh
    >>> force = sh.forces.FieldForce([1.0, 0.5j], amplitude=3.0)
    >>> named = sh.forces.FieldForce({1: {"tip:x": 1.0}, 2: {"tip:x": 0.1j, "root:y": 0.2}})
    """

    pattern: Any
    amplitude: float = 1.0

    _of_places: ClassVar = ("pattern",)

    def __post_init__(self):
        object.__setattr__(self, "amplitude", check.scalar("amplitude", self.amplitude))
        object.__setattr__(self, "pattern", check_pattern(self.pattern))

    def shape(self, n_dof: int, basis: FourierBasis) -> FloatArray:
        """Coefficients at unit amplitude, ``(n_dof, n_components)``; ValueError if they misfit."""
        return shape_of(self.pattern, n_dof, basis)

    def fields(self) -> dict[str, Any]:
        """What makes it again, of the pattern what acts."""
        return super().fields() | {"pattern": acting(self.pattern)}


def sector_order(force: Excitation, n_sectors: int) -> int:
    """The engine order of a force on one of ``n_sectors``, below that number.

    Raises ValueError for a force that does not go around the disk, or without a pattern.
    """
    moving = [part for part in leaves(force) if not isinstance(part, StaticLoad)]
    for part in moving:
        if not isinstance(part, EngineOrder) or part.pattern is None:
            raise ValueError(
                f"excitation={check.shown(part)}: expected an EngineOrder(order, pattern=...) with "
                "the force on one sector, and static loads beside it"
            )
    orders = {part.order % n_sectors for part in moving}  # type: ignore[attr-defined]
    if len(orders) != 1:
        raise ValueError(
            f"excitation={check.shown(force)}: expected one engine order for all, up to multiples "
            f"of the {n_sectors} sectors"
        )
    return orders.pop()


def check_whole(force: Excitation) -> None:
    """Raise ValueError for the pattern of one sector: there it acts, and not on a whole disk."""
    for part in leaves(force):
        if isinstance(part, EngineOrder) and part.pattern is not None:
            raise ValueError(
                "excitation: pattern is the force on one sector of a symhbm.Sector, expected None "
                "for a whole structure, with places=..., or a symhbm.forces.HarmonicForce"
            )
