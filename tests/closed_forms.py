"""Independent references: closed forms of one harmonic, and the slider by brute force."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq


@dataclass(frozen=True)
class OneBlade:
    """One blade to ground, or one blade of a tuned ring whose contact moves ``ratio`` times it.

    For a given amplitude the response is a polynomial of degree four in the angular frequency:
    (kappa - m w^2 A)^2 + (c w A + d)^2 = f0^2, with the in-phase force kappa and the friction
    force d of the contact in closed form (Eqs. 6-8 for one harmonic).
    """

    mass: float
    damping: float
    stiffness: float
    contact_stiffness: float
    slip_limit: float
    force: float = 1.0
    ratio: float = 1.0

    def contact(self, amplitude: float) -> tuple[float, float]:
        """In-phase and minus the quadrature force of the contact on the blade [N]."""
        y, kd, g = self.ratio * amplitude, self.contact_stiffness, self.slip_limit
        if kd * y <= g:
            return self.ratio * kd * y, 0.0
        angle = np.arccos(1 - 2 * g / (kd * y))
        in_phase = kd * y / np.pi * (angle - np.sin(2 * angle) / 2)
        quadrature = 4 * g / np.pi * (1 - g / (kd * y))
        return self.ratio * in_phase, self.ratio * quadrature

    def mode(self, amplitude: float) -> tuple[float, float]:
        """Angular frequency and damping ratio of the nonlinear mode at an amplitude."""
        in_phase, quadrature = self.contact(amplitude)
        frequency = np.sqrt((self.stiffness + in_phase / amplitude) / self.mass)
        damping = self.damping + quadrature / (amplitude * frequency)
        return frequency, damping / (2 * self.mass * frequency)

    def polynomial(self, amplitude: float) -> np.ndarray:
        """Coefficients in the angular frequency, highest power first; a root is a response."""
        in_phase, d = self.contact(amplitude)
        kappa = self.stiffness * amplitude + in_phase
        m, c = self.mass * amplitude, self.damping * amplitude
        return np.array(
            [m**2, 0.0, c**2 - 2 * m * kappa, 2 * c * d, kappa**2 + d**2 - self.force**2]
        )

    def lowest(self, amplitude: float) -> tuple[float, float]:
        """Smallest value of the polynomial over positive frequencies, and where it is."""
        polynomial = self.polynomial(amplitude)
        roots = np.roots(np.polyder(polynomial))
        real = roots[np.abs(roots.imag) < 1e-9 * np.abs(roots)].real
        places = np.append(real[real > 0], 1e-3)
        values = np.polyval(polynomial, places)
        best = int(np.argmin(values))
        return float(values[best]) / self.force**2, float(places[best])

    def peaks(self) -> list[tuple[float, float]]:
        """Every peak (angular frequency, amplitude): where two frequencies merge into one."""
        # Static deflection, slipping from the first: no response away from resonance is larger.
        top = 10 * self.force / (self.damping * np.sqrt(self.stiffness / self.mass))
        grid = np.geomspace(
            1e-4 * self.force / (self.stiffness + 4 * self.contact_stiffness), top, 4000
        )
        values = [self.lowest(amplitude)[0] for amplitude in grid]
        found = []
        for low, high, at_low, at_high in zip(grid, grid[1:], values, values[1:], strict=False):
            if at_low < 0 <= at_high:
                amplitude = brentq(lambda a: self.lowest(a)[0], low, high, xtol=1e-300, rtol=1e-15)
                found.append((self.lowest(float(amplitude))[1], float(amplitude)))
        return found


def slider_coefficients(
    orders: np.ndarray,
    is_sine: np.ndarray,
    coefficients: np.ndarray,
    contact_stiffness: float,
    slip_limit: float,
) -> tuple[np.ndarray, int, float]:
    """Force coefficients of one contact by Gauss quadrature, reversals, and share of slip.

    Reversals are eigenvalues of a companion matrix, the slider is marched twice around the
    period, every onset is bracketed by brentq.
    """

    def basis(tau, derivative=0):
        argument = np.multiply.outer(tau, orders) + derivative * np.pi / 2
        return orders**derivative * np.where(is_sine, np.sin(argument), np.cos(argument))

    def y(tau):
        return basis(tau) @ coefficients

    reversals = _zeros_of_slope(orders, is_sine, coefficients)
    reversals = [t for t in reversals if np.isfinite(t)]
    start = max(reversals, key=lambda t: float(y(t)))
    turns = sorted((t - start) % (2 * np.pi) for t in reversals if t != start)
    nodes = start + np.array([0.0, *turns, 2 * np.pi])
    pieces: list[tuple[float, float, Callable]] = []
    force, slipping = 0.0, 0.0
    for _ in range(2):
        pieces, slipping = [], 0.0
        for left, right in pairwise(nodes):
            trial = force + contact_stiffness * float(y(right) - y(left))
            end = float(np.clip(trial, -slip_limit, slip_limit))
            onset = right
            if end != trial:
                target = float(y(left)) + (end - force) / contact_stiffness
                ahead = float(y(left) - target), float(y(right) - target)
                if ahead[0] * ahead[1] < 0:
                    onset = brentq(lambda t, c=target: float(y(t)) - c, left, right, xtol=1e-15)
                elif abs(ahead[0]) < abs(ahead[1]):
                    onset = left
            offset = force - contact_stiffness * float(y(left))
            pieces.append((left, onset, lambda t, o=offset: contact_stiffness * y(t) + o))
            pieces.append((onset, right, lambda t, e=end: np.full_like(t, e)))
            slipping += right - onset
            force = end
    # A contact that has settled between its limits touches one of them, to round-off.
    if slipping < 1e-6 and slip_limit > 0:
        slipping = 0.0
        middle = (max(y(nodes)) + min(y(nodes))) / 2
        pieces = [
            (left, right, lambda t: contact_stiffness * (y(t) - middle))
            for left, right, _ in pieces
        ]
    points, weights = np.polynomial.legendre.leggauss(60)
    result = np.zeros(len(orders))
    for left, right, function in pieces:
        tau = (left + right) / 2 + (right - left) / 2 * points
        result += (right - left) / 2 * (basis(tau).T @ (weights * function(tau)))
    return result / np.where(orders == 0, 2 * np.pi, np.pi), len(reversals), slipping / (2 * np.pi)


def _zeros_of_slope(orders, is_sine, coefficients) -> list[float]:
    highest = int(max(orders))
    polynomial = np.zeros(2 * highest + 1, dtype=complex)
    for n, sine, value in zip(orders.astype(int), is_sine, coefficients, strict=True):
        # Slope of cos: -n sin; of sin: n cos; sin = (z - 1/z) / 2i, cos = (z + 1/z) / 2.
        up = n * value / 2 * (1.0 if sine else 1j)
        polynomial[highest - n] += up
        polynomial[highest + n] += np.conj(up)
    roots = np.roots(polynomial)
    on_circle = roots[np.abs(np.abs(roots) - 1) < 1e-7]
    return sorted(float(angle) for angle in np.angle(on_circle))
