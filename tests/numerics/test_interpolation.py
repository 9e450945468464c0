"""Cubic interpolation."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from symhbm.numerics.loops.interpolation import (
    amplitude_at,
    amplitude_between,
    cubic,
    cubic_slope,
    cubic_top,
    differentiate,
    first_zero,
    interpolate,
)


def test_against_scipy():
    rng = np.random.default_rng(0)
    left, right, first, second = rng.normal(size=(4, 3))
    share = np.linspace(0, 1, 9)
    spline = CubicHermiteSpline([0, 1], [left, right], [first, second])
    ends = left, right, (first, second), share[:, None]
    np.testing.assert_allclose(cubic(*ends), spline(share), rtol=0, atol=1e-14)
    np.testing.assert_allclose(cubic_slope(*ends), spline(share, 1), rtol=0, atol=1e-13)


def test_the_top_of_a_cubic():
    """Also next to an end, of parabolas, and of lines but for round-off."""
    rng = np.random.default_rng(1)
    share = np.linspace(0, 1, 4001)
    for _ in range(300):
        left, right, first, last = rng.normal(size=4) * 10.0 ** rng.uniform(-6, 2, size=4)
        slopes = abs(first), -abs(last)
        if rng.random() < 0.2:
            right = left + (slopes[0] + slopes[1]) / 2
        at, top = cubic_top(left, right, slopes)
        assert 0 <= at <= 1
        round_off = 1e-14 * (abs(left) + abs(right) + sum(map(abs, slopes)))
        assert top == pytest.approx(float(cubic(left, right, slopes, at)), abs=round_off)
        assert top >= cubic(left, right, slopes, share).max() - round_off


def test_the_first_zero_of_a_cubic():
    rng = np.random.default_rng(2)
    share = np.linspace(0, 1, 4001)
    several = 0
    for _ in range(500):
        left, right = np.array([1, -1]) * rng.choice([-1, 1]) * 10.0 ** rng.uniform(-9, 1, size=2)
        slopes = tuple(rng.normal(size=2) * 10.0 ** rng.uniform(-3, 2))
        if rng.random() < 0.2:
            slopes = (right - left,) * 2
        at = first_zero(left, right, slopes)
        assert 0 < at < 1
        aside = np.array([at - 1e-8, at + 1e-8])
        before, beyond = cubic(left, right, slopes, aside) * left
        assert before > 0 > beyond
        changes = np.flatnonzero(np.diff(np.sign(cubic(left, right, slopes, share))))
        several += len(changes) > 1
        assert at <= share[changes[0] + 1]
    assert several > 20


def test_many_pairs_at_once():
    rng = np.random.default_rng(3)
    left, right, first, last = rng.normal(size=(4, 6, 5))
    share = np.array([0.0, 0.2, 1.0])
    ends = left[:, None], right[:, None], (first[:, None], last[:, None]), share[:, None]
    for compiled in (True, False):
        values, rates = np.empty((2, 6, 3, 4))
        for loop, result in ((interpolate, values), (differentiate, rates)):
            run = loop if compiled else loop.__wrapped__
            run(left, right, first, last, share, result)
        np.testing.assert_allclose(values, cubic(*ends)[..., :4], rtol=1e-13, atol=1e-15)
        np.testing.assert_allclose(rates, cubic_slope(*ends)[..., :4], rtol=1e-13, atol=1e-14)


@settings(max_examples=60)
@example(seed=2920)
@given(seed=st.integers(0, 2**32 - 1))
def test_amplitudes_between_two_points(seed):
    """Cubic in the logarithm, in the square between a fall and a rise, in the root at a fold."""
    rng = np.random.default_rng(seed)
    left, right = rng.random(2) * 10.0 ** rng.uniform(-3, 1, 2)
    first, last = rng.normal(size=2) * 10.0 ** rng.uniform(-2, 2, 2)
    share = rng.random()
    if rng.random() < 0.3:
        last = rng.choice([-1, 1]) * np.inf
        root = np.sqrt(1 - share)
        bend = 2 * -first - (left - right)
        expected = right + (left - right - bend) * root + bend * root**2
    elif first < 0 < last:
        square = cubic(left**2, right**2, (2 * left * first, 2 * right * last), share)
        expected = np.sqrt(max(square, (1e-3 * min(left, right)) ** 2))
    else:
        mean = np.log(right / left)
        slopes = [slope / at for slope, at in ((first, left), (last, right))]
        slopes = [mean * min(s / mean, 3) if s * mean > 0 else s for s in slopes]
        level = cubic(np.log(left), np.log(right), tuple(slopes), share)
        expected = np.exp(min(level, 700.0))
    for kind in (amplitude_at, amplitude_at.__wrapped__):
        assert kind(left, right, first, last, share) == pytest.approx(expected, rel=1e-9)
    assert amplitude_between(left, right, (first, last), share) == pytest.approx(expected, rel=1e-9)


def test_a_cubic_that_hardly_rises_at_first_has_its_top_where_it_falls():
    """Its first slope is lost in the square of its bend."""
    share, top = cubic_top(0.0, 0.0, (1e-20, -1.0))
    assert (share, top) == pytest.approx((2 / 3, 4 / 27))
    assert cubic_top(0.5, 0.5, (1e-200, -1e-200))[1] == 0.5
    assert cubic_top(0.5, 0.5, (1e-200, -2e-200)) == (0.0, 0.5)
