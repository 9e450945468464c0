"""Cubic springs against the polynomials of the one-harmonic Duffing oscillator."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import brentq

import symhbm as sh
from tests.quick import quick_first

TWO_PI = 2 * np.pi
PUBLISHED_FOLDS = (1.11558592718198, 1.26753695951261)
PUBLISHED_MAXIMUM = 2.8416245993690933


@dataclass(frozen=True)
class Duffing:
    """One harmonic of ``m x'' + c x' + k x + gamma x^3 = F cos(omega t)``.

    With ``z = a^2``, ``W = omega^2`` and ``D = k - m W`` the balance is the cubic
    ``9/16 gamma^2 z^3 + 3/2 gamma D z^2 + (D^2 + c^2 W) z = F^2``.
    """

    mass: float = 1.0
    damping: float = 0.05
    stiffness: float = 1.0
    cubic: float = 0.1
    force: float = 0.18

    def problem(self, harmonics=(1,)):
        model = sh.Model(
            [[self.mass]],
            [[self.damping]],
            [[self.stiffness]],
            contacts=[(0,)],
            cubic_stiffness=self.cubic,
        )
        return sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=self.force), harmonics)

    def by_square(self, omega):
        """Coefficients of the cubic in ``z`` without its last, highest power first."""
        d = self.stiffness - self.mass * omega**2
        return 9 / 16 * self.cubic**2, 1.5 * self.cubic * d, d**2 + (self.damping * omega) ** 2

    def amplitudes(self, omega, force=None):
        """All amplitudes, ascending; roots polished in extended precision, as folds need."""
        force = self.force if force is None else force
        a, b, c = (np.longdouble(v) for v in self.by_square(np.longdouble(omega)))
        square = np.longdouble(force) ** 2
        roots = np.roots(np.array([a, b, c, -square], dtype=float))
        # Pairs closer than 1e-7 may come out complex: the discriminant tells how many are real.
        discriminant = b**2 * c**2 - 4 * a * c**3 + 4 * b**3 * square - 27 * a**2 * square**2
        discriminant -= 18 * a * b * c * square
        roots = roots.real if discriminant > 0 else roots[np.argsort(np.abs(roots.imag))[:1]].real
        roots = np.sort(roots).astype(np.longdouble)
        for _ in range(4):
            value = ((a * roots + b) * roots + c) * roots - square
            roots = roots - value / ((3 * a * roots + 2 * b) * roots + c)
        return np.sqrt(roots).astype(float)

    def folds_in_frequency(self):
        """Angular frequencies of the folds of the branch from rest, ascending.

        ``dF/dz = 0`` has two roots ``z``, equal at the cusp; each gives the force of a fold over
        frequency, and the fold at a given force is the first one beyond the cusp.
        """
        cusp = self.cusp()[0]

        def distance(omega, side):
            d = self.stiffness - self.mass * omega**2
            root = np.sqrt(max(d**2 - 3 * (self.damping * omega) ** 2, 0.0))
            z = 4 / 9 * (-2 * d * np.sign(self.cubic) + side * root) / abs(self.cubic)
            a, b, c = self.by_square(omega)
            return ((a * z + b) * z + c) * z / self.force**2 - 1

        found = []
        places = cusp * (1 + np.sign(self.cubic) * np.append(0, np.geomspace(1e-12, 20, 4000)))
        for side in (-1, 1):
            values = [distance(omega, side) for omega in places[places > 0]]
            crossing = np.flatnonzero((np.array(values[1:]) > 0) & (np.array(values[:-1]) <= 0))
            if len(crossing):
                ends = sorted(places[crossing[0] : crossing[0] + 2])
                found.append(brentq(distance, *ends, args=(side,), xtol=1e-300, rtol=1e-15))
        return sorted(found)

    def folds_in_force(self, omega):
        """Forces of the folds at one frequency, ascending: ``d(F^2)/dz = 0``."""
        a, b, c = self.by_square(omega)
        roots = np.roots([3 * a, 2 * b, c])
        if np.iscomplexobj(roots) or roots.min() <= 0:
            return []
        return sorted(float(np.sqrt(((a * z + b) * z + c) * z)) for z in roots)

    def maximum(self):
        """Largest amplitude of the branch from rest and its angular frequency: ``dz/dW = 0``."""
        m, c = self.mass, self.damping
        linear = self.stiffness * c**2 / m - c**4 / (4 * m**2)
        z = np.roots([0.75 * self.cubic * c**2 / m, linear, -(self.force**2)])
        assert np.isrealobj(z)
        z = z[z > 0].min()
        square = (self.stiffness + 0.75 * self.cubic * z) / m - c**2 / (2 * m**2)
        return float(np.sqrt(z)), float(np.sqrt(square))

    def cusp(self):
        """Angular frequency and force at which two folds are born: ``D = -sign sqrt(3) c w``."""
        sign = np.sign(self.cubic)
        half = sign * np.sqrt(3) * self.damping / (2 * self.mass)
        omega = half + np.sqrt(half**2 + self.stiffness / self.mass)
        a, b, c = self.by_square(omega)
        z = -b / (3 * a)
        return float(omega), float(np.sqrt(((a * z + b) * z + c) * z))


NOMINAL = Duffing()
SOFTENING = Duffing(cubic=-0.01)
BAND = (0.5 / TWO_PI, 2.5 / TWO_PI)


def folds_of(curve, name, others=()):
    kinds = curve.event_kind.values
    assert set(kinds) <= {"fold", *others}
    assert set(curve.event_contact.values) <= {-1}
    return curve[f"event_{name}"].values[kinds == "fold"]


def test_the_reference_itself():
    # The digits that were published.
    np.testing.assert_allclose(NOMINAL.folds_in_frequency(), PUBLISHED_FOLDS, rtol=1e-13)
    assert NOMINAL.maximum()[0] == pytest.approx(PUBLISHED_MAXIMUM, rel=1e-14)
    assert len(SOFTENING.folds_in_frequency()) == 2


@pytest.mark.parametrize("oscillator", [NOMINAL, SOFTENING], ids=["hardening", "softening"])
@pytest.mark.parametrize("band", [BAND, BAND[::-1]], ids=["up", "down"])
def test_folds_and_maximum_over_frequency(oscillator, band):
    curve = sh.frf(oscillator.problem(), band, throw=True)
    expected = oscillator.folds_in_frequency()
    # The order of a Duffing curve's folds: up a hardening one, the upper fold comes first.
    along = expected[::-1] if band == BAND else expected
    # 1e-9 is the accuracy promised; a fold is second order in the error of its amplitude.
    np.testing.assert_allclose(TWO_PI * folds_of(curve, "frequency"), along, rtol=1e-9)
    amplitude, omega = oscillator.maximum()
    assert int(curve.n_peaks) == 1
    assert curve.peak_kind.values.tolist() == ["smooth"]
    assert float(curve.peak_amplitude[0]) == pytest.approx(amplitude, rel=1e-9)
    assert TWO_PI * float(curve.peak_frequency[0]) == pytest.approx(omega, rel=1e-9)
    # Every fold is a point of the path, where the path turns back, and nowhere else.
    frequency = curve.frequency.values
    turns = 1 + np.flatnonzero(np.diff(np.sign(np.diff(frequency))))
    np.testing.assert_array_equal(frequency[turns], curve.event_frequency)
    assert frequency[[0, -1]].tolist() == list(band)
    for value, found in zip(frequency, curve.amplitude.values[:, 0], strict=True):
        # Next to a fold an amplitude has half the digits of its frequency: compare the balance.
        a, b, c = oscillator.by_square(TWO_PI * value)
        z = found**2
        force = np.sqrt(((a * z + b) * z + c) * z)
        assert force == pytest.approx(oscillator.force, rel=1e-9)


@pytest.mark.parametrize(
    ("oscillator", "omega"),
    [(NOMINAL, 1.2), (NOMINAL, 1.5), (NOMINAL, 0.9), (SOFTENING, 0.9), (SOFTENING, 1.2)],
)
@pytest.mark.parametrize("upwards", [True, False])
def test_folds_over_force(oscillator, omega, upwards):
    expected = oscillator.folds_in_force(omega)
    assert len(expected) == (2 if (omega > 1) == (oscillator.cubic > 0) else 0)
    band = (0.01, 2 * expected[1] if expected else 0.5)
    curve = sh.follow(
        oscillator.problem(),
        "force_amplitude",
        band if upwards else band[::-1],
        frequency=omega / TWO_PI,
        throw=True,
    )
    along = expected[::-1] if upwards else expected
    np.testing.assert_allclose(folds_of(curve, "force_amplitude"), along, rtol=1e-9)
    assert int(curve.n_peaks) == 0
    amplitude, force = curve.amplitude.values[:, 0], curve.force_amplitude.values
    a, b, c = oscillator.by_square(omega)
    z = amplitude**2
    np.testing.assert_allclose(force, np.sqrt(((a * z + b) * z + c) * z), rtol=1e-9)
    assert np.all(np.diff(amplitude) * (1 if upwards else -1) > 0)


def check_solutions(result, name, oscillator, reference):
    """All solutions on a grid are the roots of the cubic, each once."""
    assert result.amplitude.dims == (name, "solution", "dof")
    for i, value in enumerate(result[name].values):
        expected = reference(float(value))
        assert int(result.n_solutions[i]) == len(expected), value
        found = result.amplitude.values[i, :, 0]
        assert np.isnan(found[len(expected) :]).all()
        assert not result.converged.values[i, len(expected) :].any()
        assert result.converged.values[i, : len(expected)].all()
        # Required: 1e-9.
        np.testing.assert_allclose(np.sort(found[: len(expected)]), expected, rtol=1e-9)


BOTH_WAYS = [(NOMINAL, False), (SOFTENING, True), (NOMINAL, True), (SOFTENING, False)]


@pytest.mark.parametrize(("oscillator", "down"), quick_first(BOTH_WAYS, 2))
def test_solutions_at_given_frequencies(oscillator, down):
    folds = oscillator.folds_in_frequency()
    near = [f * (1 + s * d) for f in folds for d in (1e-3, 1e-6, 1e-9) for s in (-1, 1)]
    grid = np.sort(np.append(near, np.linspace(0.55, 2.4, 30))) / TWO_PI
    result = sh.frf(oscillator.problem(), BAND[::-1] if down else BAND, at=grid, throw=True)
    assert result.sizes["solution"] == 3
    check_solutions(
        result, "frequency", oscillator, lambda hertz: oscillator.amplitudes(TWO_PI * hertz)
    )


# Beside friction.
