"""Motions without a force, computed without the library: closed forms, and marches in time.

Under one harmonic a contact of friction is a complex stiffness that depends on its amplitude (Eqs.
6-8 of the source), and a nonlinear mode is an eigenvalue `omega^2 (1 + 2 i D)` of the structure
with that stiffness: of one blade, of a wave of a ring, and of one of a sector with all equations.

A blade that rubs is linear between its reversals and onsets of slip, so that half a period is a
map from the amplitude at a reversal to that at the next one. Its fixed points are limit cycles, and
its slope there is how a disturbance of them grows.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.optimize import brentq, minimize_scalar
from scipy.sparse.linalg import splu

import symhbm as sh
from symhbm.numerics import FloatArray

NODES = 40
"""Nodes of Gauss quadrature of each part of a motion that is smooth."""
ITERATIONS = 200
OUTER, SAME_FREQUENCY = 6, 1e-9
"""Times at most that viscous damping is taken at the frequency found with it; change to end at."""
REPEATS = 1e-13
"""Relative change of an eigenvalue from which it is taken."""
SLOPE = 1e-6
"""Relative change of the amplitude by which the slope of a map is told."""


def root(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a function of one number changes its sign, to round-off."""
    # A damping that is sought may be 0: an absolute tolerance far below all values here.
    found: Any = brentq(function, low, high, xtol=1e-18)
    return float(found)


def complex_stiffness(amplitude: float, stiffness: float, limit: float) -> complex:
    """Of a contact [N/m] whose relative displacement has an amplitude [m], under one harmonic."""
    share = limit / max(stiffness * amplitude, limit)
    angle = np.arccos(1 - 2 * share)
    real = (angle - np.sin(2 * angle) / 2) / np.pi
    return stiffness * complex(real, 4 * share * (1 - share) / np.pi)


@dataclass(frozen=True)
class Wave:
    """One blade, or one of a ring in a wave, whose contact moves ``ratio`` times as much.

    ``air`` is the complex stiffness [N/m] of the air in that wave, ``drag`` its damping [N s/m].
    """

    mass: float
    damping: float
    stiffness: float
    contact_stiffness: float
    limit: float
    ratio: float = 1.0
    air: complex = 0.0
    drag: complex = 0.0

    def mode(self, amplitude: float) -> tuple[float, float]:
        """Frequency [Hz] and damping ratio at an amplitude [m]."""
        rubs = complex_stiffness(self.ratio * amplitude, self.contact_stiffness, self.limit)
        added = self.stiffness + self.air + self.ratio**2 * rubs
        damping = self.damping + self.drag
        # The real part of `added + i omega damping - m omega^2` vanishes.
        root = np.sqrt(damping.imag**2 + 4 * self.mass * added.real)
        omega = (root - damping.imag) / (2 * self.mass)
        ratio = (added.imag + omega * damping.real) / (2 * self.mass * omega**2)
        return omega / (2 * np.pi), ratio

    def damping_ratio(self, amplitude: float) -> float:
        """Damping ratio at an amplitude [m]."""
        return self.mode(amplitude)[1]

    def most_damping(self, amplitude: float, limits: tuple[float, float]) -> tuple[float, float]:
        """The friction limit [N] with most damping at an amplitude [m], and that ratio."""
        found: Any = minimize_scalar(
            lambda log: -replace(self, limit=float(np.exp(log))).damping_ratio(amplitude),
            bounds=tuple(np.log(limits)),
            method="bounded",
            options={"xatol": 1e-9},
        )
        return float(np.exp(found.x)), -float(found.fun)

    def most_damped(self, largest: float) -> tuple[float, float]:
        """The amplitude [m], up to the ``largest``, with most damping, and that ratio."""
        onset = self.limit / (self.ratio * self.contact_stiffness)
        found: Any = minimize_scalar(
            lambda log: -self.damping_ratio(float(np.exp(log))),
            bounds=(np.log(onset), np.log(largest)),
            method="bounded",
            options={"xatol": 1e-9},
        )
        return float(np.exp(found.x)), -float(found.fun)

    def cycles(self, largest: float) -> list[float]:
        """Amplitudes [m] of limit cycles up to the ``largest``, smaller than most damped first."""
        onset = self.limit / (self.ratio * self.contact_stiffness)
        top, most = self.most_damped(largest)
        edges = (onset, top), (top, largest)
        ratios = [[self.damping_ratio(a) for a in ends] for ends in edges]
        if most <= 0:
            return []
        return [
            root(self.damping_ratio, *ends)
            for ends, (first, last) in zip(edges, ratios, strict=True)
            if first * last < 0
        ]


@dataclass(frozen=True)
class InTime:
    """One blade that rubs, exactly: kg, N s/m, N/m, N/m and N."""

    mass: float
    damping: float
    stiffness: float
    contact_stiffness: float
    limit: float

    def half(self, amplitude: float) -> tuple[float, float, complex]:
        """From a reversal at an amplitude [m] to the next one.

        That amplitude [m], the time [s], and the first harmonic [m] if both amplitudes are equal.
        """
        held = self.stiffness + self.contact_stiffness
        rest = (self.contact_stiffness * amplitude - self.limit) / held
        slips = amplitude - 2 * self.limit / self.contact_stiffness
        first = _Free(self.mass, self.damping, held, rest, amplitude, 0.0)
        turn = np.pi / first.omega
        onset = first.at(turn)[0] < slips
        lasts = root(lambda t: first.at(t)[0] - slips, 0, turn) if onset else turn
        parts = [(first, 0.0, lasts)]
        place, speed = first.at(lasts)
        if onset:
            second = _Free(
                self.mass, self.damping, self.stiffness, self.limit / self.stiffness, place, speed
            )
            more = root(lambda t: second.at(t)[1], 0, np.pi / second.omega)
            parts.append((second, lasts, more))
            place = second.at(more)[0]
            lasts += more
        nodes, weights = np.polynomial.legendre.leggauss(NODES)
        harmonic = 0j
        for free, begin, length in parts:
            t = length * (nodes + 1) / 2
            wave = np.exp(-1j * np.pi * (begin + t) / lasts)
            harmonic += 2 / lasts * length / 2 * np.sum(weights * free.at(t)[0] * wave)
        return -float(place), lasts, complex(harmonic)

    def slope(self, amplitude: float) -> float:
        """How much a small change of an amplitude [m] at a reversal grows to the next one."""
        near = [self.half(amplitude * (1 + step))[0] for step in (-SLOPE, SLOPE)]
        return (near[1] - near[0]) / (2 * SLOPE * amplitude)

    def cycle(self, low: float, high: float) -> tuple[float, float, float]:
        """The cycle whose largest displacement is between two [m].

        Amplitude [m] of its first harmonic, frequency [Hz] and slope of the map.
        """
        grows = lambda a: self.half(a)[0] / a - 1  # noqa: E731
        found = root(grows, low, high)
        _, lasts, harmonic = self.half(found)
        return abs(harmonic), 1 / (2 * lasts), self.slope(found)

    def held(self, largest: float) -> tuple[float, float, float]:
        """Damping [N s/m] at which a motion with a largest displacement [m] repeats itself.

        Beside it the amplitude [m] of its first harmonic and its frequency [Hz].
        """
        grows = lambda c: replace(self, damping=c).half(largest)[0] - largest  # noqa: E731
        # Not beyond what a blade without the spring of the contact still vibrates with.
        most = 0.9 * 2 * np.sqrt(self.mass * self.stiffness)
        found = root(grows, -most, 0.0)
        _, lasts, harmonic = replace(self, damping=found).half(largest)
        return found, abs(harmonic), 1 / (2 * lasts)

    def mode(self, amplitude: float) -> tuple[float, float]:
        """Frequency [Hz] and damping ratio of the mode whose first harmonic has an amplitude [m].

        The force along the momentum that makes it periodic is one more damping.
        """
        ends = 0.8 * amplitude, 1.2 * amplitude
        miss = lambda a: self.held(a)[1] - amplitude  # noqa: E731
        largest = root(miss, *ends)
        damping, _, frequency = self.held(largest)
        return frequency, (self.damping - damping) / (2 * self.mass * 2 * np.pi * frequency)

    def fold(self, low: float, high: float) -> tuple[float, float]:
        """Damping [N s/m] below which there is no cycle, and amplitude [m] of the last one."""
        found: Any = minimize_scalar(
            lambda log: self.held(float(np.exp(log)))[0],
            bounds=(np.log(low), np.log(high)),
            method="bounded",
            options={"xatol": 1e-9},
        )
        damping, amplitude, _ = self.held(float(np.exp(found.x)))
        return damping, amplitude


class _Free:
    """Vibration about a place of rest, from a place and a speed."""

    def __init__(
        self, mass: float, damping: float, stiffness: float, rest: float, x: float, v: float
    ):
        self.decay = damping / (2 * mass)
        self.omega = np.sqrt(stiffness / mass - self.decay**2)
        self.rest, self.x, self.v = rest, x - rest, v

    def at(self, time: Any) -> tuple[Any, Any]:
        """Displacement and velocity."""
        c, s = np.cos(self.omega * time), np.sin(self.omega * time)
        size = np.exp(-self.decay * time)
        other = (self.v + self.decay * self.x) / self.omega
        x = size * (self.x * c + other * s)
        v = size * self.omega * (other * c - self.x * s) - self.decay * x
        return self.rest + x, v


def march(
    matrices: tuple[FloatArray, FloatArray, FloatArray],
    contact_stiffness: float,
    limit: float,
    start: FloatArray,
    step: float,
    count: int,
) -> FloatArray:
    """Displacements (count, n) [m] of a ring by central differences, contacts to next blades.

    ``matrices`` are those of mass, damping and stiffness; it starts at rest with contacts that bear
    nothing.
    """
    mass, damping, stiffness = matrices
    forwards = np.linalg.inv(mass / step**2 + damping / (2 * step))
    of_now = forwards @ (2 * mass / step**2 - stiffness)
    of_before = forwards @ (damping / (2 * step) - mass / step**2)
    found = np.empty((count, len(start)))
    before, now = start.copy(), start.copy()
    moved, force = now - np.roll(now, -1), np.zeros(len(start))
    for i in range(count):
        force_on_blades = force - np.roll(force, 1)
        before, now = now, of_now @ now + of_before @ before - forwards @ force_on_blades
        moved, last = now - np.roll(now, -1), moved
        force = np.minimum(np.maximum(force + contact_stiffness * (moved - last), -limit), limit)
        found[i] = now
    return found


@dataclass(frozen=True)
class WholeSector:
    """A wave of a disk of sectors with all equations and one contact to the next sector.

    ``contact`` are weights of places of this sector and ``next_contact`` those of the next one.
    """

    disk: sh.Sector
    nodal_diameter: int
    contact: Mapping[str, float]
    next_contact: Mapping[str, float]
    contact_stiffness: float
    tip: str

    @property
    def lag(self) -> complex:
        """How the next sector moves while this one moves as 1."""
        return complex(np.exp(-2j * np.pi * self.nodal_diameter / self.disk.n_sectors))

    @cached_property
    def matrices(self) -> tuple[Any, Any, Any]:
        """Mass, damping and stiffness of the wave."""
        wave = self.disk.matrices(self.nodal_diameter)
        names = "mass_matrix", "damping_matrix", "stiffness_matrix"
        mass, damping, stiffness = (sp.csc_array(getattr(wave, name)) for name in names)
        return mass, damping, stiffness

    def _row(self, places: Mapping[str, float]) -> Any:
        row = np.zeros(self.matrices[0].shape[0], dtype=complex)
        kept = np.asarray(self.disk.kept)
        for place, weight in places.items():
            row[np.flatnonzero(kept == self.disk.number_of(place))[0]] = weight
        return row

    def mode(
        self, amplitude: float, limit: float, near: float, air: tuple[complex, complex] = (0, 0)
    ) -> tuple[float, float]:
        """Frequency [Hz] and damping ratio at an amplitude of the tip [m], from a frequency near.

        ``air`` are the stiffness [N/m] and the damping [N s/m] along the tip.
        """
        found = near, 0.0
        for _ in range(OUTER):
            before, found = found, self._mode(amplitude, limit, found[0], air)
            if abs(found[0] / before[0] - 1) < SAME_FREQUENCY:
                break
        return found

    def _mode(
        self, amplitude: float, limit: float, near: float, air: tuple[complex, complex]
    ) -> tuple[float, float]:
        """The same with dampers as they are at the frequency near."""
        mass, damping, stiffness = self.matrices
        relative = self._row(self.contact) + self.lag * self._row(self.next_contact)
        motion = tip = self._row({self.tip: 1.0})
        omega = 2 * np.pi * near
        solver = splu(sp.csc_array(stiffness + 1j * omega * damping - omega**2 * mass))
        # The contact and the air are of low rank.
        read = np.array([relative, tip])
        spread = solver.solve(np.ascontiguousarray(read.conj().T))
        square = 0j
        for _ in range(ITERATIONS):
            motion = motion / (tip @ motion) * amplitude
            rubs = complex_stiffness(abs(relative @ motion), self.contact_stiffness, limit)
            weighed = np.array([[rubs], [air[0] + 1j * omega * air[1]]]) * read
            solved = solver.solve(mass @ motion)
            solved = solved - spread @ np.linalg.solve(
                np.eye(2) + weighed @ spread, weighed @ solved
            )
            now = omega**2 + amplitude / (tip @ solved)
            change, square, motion = abs(now - square) / abs(now), now, solved
            if change < REPEATS:
                break
        return float(np.sqrt(square.real)) / (2 * np.pi), float(square.imag / (2 * square.real))
