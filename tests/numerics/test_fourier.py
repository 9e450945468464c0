"""Basis, integrals and extremes of trigonometric polynomials."""

from itertools import pairwise
from math import comb

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad_vec

from symhbm.numerics import FourierBasis, largest_displacement, turning_points

HARMONICS = [(1,), (0, 1), (1, 3), (0, 1, 2, 3), (2, 5), (3,)]


@pytest.mark.parametrize("harmonics", HARMONICS)
def test_derivative_of_the_basis_is_that_of_differences(harmonics):
    basis, tau, h = FourierBasis(harmonics), np.linspace(0, 6, 7), 1e-5
    for order in (1, 2):
        difference = (basis.values(tau + h, order - 1) - basis.values(tau - h, order - 1)) / (2 * h)
        # Central differences: error h^2/6 times the third derivative, at most 5^5 here.
        np.testing.assert_allclose(basis.values(tau, order), difference, rtol=0, atol=1e-6)


@pytest.mark.parametrize("harmonics", HARMONICS)
def test_derivative_matrix_agrees_with_the_basis(harmonics):
    basis, tau = FourierBasis(harmonics), np.linspace(0, 6, 7)
    coefficients = np.arange(1.0, basis.n_components + 1)
    slope = basis.values(tau) @ (basis.derivative_matrix @ coefficients)
    np.testing.assert_allclose(slope, basis.values(tau, 1) @ coefficients, rtol=0, atol=1e-12)


@pytest.mark.parametrize("harmonics", HARMONICS)
def test_interval_integrals_agree_with_quadrature(harmonics):
    basis, ends = FourierBasis(harmonics), np.array([0.3, 1.1, 4.0])
    moments = basis.moments(ends)
    for i, (left, right) in enumerate(pairwise(ends)):
        single, _ = quad_vec(lambda t: basis.values(t), left, right, epsabs=1e-13)
        product, _ = quad_vec(
            lambda t: np.outer(basis.values(t), basis.values(t)), left, right, epsabs=1e-13
        )
        np.testing.assert_allclose(
            basis.integrals(moments[i]), single * basis.norm, rtol=0, atol=1e-12
        )
        np.testing.assert_allclose(
            basis.products(moments[i]), product * basis.norm[:, None], rtol=0, atol=1e-12
        )


def test_over_a_full_period_the_basis_is_orthonormal():
    basis = FourierBasis((0, 1, 2, 5))
    moments = basis.moments(np.array([0.7, 0.7 + 2 * np.pi]))[0]
    np.testing.assert_allclose(
        basis.products(moments), np.eye(basis.n_components), rtol=0, atol=1e-14
    )


@pytest.mark.parametrize("harmonics", [(1, 2), (1, 3, 5), (0, 1, 2, 3, 4), (1, 3, 9), (3, 9)])
def test_turning_points_are_eigenvalues(harmonics):
    """Zeros of the slope as eigenvalues of the companion matrix of a polynomial in exp(i tau)."""
    basis, rng = FourierBasis(harmonics), np.random.default_rng(11)
    coefficients = rng.normal(size=(60, basis.n_components)) / np.maximum(basis.order, 1)
    points, top = turning_points(basis, coefficients), basis.highest
    for wave, angle, count in zip(coefficients, points.angle, points.count, strict=True):
        polynomial = np.zeros(2 * top + 1, dtype=complex)
        for n in (n for n in harmonics if n):
            a, b = wave[basis.component(n)], wave[basis.component(n, True)]
            polynomial[[top + n, top - n]] = n * (b + 1j * a), n * (b - 1j * a)
        roots = np.roots(polynomial[::-1])
        # Eigenvalues are good to about 1e-13 unless two nearly meet; none do here.
        zeros = np.sort(np.angle(roots[np.abs(np.abs(roots) - 1) < 1e-9]) % (2 * np.pi))
        assert len(zeros) == count
        found = np.sort(angle[:count] % (2 * np.pi))
        np.testing.assert_allclose(found, zeros, rtol=0, atol=1e-9)


def test_turning_points_of_odd_harmonics_mirror():
    basis, rng = FourierBasis((1, 3, 7)), np.random.default_rng(3)
    points = turning_points(basis, rng.normal(size=(20, basis.n_components)))
    for angle, value, count in zip(points.angle, points.value, points.count, strict=True):
        half = count // 2
        # Half a turn is added: round-off of one sum.
        np.testing.assert_allclose(angle[half:count], angle[:half] + np.pi, rtol=1e-15)
        np.testing.assert_array_equal(value[half:count], -value[:half])


def test_a_triple_zero_of_the_slope_is_one_turning_point():
    """y' = 9 (sin(3 tau) / 3 - sin(tau)) = -12 sin(tau)^3."""
    basis = FourierBasis((1, 3))
    points = turning_points(basis, np.array([[9.0, 0.0, -1.0, 0.0]]))
    assert points.count.tolist() == [2]
    assert points.value[0].tolist() == pytest.approx([8.0, -8.0], rel=1e-15)


@pytest.mark.parametrize("power", [3, 5, 7, 9])
def test_round_off_at_a_multiple_zero_is_no_crowd(power):
    """y' = sin(tau - phase)^power: never more turning points than a motion can have."""
    harmonics = range(1, power + 1, 2)
    basis, rng = FourierBasis(tuple(harmonics)), np.random.default_rng(power)
    phase, half = rng.uniform(0, 2 * np.pi, 60), (power - 1) // 2
    waves = np.zeros((len(phase), basis.n_components))
    for n in harmonics:
        size = (-1.0) ** ((n - 1) // 2) * comb(power, half - (n - 1) // 2) / 2 ** (power - 1)
        waves[:, basis.component(n)] = -size / n * np.cos(n * phase)
        waves[:, basis.component(n, True)] = -size / n * np.sin(n * phase)
    points = turning_points(basis, waves)
    # Round-off of the slope hides the root of it of that power.
    width = (1e-15) ** (1 / power)
    for wave, at, angle, value, count in zip(
        waves, phase, points.angle, points.value, points.count, strict=True
    ):
        assert 2 <= count <= 2 * power
        apart = (angle[:count] - at + np.pi / 2) % np.pi - np.pi / 2
        assert np.abs(apart).max() < 2 * width
        # Between them the motion does not move.
        top = basis.values(at + np.pi) @ wave
        np.testing.assert_allclose(np.abs(value), top, rtol=1e-14)


def test_a_slope_that_touches_zero_turns_nothing():
    """y' = (1 + cos(tau)) (cos(tau) - 1/2) has a double zero at pi, and is 0 there to the bit."""
    wave = np.array([0.0, 1.0, 0.0, 0.5])
    points = turning_points(FourierBasis((1, 2)), np.stack([wave, -wave]))
    assert points.count.tolist() == [2, 2]
    third = np.pi / 3
    expected = [[third, 5 * third], [5 * third, 7 * third]]
    np.testing.assert_allclose(points.angle, expected, rtol=1e-14)


def test_turning_points_of_any_size():
    """Scaling moves none; motions that are not finite are refused."""
    basis, rng = FourierBasis((0, 1, 2, 5)), np.random.default_rng(8)
    waves = rng.normal(size=(30, basis.n_components))
    points = turning_points(basis, waves)
    for size in (2.0**-1000, 2.0**1016):
        scaled = turning_points(basis, waves * size)
        np.testing.assert_array_equal(scaled.count, points.count)
        np.testing.assert_allclose(scaled.angle, points.angle, rtol=0, atol=1e-13)
        np.testing.assert_allclose(scaled.value / size, points.value, rtol=0, atol=1e-14)
    waves[3, 0] = np.inf
    with pytest.raises(FloatingPointError, match="not finite"):
        turning_points(basis, waves)


@pytest.mark.parametrize("gap", [1e-1, 1e-3, 1e-5])
def test_a_close_pair_of_turning_points_is_not_missed(gap):
    """y' = sin(tau) (p + cos(tau)): beside 0 and pi it vanishes at pi +- gap, or nowhere."""
    basis = FourierBasis((1, 2))
    for p, expected in ((1 - gap**2 / 2, 4), (1 + gap**2 / 2, 2)):
        coefficients = np.array([[-p, 0.0, -0.25, 0.0]])
        assert turning_points(basis, coefficients).count[0] == expected


def test_no_motion_has_no_turning_point():
    basis = FourierBasis((0, 1, 3))
    coefficients = np.zeros((2, basis.n_components))
    coefficients[1, 0] = -3.0
    points = turning_points(basis, coefficients)
    assert list(points.count) == [0, 0]
    assert list(largest_displacement(basis, coefficients)[0]) == [0.0, 3.0]


def test_largest_displacement_of_one_harmonic_is_its_radius():
    basis = FourierBasis((1,))
    amplitude, angle = largest_displacement(basis, np.array([[3.0, -4.0]]))
    assert amplitude[0] == pytest.approx(5.0, rel=1e-15)
    assert abs(basis.values(angle[0]) @ [3.0, -4.0]) == pytest.approx(5.0, rel=1e-15)


@given(
    st.sampled_from([(1, 3), (0, 1), (0, 1, 2, 3), (2, 5), (0, 1, 4), (1, 3, 5, 7, 9)]),
    st.integers(0, 2**32 - 1),
    st.floats(-6, 6),
)
@settings(max_examples=60)
def test_largest_displacements_are_those_of_all_turning_points(harmonics, seed, spread):
    """Cells that bounds leave out hold nothing larger, whatever harmonic leads."""
    basis, rng = FourierBasis(harmonics), np.random.default_rng(seed)
    sizes = 10.0 ** rng.uniform(min(spread, 0), max(spread, 0), (20, basis.n_components))
    motions = rng.normal(size=sizes.shape) * sizes
    motions[0] = 0.0
    motions[1, basis.order > 0] = 0.0
    # Maxima that differ by little: cells between the values of a grid decide.
    motions[2:12, -2:] = 1e3 * np.abs(motions[2:12]).max() * rng.normal(size=(10, 2))
    largest, angle = largest_displacement(basis, motions)
    points = turning_points(basis, motions)
    expected = np.abs(points.value).max(axis=1)
    # The sum of some waves, each rounded.
    error = 4e-16 * basis.n_components * np.abs(motions).sum(axis=1)
    assert np.all(np.abs(largest - expected) <= error)
    there = np.abs(np.einsum("im,im->i", basis.values(angle), motions))
    assert np.all(np.abs(there - largest) <= error)
