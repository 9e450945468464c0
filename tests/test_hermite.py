"""Cubic interpolation."""

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from symhbm.hermite import cubic, cubic_slope


def test_against_scipy():
    rng = np.random.default_rng(0)
    left, right, first, second = rng.normal(size=(4, 3))
    share = np.linspace(0, 1, 9)
    spline = CubicHermiteSpline([0, 1], [left, right], [first, second])
    ends = left, right, (first, second), share[:, None]
    np.testing.assert_allclose(cubic(*ends), spline(share), rtol=0, atol=1e-14)
    np.testing.assert_allclose(cubic_slope(*ends), spline(share, 1), rtol=0, atol=1e-13)
