"""Random problems of six kinds, the same with every version of NumPy and of this library.

Only `Generator.random` of a PCG64 is drawn from, whose doubles do not change between versions.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

import symhbm as sh

TURN = 2 * np.pi
OF_EACH = 50
"""Problems of each kind."""
N_VALUES = 5
"""Frequencies of the grid of each problem, ends of the band left out."""


class Case(NamedTuple):
    """A ``problem``, the band to follow it over and values ``at`` of a grid, all [Hz]."""

    problem: sh.HarmonicBalance
    band: tuple[float, float]
    at: np.ndarray


class Draws:
    """Random numbers of one problem."""

    def __init__(self, *seed: int):
        self._rng = np.random.Generator(np.random.PCG64(seed))

    def between(self, low: float, high: float, shape: Any = None) -> Any:
        """Uniform in a range."""
        return low + (high - low) * self._rng.random(shape)

    def scale(self, low: float, high: float) -> float:
        """Of any order of magnitude in a range."""
        return float(np.exp(self.between(np.log(low), np.log(high))))

    def one_of(self, *things: Any) -> Any:
        """One of some things, all of them as likely."""
        return things[int(self._rng.random() * len(things))]

    def spread(self, value: float, share: float, n: int) -> np.ndarray:
        """Values about one, relatively this far at most."""
        return value * self.between(1 - share, 1 + share, n)

    def places(self, n: int, count: int) -> list[int]:
        """Different numbers below ``n``."""
        return np.argsort(self._rng.random(n))[:count].tolist()


def case(kind: str, number: int) -> Case:
    """The problem of a kind with this number."""
    draws = Draws([*KINDS].index(kind), number)
    problem, band = KINDS[kind](draws, number)
    return Case(problem, band, np.linspace(*band, N_VALUES + 2)[1:-1])


def _mistuned_ring(draws: Draws, number: int) -> tuple[sh.HarmonicBalance, tuple[float, float]]:
    n = 3 + number % 7
    contact_stiffness = draws.scale(3e3, 3e5)
    disk = sh.bladed_disk(
        n,
        mass=draws.spread(1.0, 0.02, n),
        stiffness=draws.spread(1e4, 0.05, n),
        damping=draws.scale(0.3, 3.0),
        contact_stiffness=draws.spread(contact_stiffness, 0.2, n),
        friction_coefficient=draws.spread(0.5, 0.4, n),
        normal_load=draws.spread(draws.scale(1.0, 60.0), 0.3, n),
    )
    order = draws.one_of(*range(n))
    highest = np.sqrt(1e4 + 4 * contact_stiffness) / TURN
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(order), (1,)), (12.0, 1.2 * highest)


def _alike(draws: Draws, number: int) -> tuple[sh.HarmonicBalance, tuple[float, float]]:
    harmonics = draws.one_of((1,), (1,), (1, 3))
    given = dict(
        stiffness=1e4,
        damping=draws.scale(0.3, 3.0),
        contact_stiffness=draws.scale(3e3, 1e5),
        friction_coefficient=draws.between(0.2, 0.8),
        normal_load=draws.scale(0.5, 50.0),
    )
    highest = np.sqrt(1e4 + 4 * given["contact_stiffness"]) / TURN
    if number % 3 == 0:
        blade = sh.single_blade(mass=draws.between(0.5, 2.0), **given)
        force = sh.forces.PointForce(amplitude=draws.scale(0.3, 3.0))
        return sh.HarmonicBalance(blade, force, harmonics), (5.0, 1.5 * highest)
    n = 3 + number % 10
    order = draws.one_of(*range(1, n))
    if number % 3 == 1:
        disk = sh.bladed_disk(n, mass=1.0, **given)
        return sh.HarmonicBalance(disk, sh.forces.EngineOrder(order), harmonics), (
            5.0,
            1.2 * highest,
        )
    blade = sh.Model([[1.0, 0], [0, 0]], [[2.0, 0], [0, 0]], [[3e4, -2e4], [-2e4, 2e4]])
    shroud = sh.Friction(
        tangential=(0, sh.next_sector(0)),
        contact_stiffness=given["contact_stiffness"],
        friction_coefficient=given["friction_coefficient"],
        normal_load=given["normal_load"],
    )
    disk = sh.Sector(blade, [0], [1], n).with_contacts(shroud=shroud)
    force = sh.forces.EngineOrder(order, draws.scale(0.5, 5.0), pattern={0: 1.0})
    return sh.HarmonicBalance(disk, force, harmonics), (10.0, 1.2 * highest + 30)


def _matrices(draws: Draws, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A chain of masses, each on a spring of its own."""
    mass = np.diag(draws.between(0.7, 1.5, n))
    springs = draws.between(2e3, 2e4, n + 1)
    stiffness = np.diag(draws.between(5e3, 3e4, n))
    for i, k in enumerate(springs[: n - 1]):
        stiffness[i : i + 2, i : i + 2] += k * np.array([[1, -1], [-1, 1]])
    damping = draws.between(0.5, 2.0) * mass + draws.between(2e-5, 1e-4) * stiffness
    return mass, damping, stiffness


def _band(mass: np.ndarray, stiffness: np.ndarray) -> tuple[float, float]:
    """From below the lowest natural frequency to above the next one [Hz]."""
    natural = np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real)
    lowest = np.sort(natural)[:2] / TURN
    # Round numbers, which no round-off of the eigenvalues moves.
    return float(np.round(0.6 * lowest[0], 2)), float(np.round(1.3 * lowest[-1], 2))


def _rubbing(draws: Draws, n: int, count: int) -> dict[str, sh.Contacts]:
    """Friction to the ground and between masses."""
    contacts = {}
    for j in range(count):
        places = draws.places(n, 2)
        at = tuple(places) if n > 1 and draws.between(0, 1) < 0.4 else (places[0],)
        contacts[f"rub{j}"] = sh.Friction(
            tangential=at,
            contact_stiffness=draws.scale(2e3, 2e4),
            friction_coefficient=draws.between(0.2, 0.7),
            normal_load=draws.scale(0.5, 10.0),
        )
    return contacts


def _force(draws: Draws, n: int, strongest: float = 5.0) -> sh.forces.HarmonicForce:
    waves = draws.between(-1, 1, (2, n))
    amplitude = draws.scale(0.5, strongest)
    return sh.forces.HarmonicForce(cosine={1: waves[0]}, sine={1: waves[1]}, amplitude=amplitude)


def _several(draws: Draws, number: int) -> tuple[sh.HarmonicBalance, tuple[float, float]]:
    harmonics = ((1, 3), (0, 1, 2, 3), (1, 3, 5))[number % 3]
    if number % 2:
        n = draws.one_of(3, 4)
        disk = sh.bladed_disk(
            n,
            mass=draws.spread(1.0, 0.02, n),
            stiffness=draws.spread(1e4, 0.05, n),
            damping=draws.scale(0.5, 3.0),
            contact_stiffness=draws.spread(draws.scale(3e3, 3e4), 0.2, n),
            friction_coefficient=draws.spread(0.5, 0.4, n),
            normal_load=draws.spread(draws.scale(1.0, 20.0), 0.3, n),
        )
        force: Any = sh.forces.EngineOrder(draws.one_of(*range(1, n)))
        if 0 in harmonics:
            force = force + sh.forces.StaticLoad(draws.between(-2, 2, n))
        return sh.HarmonicBalance(disk, force, harmonics), (8.0, 40.0)
    n = draws.one_of(1, 2, 3)
    matrices = _matrices(draws, n)
    model = sh.Model(*matrices, contacts=_rubbing(draws, n, draws.one_of(1, 2)))
    force = _force(draws, n)
    if 0 in harmonics:
        force = force + sh.forces.StaticLoad(draws.between(-2, 2, n))
    return sh.HarmonicBalance(model, force, harmonics), _band(matrices[0], matrices[2])


def _turning(draws: Draws, number: int) -> tuple[sh.HarmonicBalance, tuple[float, float]]:
    """Gyroscopic forces: at one speed, and along an engine order."""
    n, harmonics = 2 + number % 3, draws.one_of((1,), (1, 3))
    mass, damping, stiffness = _matrices(draws, n)
    skew = draws.between(-1, 1, (n, n))
    skew = skew - skew.T
    contacts, band = _rubbing(draws, n, draws.one_of(1, 2)), _band(mass, stiffness)
    if number % 2:
        model = sh.Model(mass, damping + 8 * skew, stiffness, contacts=contacts)
        return sh.HarmonicBalance(model, _force(draws, n), harmonics), band
    order = draws.one_of(1, 2, 3)
    stiffening = np.diag(draws.between(0.2, 2.0, n))
    at = {speed: stiffness + (TURN / 60 * speed) ** 2 * stiffening for speed in (0, 300)}
    model = sh.Model(mass, damping, stiffness, contacts=contacts)
    rotor = sh.RotatingModel(model, at, coriolis=0.4 * skew)
    force = sh.forces.EngineOrder(order, draws.scale(0.5, 5.0))
    return sh.HarmonicBalance(rotor, force, harmonics), band


def _condensed(draws: Draws, number: int) -> tuple[sh.HarmonicBalance, tuple[float, float]]:
    """Chains and sectors of which contacts and forces are kept."""
    harmonics = draws.one_of((1,), (1, 3))
    if number % 5 == 4:
        return _condensed_sector(draws, harmonics)
    n = 12 + number % 25
    unit = sp.eye_array(n)
    stiffness = draws.between(0.5e4, 2e4) * (
        2 * unit - sp.eye_array(n, k=1) - sp.eye_array(n, k=-1)
    )
    stiffness = stiffness + sp.diags_array(draws.between(0, 3e3, n))
    contacts = _rubbing(draws, n, draws.one_of(1, 2, 3))
    damping = draws.between(0.3, 1.0) * unit + 1e-5 * stiffness
    model = sh.Model(unit, damping, stiffness, contacts=contacts)
    force = sh.forces.PointForce(draws.places(n, 1)[0], draws.scale(1.0, 10.0))
    dense = stiffness.toarray()
    band = _band(np.eye(n), dense)
    small = sh.condense(model, force, band, harmonics, progress=False)
    return sh.HarmonicBalance(small, force, harmonics), band


def _condensed_sector(
    draws: Draws, harmonics: tuple[int, ...]
) -> tuple[sh.HarmonicBalance, tuple[float, float]]:
    """A mass of the disk and a blade of three upon it, with a shroud at the tip."""
    n = draws.one_of(6, 9, 12)
    stiffness = np.diag([1e4, 0, 0, 0, 0])
    for (i, j), k in zip([(0, 1), (1, 2), (2, 3), (0, 4)], draws.between(2e4, 3e4, 4), strict=True):
        stiffness[np.ix_([i, j], [i, j])] += k * np.array([[1, -1], [-1, 1]])
    damping = np.diag([3, 0.5, 0.5, 0.5, 0])
    model = sh.Model(np.diag([1, 0.3, 0.3, 0.3, 0]), damping, stiffness)
    shroud = sh.Friction(
        tangential=(3, sh.next_sector(3)),
        contact_stiffness=draws.scale(1e3, 5e3),
        friction_coefficient=0.5,
        normal_load=draws.scale(0.5, 5.0),
    )
    sector = sh.Sector(model, left=[0], right=[4], n_sectors=n).with_contacts(shroud=shroud)
    force = sh.forces.EngineOrder(draws.one_of(*range(1, n)), pattern={3: draws.scale(0.5, 5.0)})
    band = (8.0, 32.0)
    small = sh.condense(sector, force, band, harmonics, progress=False)
    return sh.HarmonicBalance(small, force, harmonics), band


def _opening(draws: Draws, number: int) -> tuple[sh.HarmonicBalance, tuple[float, float]]:
    """Friction under a load that varies, stops, and friction in a plane."""
    n = 2 + number % 2
    mass, damping, stiffness = _matrices(draws, n)
    contact = _shroud, _stop, _planar
    contacts = {"contact": contact[0 if number % 5 < 3 else number % 5 - 2](draws)}
    if number % 4 == 3:
        contacts |= _rubbing(draws, n, 1)
    model = sh.Model(mass, 2 * damping, stiffness, contacts=contacts)
    harmonics = draws.one_of((0, 1), (0, 1, 2), (0, 1, 2, 3))
    band = _band(mass, stiffness)
    return sh.HarmonicBalance(model, _force(draws, n, 20.0), harmonics), band


def _shroud(draws: Draws) -> sh.Contacts:
    return sh.Friction(
        tangential=(0,),
        normal=(1,),
        contact_stiffness=draws.scale(2e3, 2e4),
        normal_stiffness=draws.scale(2e3, 2e4),
        friction_coefficient=draws.between(0.2, 0.7),
        normal_load=draws.scale(0.3, 8.0),
    )


def _stop(draws: Draws) -> sh.Contacts:
    given: dict[str, Any] = dict(normal_load=draws.scale(0.3, 8.0))
    if draws.between(0, 1) < 0.5:
        given = dict(gap=draws.scale(1e-5, 1e-3))
    return sh.Gap(normal=(0,), normal_stiffness=draws.scale(1e3, 1e4), **given)


def _planar(draws: Draws) -> sh.Contacts:
    return sh.Friction(
        tangential=(0,),
        across=(1,),
        contact_stiffness=draws.scale(2e3, 2e4),
        friction_coefficient=draws.between(0.2, 0.7),
        normal_load=draws.scale(0.5, 8.0),
    )


KINDS: dict[str, Callable[[Draws, int], tuple[sh.HarmonicBalance, tuple[float, float]]]] = {
    "mistuned rings": _mistuned_ring,
    "blades and tuned sectors": _alike,
    "several harmonics": _several,
    "gyroscopic forces": _turning,
    "condensed structures": _condensed,
    "contacts that open": _opening,
}
