"""Small problems by name: laws x structures x forces x harmonics, each built when asked for.

A blade has three directions at its tip, x and y along the contact and z across it, on one mass of
the disk; all structures are made of it. A cell is a name as ``"coulomb chain point 1"``.
"""

import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import combinations
from typing import Any, ClassVar, NamedTuple

import casadi as ca
import numpy as np
import pytest

import symhbm as sh

N_SECTORS, ORDER = 4, 1
BAND = (14.0, 40.0)
"""Frequencies [Hz] that hold the lowest modes of all structures."""
TIP = np.array([[2.0e4, -3e3, 1e3], [-3e3, 2.8e4, 2e3], [1e3, 2e3, 3.5e4]])
SKEW = np.array([[0, 1.0, 0.5], [-1.0, 0, 0.2], [-0.5, -0.2, 0]])
FRICTION = dict(contact_stiffness=6e3, friction_coefficient=0.4, normal_load=1.5)
PRESSES = dict(normal_stiffness=5e3)

BLADE: dict[str, Any] = dict(
    mass=1.0, stiffness=1e4, damping=0.5,
    contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3.0,
)  # fmt: skip
"""Named parameters of the blade that most tests ask."""


def one_blade(**changes: Any) -> Any:
    """That blade, with other values of some parameters."""
    return sh.single_blade(**BLADE | changes)


def ring_of_blades(n_blades: int, **changes: Any) -> Any:
    """A ring of such blades, each in contact with the next one."""
    return sh.bladed_disk(n_blades, **BLADE | changes)


def duffing(
    harmonics: Iterable[int] = (1,), damping: float = 0.05, cubic: float = 0.1, force: float = 0.18
) -> sh.HarmonicBalance:
    """One mass of 1 kg on a spring of 1 N/m that stiffens, whose response folds by default."""
    model = sh.Model([[1.0]], [[damping]], [[1.0]], contacts=[(0,)], cubic_stiffness=cubic)
    return sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=force), tuple(harmonics))


Directions = tuple[tuple[Any, ...], tuple[Any, ...], tuple[Any, ...]]
"""Along the contact, across it within the surface, and normal to it."""


def _bush(y: Any, v: Any, p: Mapping[str, Any]) -> Any:
    return p["hardening"] * y**3 + p["loss"] * v


class Coupled(sh.laws.PolynomialLaw):
    """Two displacements in one potential: each stiffens the other."""

    directions = ("tangential", "across")
    parameters: ClassVar = {"hardening": sh.laws.Parameter("N m-3", "stiffness of both", "$a$")}
    degree = 3

    def force_at(self, displacement: Any, frequency: Any, values: Any) -> Any:
        """The derivative of ``a / 4 (u^2 + v^2)^2``."""
        return values["hardening"] * ca.sumsqr(displacement) * displacement


class Driven(sh.laws.Coulomb):
    """Friction that the speed presses."""

    parameters = sh.laws.Coulomb.parameters | {
        "damper_mass": sh.laws.Parameter("kg", "mass of the damper", "$m$")
    }

    def slip_limit(self, frequency: Any, values: Any) -> Any:
        """The load grows with the square of the frequency."""
        load = values["normal_load"] + 0.1 * values["damper_mass"] * frequency**2
        return values["friction_coefficient"] * load


OWN_LAWS = [Coupled(), Driven()]


def rub(contact_stiffness: Any, friction_coefficient: Any, normal_load: Any) -> dict[str, Any]:
    """Values of friction under a constant load."""
    return {
        "contact_stiffness": contact_stiffness,
        "friction_coefficient": friction_coefficient,
        "normal_load": normal_load,
    }


def _friction(along: Any, **more: Any) -> sh.Contacts:
    return sh.Friction(tangential=along, **FRICTION | more)


LAWS: dict[str, Callable[..., Any]] = {
    "none": lambda *directions: None,
    "coulomb": lambda along, across, normal: _friction(along),
    "varying": lambda along, across, normal: _friction(along, normal=normal, **PRESSES),
    "stop": lambda along, across, normal: sh.Gap(normal=normal, gap=5e-5, **PRESSES),
    "planar": lambda along, across, normal: _friction(along, across=across),
    "pressed": lambda a, b, normal: _friction(a, across=b, normal=normal, **PRESSES),
    "cubic": lambda along, across, normal: sh.Contacts(
        sh.laws.CubicSpring(), along, cubic_stiffness=3e10
    ),
    "own": lambda along, across, normal: sh.laws.SmoothLaw(
        _bush, {"hardening": (2e10, "N/m^3"), "loss": (3.0, "N s/m")}, along
    ),
    "coupled": lambda along, across, normal: sh.Contacts(Coupled(), along, across, hardening=2e10),
    "driven": lambda along, across, normal: sh.Contacts(
        Driven(), along, damper_mass=2e-4, **FRICTION
    ),
}
OPENS = {"varying", "stop", "pressed"}
"""Laws whose force has a mean, which harmonic 0 takes."""


def _contacts(law: str, directions: Directions) -> dict[str, Any]:
    contact = LAWS[law](*([direction] for direction in directions))
    return {} if contact is None else {"contact": contact}


GROUND: Directions = ((0,), (1,), (2,))
MASS, DAMPING = 0.9 * np.eye(3), np.diag([2.0, 2.5, 3.0])


def blade(law: str) -> sh.Model:
    """The tip of a blade against the ground."""
    return sh.Model(MASS, DAMPING, TIP, contacts=_contacts(law, GROUND))


def rotor(law: str) -> sh.Model:
    """The same blade at one speed, stiffened and with Coriolis forces."""
    turning = sh.RotatingModel(blade(law), {0: TIP, 600: TIP + 4e3 * np.eye(3)}, 0.05 * SKEW)
    return turning.at(300)


def chain(law: str) -> sh.Model:
    """Four tips one behind the other; the first touches the second."""
    n, unit = 4, np.eye(4)
    coupling = 4e3 * (2 * unit - np.eye(n, k=1) - np.eye(n, k=-1))
    stiffness = np.kron(unit, TIP) + np.kron(coupling, np.eye(3))
    contacts = _contacts(law, ((0, 3), (1, 4), (2, 5)))
    return sh.Model(np.kron(unit, MASS), np.kron(unit, DAMPING), stiffness, contacts=contacts)


def sector(law: str, speed: float = 0.0, damped: float = 1.0) -> sh.Sector:
    """A blade of two masses on one of the disk; its tip touches that of the next one.

    ``damped`` multiplies all damping: a negative one drives the blades.
    """
    stiffness = np.zeros((6, 6))
    stiffness[1:4, 1:4] = TIP - np.diag([1e4, 6e3, 5e3])
    for i, j, k in ((0, 4, 3e4), (4, 1, 1e4), (0, 2, 6e3), (0, 3, 5e3), (0, 5, 2e4)):
        stiffness[np.ix_([i, j], [i, j])] += k * np.array([[1, -1], [-1, 1]])
    stiffness[0, 0] += 4e4
    mass, damping = np.diag([2.0, 0.9, 0.9, 0.9, 0.5, 0]), np.diag([3.0, 2.0, 2.5, 3.0, 1.0, 0])
    model: Any = sh.Model(mass, damped * damping, stiffness)
    if speed:
        skew = np.zeros((6, 6))
        skew[1:4, 1:4] = SKEW
        model = sh.RotatingModel(model, {0: stiffness, 600: stiffness + 2e3 * mass}, 0.05 * skew)
        model = model.at(speed)
    after = sh.next_sector
    directions: Directions = ((1, after(1)), (2, after(2)), (3, after(3)))
    disk = sh.Sector(model, left=[0], right=[5], n_sectors=N_SECTORS)
    return disk.with_contacts(**_contacts(law, directions))


def in_air(law: str) -> sh.Sector:
    """A sector whose blades feel the motion of their neighbours."""
    return sector(law).with_influences(
        sh.Influence({1: 1.0, 2: 0.3}, {-1: 60 + 90j, 0: -100 + 150j, 1: 40 - 70j}, 25.0)
    )


def mistuned(law: str) -> Any:
    """The whole ring, each blade a little different."""
    return sh.mistuned_ring(sector(law), stiffness_deviation=0.02 * np.sin(np.arange(N_SECTORS)))


def reduced(law: str, speed: float = 0.0) -> Any:
    """A sector with as many fixed-interface modes as there are: exact."""
    return sh.craig_bampton(sector(law, speed), 1, BAND, places=[1, 2, 3])


STRUCTURES: dict[str, Callable[[str], Any]] = {
    "blade": blade,
    "rotor": rotor,
    "chain": chain,
    "sector": sector,
    "turning": lambda law: sector(law, 300.0),
    "air": in_air,
    "ring": lambda law: sh.mistuned_ring(sector(law)),
    "mistuned": mistuned,
    "reduced": reduced,
    "reduced-turning": lambda law: reduced(law, 300.0),
    "reduced-ring": lambda law: sh.mistuned_ring(reduced(law, 300.0)),
    "condensed": chain,
    "condensed-sector": sector,
}
CYCLIC = {"sector", "turning", "air", "ring", "mistuned", "reduced", "reduced-turning"}
CYCLIC |= {"condensed-sector", "reduced-ring"}
"""Structures of a disk, whose force is an engine order."""
HARMONICS = {"1": (1,), "13": (1, 3), "0123": (0, 1, 2, 3)}


def _pattern(harmonics: tuple[int, ...], *static: Any) -> Any:
    pattern: dict[int, dict[int, complex]] = {1: {1: 1.0, 2: 0.4j, 3: 0.2}}
    if 2 in harmonics:
        pattern[2] = {2: 0.3}
    force: Any = sh.forces.EngineOrder(ORDER, 1.2, pattern=pattern)
    return force + sh.forces.StaticLoad(*static) if static else force


def _point(harmonics: tuple[int, ...], *static: Any) -> Any:
    cosine, sine = {1: {0: 1.0, 2: 0.3}}, {1: {1: 0.5}}
    if 2 in harmonics:
        cosine[2] = {1: 0.3}
    force: Any = sh.forces.HarmonicForce(cosine=cosine, sine=sine, amplitude=1.2)
    return force + sh.forces.StaticLoad(*static) if static else force


def _base(structure: Any) -> Any:
    influence = {0: 1.0, 1: 0.5} if structure.n_dof < 12 else {3 * i: 1.0 for i in range(4)}
    if structure.speed:  # along the axis, where no Coriolis forces act
        influence = {0: 0.2, 1: -0.5, 2: 1.0}
    return sh.forces.BaseMotion(acceleration=1.2, influence=influence)


FORCES = ("point", "order", "static", "base")


def force_of(name: str, structure: Any, cyclic: bool, harmonics: tuple[int, ...]) -> Any:
    """A force on a structure: at places, along an engine order, with a static load, by its base."""
    if name == "base":
        return _base(structure)
    static = ({1: 0.4, 3: 0.6},) if cyclic else ({0: 0.4, 2: 0.6},)
    waves = _pattern if cyclic else _point
    return waves(harmonics, *(static if name == "static" else ()))


class Cell(NamedTuple):
    """One combination, by the names of its parts."""

    law: str
    structure: str
    force: str
    harmonics: str

    def __str__(self) -> str:
        return " ".join(self)

    @property
    def valid(self) -> bool:
        """Whether the parts go together."""
        cyclic, mean = self.structure in CYCLIC, "0" in self.harmonics
        return (
            self.force in (("order", "static") if cyclic else ("point", "static", "base"))
            and (mean or (self.law not in OPENS and self.force != "static"))
            and (self.law != "none" or self.harmonics != "13")
            and (self.law != "none" or not self.structure.startswith("condensed"))
        )


def cell(name: str) -> Cell:
    """The cell of a name, such as ``"coulomb chain point 1"``."""
    result = Cell(*name.split())
    if not result.valid:
        raise ValueError(f"{name!r}: these parts do not go together")
    return result


def cells(
    laws: Iterable[str] = LAWS,
    structures: Iterable[str] = STRUCTURES,
    forces: Iterable[str] = FORCES,
    harmonics: Iterable[str] = HARMONICS,
) -> Iterator[str]:
    """Names of all valid combinations of some parts."""
    for law in laws:
        for structure in structures:
            for force in forces:
                for level in harmonics:
                    one = Cell(law, structure, force, level)
                    if one.valid:
                        yield str(one)


def problem(name: str) -> sh.HarmonicBalance:
    """The problem of a cell."""
    law, structure, force, level = cell(name)
    harmonics, model = HARMONICS[level], STRUCTURES[structure](law)
    given = force_of(force, model, structure in CYCLIC, harmonics)
    if structure.startswith("condensed"):
        model = sh.condense(model, given, BAND, harmonics, progress=False)
    return sh.HarmonicBalance(model, given, harmonics)


def cases(quick: Iterable[str], others: Iterable[str] = (), together: int = 2) -> list[Any]:
    """Parameters of a test: ``quick`` cells, and slow ones that hold all parts of the others.

    Each pair of parts, such as a law and a structure, is in a cell, of ``together=1`` each part.
    Which cell it is differs between tests with other quick ones.
    """
    first = [str(cell(name)) for name in quick]
    order = {name: zlib.crc32(f"{first} {name}".encode()) for name in others}
    slow, known = [], {parts for name in first for parts in combined(name, together)}
    for name in sorted(order, key=order.__getitem__):
        if not combined(name, together) <= known:
            known |= combined(name, together)
            slow.append(pytest.param(name, marks=pytest.mark.slow))
    return [*first, *slow]


def combined(name: str, together: int) -> set[tuple[tuple[int, str], ...]]:
    """As many parts of a cell ``together``, all of them."""
    return set(combinations(enumerate(name.split()), together))


def solved(given: sh.HarmonicBalance, frequency: float = 24.0) -> np.ndarray:
    """Coefficients (dof, harmonic, component) of the response at a frequency [Hz]."""
    found = sh.solve(given, frequency)
    assert found.converged.item()
    return found.coefficient.values
