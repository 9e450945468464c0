"""Responses with one harmonic without the library: closed forms, and linear solutions with NumPy.

Under one harmonic a tuned ring under an engine order is one blade whose contact moves
``2 sin(pi EO / N)`` times as much as the blade. At a given amplitude the stiffness and the damping
of its contact are closed forms (Eqs. 6-8 of the source), and where the response peaks the two
frequencies of that amplitude merge.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import brentq, minimize_scalar

import symhbm as sh

EXACT_DIGITS = 1e-9
"""Relative difference at which two exact solutions agree: both solved for, to about 1e-12."""


@dataclass(frozen=True)
class OneBlade:
    """One blade, or one of a tuned ring: kg, N s/m, N/m, N/m, N, N; the contact moves ``ratio``."""

    mass: float
    damping: float
    stiffness: float
    contact_stiffness: float
    slip_limit: float
    force: float
    ratio: float

    def _contact(self, amplitude: float) -> tuple[float, float]:
        """Stiffness [N/m], and damping times the frequency [N/m], of the contact on the blade."""
        moved = self.ratio * amplitude
        share = self.slip_limit / max(self.contact_stiffness * moved, self.slip_limit, 1e-300)
        # The share is 1 where the contact sticks.
        angle = np.arccos(1 - 2 * share)
        stiffness = self.contact_stiffness * (angle - np.sin(2 * angle) / 2) / np.pi
        damping = 4 * self.contact_stiffness * share * (1 - share) / np.pi
        return self.ratio**2 * stiffness, self.ratio**2 * damping

    def _lowest(self, amplitude: float) -> tuple[float, float]:
        """Smallest force that makes this amplitude, and its angular frequency [N, rad/s]."""
        added, damping = self._contact(amplitude)
        stiffness = self.stiffness + added
        m, c = self.mass, self.damping
        roots = np.roots([2 * m**2, 0, c**2 - 2 * m * stiffness, c * damping])
        omega = float(roots.real[np.abs(roots.imag) < 1e-9 * np.abs(roots)].max())
        return amplitude * float(np.hypot(stiffness - m * omega**2, c * omega + damping)), omega

    def peak(self) -> tuple[float, float]:
        """Amplitude [m] and frequency [Hz] of the peak."""
        stuck = self.stiffness + self.ratio**2 * self.contact_stiffness
        highest = 2 * self.force / (self.damping * np.sqrt(self.stiffness / self.mass))
        lowest = self.force / stuck
        amplitude: Any = brentq(
            lambda a: self._lowest(a)[0] - self.force, lowest, highest, xtol=1e-300
        )
        return float(amplitude), self._lowest(float(amplitude))[1] / (2 * np.pi)

    def half_power_width(self) -> float:
        """Width of the peak at ``1/sqrt(2)`` of it, over its frequency.

        At a given amplitude the contact is linear, and the two frequencies are roots of
        ``|z(omega)| = f0 / A``, with ``z`` as in `optimum`.
        """
        amplitude, frequency = self.peak()
        amplitude /= np.sqrt(2)
        added, damping = self._contact(amplitude)
        stiffness, m, c = self.stiffness + added, self.mass, self.damping
        rest = stiffness**2 + damping**2 - (self.force / amplitude) ** 2
        roots = np.roots([m**2, 0, c**2 - 2 * m * stiffness, 2 * c * damping, rest])
        real = roots.real[(np.abs(roots.imag) < 1e-9 * np.abs(roots)) & (roots.real > 0)]
        return float(np.ptp(real) / (2 * np.pi * frequency))

    def optimum(self) -> tuple[float, float, float]:
        """Slip limit [N] of the lowest peak, and amplitude [m] and frequency [Hz] of that peak.

        At a given amplitude and frequency the force is ``|z|``, with
        ``z = K - m omega^2 + i (c omega + D)``, and stiffness ``K`` and damping ``D`` of the
        contact go with its angle ``theta``. At the peak the force is stationary over the frequency,
        ``Re z = c Im z / (2 m omega)``, and at the best slip limit over the angle,
        ``Re z sin(theta) + Im z cos(theta) = 0``. Both together: ``tan(theta) = -2 m omega / c``,
        and one equation for the frequency remains.

        Without damping the angle is ``pi / 2``: the contact slips for half of each half-period, the
        slip limit is ``pi f0 / (2 s)`` and the amplitude ``pi f0 / (s^2 k_d)`` at
        ``omega^2 = (k + s^2 k_d / 2) / m``, where the contact moves ``s`` times as much. All three
        are approached in first order of the damping, see `slopes`.
        """
        m, c, added = self.mass, self.damping, self.ratio**2 * self.contact_stiffness / np.pi

        def impedance(omega: float) -> tuple[float, float, float]:
            angle = np.pi - np.arctan2(2 * m * omega, c)
            stiffness = self.stiffness + added * (angle - np.sin(2 * angle) / 2)
            opposed = c * omega + added * np.sin(angle) ** 2
            return angle, stiffness - m * omega**2, opposed

        def stationary(omega: float) -> float:
            _, real, imaginary = impedance(omega)
            return 2 * m * omega * real - c * imaginary

        free, stuck = self.stiffness, self.stiffness + np.pi * added
        ends = np.sqrt(free / m), np.sqrt(stuck / m)
        omega: Any = brentq(stationary, *ends, xtol=1e-300, rtol=4 * np.finfo(float).eps)
        angle, real, imaginary = impedance(omega)
        amplitude = self.force / np.hypot(real, imaginary)
        limit = self.contact_stiffness * self.ratio * amplitude * (1 - np.cos(angle)) / 2
        return float(limit), float(amplitude), float(omega / (2 * np.pi))

    def slopes(self) -> tuple[float, float, float]:
        """Relative changes of `optimum` by the damping [m/(N s)] where there is none.

        To first order the angle is ``pi / 2 + e`` with ``e = c / (2 m omega)``, which adds
        ``2 e S`` to ``K`` and nothing to ``D``, where ``S = s^2 k_d / pi`` is their slope.
        """
        at_none = replace(self, damping=0.0)
        _, _, frequency = at_none.optimum()
        omega = 2 * np.pi * frequency
        slope = self.ratio**2 * self.contact_stiffness / np.pi
        lag = 1 / (2 * self.mass * omega)
        amplitude = -omega / slope
        return lag + amplitude, amplitude, lag * slope / (2 * self.mass * omega**2)

    def largest_contact_force(self) -> float:
        """Friction limit [N] from which the contact sticks at every frequency."""
        stuck = self.stiffness + self.ratio**2 * self.contact_stiffness
        omega = np.sqrt(stuck / self.mass - (self.damping / (2 * self.mass)) ** 2)
        return float(self.contact_stiffness * self.ratio * self.force / (self.damping * omega))


def one_blade(dataset: xr.Dataset, **parameters: Any) -> OneBlade:
    """Return the blade behind one curve; ``parameters`` replace those of the dataset."""
    problem = sh.datasets.rebuild(dataset).with_parameters(**parameters)
    values = {name: float(np.mean(value)) for name, value in problem.parameters.items()}
    ratio = 1.0
    if "engine_order" in values:
        ratio = 2 * abs(np.sin(np.pi * values["engine_order"] / problem.model.n_dof))
    return OneBlade(
        mass=values["mass"],
        damping=values["damping"],
        stiffness=values["stiffness"],
        contact_stiffness=values["contact_stiffness"],
        slip_limit=values["friction_coefficient"] * values["normal_load"],
        force=values["force_amplitude"],
        ratio=ratio,
    )


@dataclass(frozen=True)
class StuckRing:
    """Ring of ``n`` blades joined by springs, with a force on blade 0: a linear structure."""

    n: int
    mass: float
    damping: float
    stiffness: float
    contact_stiffness: float
    force: float

    def natural_frequencies(self) -> np.ndarray:
        """Natural frequencies [Hz] by nodal diameters, ``(k + 4 k_d sin^2(pi n / N)) / m``."""
        wave = np.sin(np.pi * np.arange(self.n // 2 + 1) / self.n) ** 2
        square = (self.stiffness + 4 * self.contact_stiffness * wave) / self.mass
        return np.sqrt(square) / (2 * np.pi)

    def response(self, frequency: float) -> np.ndarray:
        """Complex displacements (n,) [m] at a frequency [Hz]."""
        omega, one = 2 * np.pi * frequency, np.eye(self.n)
        coupling = 2 * one - np.roll(one, 1, axis=0) - np.roll(one, -1, axis=0)
        own = self.stiffness + 1j * omega * self.damping - omega**2 * self.mass
        return np.linalg.solve(own * one + self.contact_stiffness * coupling, self.force * one[0])

    def stretch(self, frequency: float) -> float:
        """Largest relative displacement of neighbours [m] at a frequency [Hz]."""
        moved = self.response(frequency)
        return float(np.abs(moved - np.roll(moved, -1)).max())

    def full_stick_load(self, friction_coefficient: float) -> float:
        """Normal load [N] that holds all contacts at every frequency."""
        stretch = max(self._largest(self.stretch, n)[0] for n in range(self.n // 2 + 1))
        return self.contact_stiffness * stretch / friction_coefficient

    def peak(self, nodal_diameters: int) -> tuple[float, float]:
        """Largest amplitude of all blades [m] about a natural frequency, and where [Hz]."""
        return self._largest(lambda at: float(np.abs(self.response(at)).max()), nodal_diameters)

    def _largest(
        self, value: Callable[[float], float], nodal_diameters: int
    ) -> tuple[float, float]:
        middle = self.natural_frequencies()[nodal_diameters]
        # Twice the half-power width to either side: no other resonance is that near. The offset
        # has more digits than the frequency.
        width = self.damping / (np.pi * self.mass)
        found: Any = minimize_scalar(
            lambda offset: -value(middle + offset),
            bounds=(-width, width),
            method="bounded",
            options=dict(xatol=1e-9 * width),
        )
        return float(-found.fun), float(middle + found.x)
